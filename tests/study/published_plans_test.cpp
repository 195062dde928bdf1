// The plans of the studies whose reports are published have the very runs that those reports hold.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "report/report.hpp"
#include "study/study.hpp"

namespace trocar {
namespace {

const std::filesystem::path project = TROCAR_SOURCE_DIR;

using ReportedRun = std::tuple<std::string, std::string, std::string, std::string, std::string, std::string,
                               std::string, std::string, std::string, std::string, std::string, std::string,
                               std::int64_t, std::uint64_t, std::int64_t, std::int64_t, std::int64_t>;

ReportedRun reported_run(const RunSpec& spec) {
    return {spec.mode,       spec.scene,   spec.scene_file, spec.pair_class,   spec.detector,     spec.response,
            spec.contacts,   spec.stepper, spec.setting,    spec.overrides,    spec.knob,         spec.point,
            spec.repetition, spec.seed,    spec.ticks,      spec.truth_stride, spec.detail_stride};
}

class PublishedPlan : public testing::TestWithParam<std::string> {};

TEST_P(PublishedPlan, HasTheRunsOfItsReport) {
    const Study study = read_study(project / "bench" / "studies" / (GetParam() + ".json"));
    const std::vector<Record> records = read_records(project / "reports" / GetParam());
    std::vector<PlannedRun> plan = make_plan(study);
    // Methods that this build lacks, or that the one of the report lacked, have a row without a scene.
    std::set<std::string> absent;
    for (const PlannedRun& run : plan) {
        if (run.settled && run.settled->kind == OutcomeKind::absent) absent.insert(run.spec.detector);
    }
    for (const Record& record : records) {
        if (record.outcome.kind == OutcomeKind::absent) absent.insert(record.spec.detector);
    }
    std::map<std::string, SceneFacts> facts;
    std::map<ReportedRun, int> planned;
    for (PlannedRun& run : plan) {
        if (absent.contains(run.spec.detector)) continue;
        const auto [known, is_new] = facts.try_emplace(run.spec.scene_file);
        if (is_new && !run.spec.scene_file.empty())
            known->second = input_facts(study.file.parent_path(), run.spec, std::nullopt);
        // What stands in data outside the project is in the report, but not here.
        if (known->second.lacks_data) continue;
        if (!run.spec.scene_file.empty()) complete_run(known->second, run);
        ++planned[reported_run(run.spec)];
    }
    std::map<ReportedRun, int> published;
    for (const Record& record : records) {
        if (absent.contains(record.spec.detector)) continue;
        const auto known = facts.find(record.spec.scene_file);
        ASSERT_NE(known, facts.end()) << record.spec.scene_file;
        if (!known->second.lacks_data) ++published[reported_run(record.spec)];
    }
    for (const auto& [run, count] : planned) EXPECT_EQ(published[run], count) << testing::PrintToString(run);
    for (const auto& [run, count] : published) EXPECT_EQ(planned[run], count) << testing::PrintToString(run);
}

INSTANTIATE_TEST_SUITE_P(Studies, PublishedPlan,
                         testing::Values("contact_generators", "cost_by_size", "default", "detection", "external",
                                         "far_field", "hard_cases", "paced", "resolution", "speed_sweep", "steppers",
                                         "verdict"),
                         [](const auto& study) { return study.param; });

}  // namespace
}  // namespace trocar
