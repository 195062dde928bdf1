// The plans of the studies whose reports are published have the very runs that those reports hold.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "measure/record.hpp"
#include "report/report.hpp"
#include "study/study.hpp"

namespace trocar {
namespace {

const std::filesystem::path project = TROCAR_SOURCE_DIR;

/// All of a specification but the hash of its scene.
std::string reported_run(RunSpec spec) {
    spec.scene_hash.clear();
    Record record;
    record.spec = std::move(spec);
    return to_json_line(record);
}

class PublishedPlan : public testing::TestWithParam<std::string> {};

TEST_P(PublishedPlan, HasTheRunsOfItsReport) {
    const Study study = read_study(project / "bench" / "studies" / (GetParam() + ".json"));
    const std::vector<Record> records = read_records(project / "reports" / GetParam());
    std::vector<PlannedRun> plan = make_plan(study);
    // A method that this build lacks, or that the one of the report lacked, has a row without a scene.
    std::set<std::string> absent;
    for (const PlannedRun& run : plan) {
        if (run.detector.absent_reason) absent.insert(run.spec.detector);
        if (run.response.absent_reason) absent.insert(run.spec.response);
    }
    for (const Record& record : records) {
        if (record.environment.contains("detector.absent")) absent.insert(record.spec.detector);
        if (record.environment.contains("response.absent")) absent.insert(record.spec.response);
    }
    const auto is_absent = [&absent](const RunSpec& spec) {
        return absent.contains(spec.detector) || (!spec.response.empty() && absent.contains(spec.response));
    };
    std::map<std::string, SceneFacts> facts;
    std::multiset<std::string> planned;
    for (PlannedRun& run : plan) {
        if (is_absent(run.spec)) continue;
        if (const std::string& file = run.spec.scene_file; !file.empty()) {
            const auto [known, is_new] = facts.try_emplace(file);
            if (is_new) known->second = input_facts(study.file.parent_path(), run.spec, std::nullopt);
            complete_run(known->second, run);
        }
        planned.insert(reported_run(run.spec));
    }
    std::multiset<std::string> published;
    for (const Record& record : records) {
        if (is_absent(record.spec)) continue;
        RunSpec spec = record.spec;
        // The class is a fact of meshes, which this machine may lack.
        if (const auto known = facts.find(spec.scene_file); known != facts.end() && known->second.lacks_data) {
            spec.pair_class.clear();
        }
        published.insert(reported_run(spec));
    }
    EXPECT_FALSE(planned.empty());
    EXPECT_EQ(planned, published);
}

INSTANTIATE_TEST_SUITE_P(Studies, PublishedPlan,
                         testing::Values("contact_generators", "cost_by_size", "default", "detection", "external",
                                         "far_field", "hard_cases", "paced", "resolution", "speed_sweep", "steppers",
                                         "verdict"),
                         [](const auto& study) { return study.param; });

}  // namespace
}  // namespace trocar
