// trocar_microbench: it has every method of the registry, writes what Google Benchmark's tools read, and reports a
// method that cannot run by its outcome.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "method/registry.hpp"
#include "scene/scene.hpp"
#include "simulate/runs.hpp"
#include "support/program.hpp"

namespace trocar::bench {
namespace {

using Json = nlohmann::json;

/// The JSON of the benchmarks that the regular expression names.
Json measured(const std::string& filter) {
    const test::ProgramResult result = test::run_program(
        "--benchmark_format=json --benchmark_min_time=0.001 --benchmark_filter='" + filter + "'", TROCAR_MICROBENCH);
    EXPECT_EQ(result.status, 0) << result.err;
    return Json::parse(result.out);
}

/// Scenes by group and method, of the names GROUP/METHOD/SCENE.
std::map<std::string, std::set<std::string>> scenes_by_method(const std::string& group) {
    const test::ProgramResult result =
        test::run_program("--benchmark_list_tests --benchmark_filter='^" + group + "/'", TROCAR_MICROBENCH);
    EXPECT_EQ(result.status, 0) << result.err;
    std::map<std::string, std::set<std::string>> scenes;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) {
        const std::size_t first = line.find('/');
        const std::size_t second = line.find('/', first + 1);
        EXPECT_TRUE(scenes[line.substr(first + 1, second - first - 1)].insert(line.substr(second + 1)).second) << line;
    }
    return scenes;
}

template <typename Entry>
void expect_all(const std::string& group, const std::vector<Entry>& entries, const std::vector<AbsentMethod>& absent) {
    std::set<std::string> registered;
    for (const Entry& entry : entries) registered.insert(entry.name);
    for (const AbsentMethod& entry : absent) registered.insert(entry.name);
    std::set<std::string> listed;
    for (const auto& [method, scenes] : scenes_by_method(group)) {
        listed.insert(method);
        for (const char* scene : {"i2i_cross", "i2r_scrape", "i2t_poke", "i2t_stab", "r2t_bone", "t2t_press"}) {
            EXPECT_TRUE(scenes.contains(scene)) << method << ' ' << scene;
        }
    }
    EXPECT_EQ(listed, registered) << group;
}

TEST(RegistryBenchmarks, HoldEveryMethodOfTheRegistry) {
    expect_all("detect", registry().detectors(), registry().absent_detectors());
    expect_all("respond", registry().responses(), registry().absent_responses());
}

TEST(RegistryBenchmarks, MeasureADetectorAndAResponseOverWholePasses) {
    const Json document = measured("^(detect/ohc_clustered|respond/penalty)/i2t_poke$");
    for (const char* key : {"commit", "flags", "compiler"}) {
        EXPECT_FALSE(document.at("context").at(key).get<std::string>().empty()) << key;
    }
    std::set<std::string> names;
    for (const Json& run : document.at("benchmarks")) {
        names.insert(run.at("name").get<std::string>());
        EXPECT_FALSE(run.contains("error_occurred")) << run.dump();
        EXPECT_GT(run.at("real_time").get<double>(), 0.0);
        EXPECT_EQ(run.at("ticks"), 1000.0);
        EXPECT_EQ(run.at("iterations").get<std::int64_t>() % 1000, 0) << "a pass is measured whole";
        EXPECT_GT(run.at("pairs_per_tick").get<double>(), 1.0);
    }
    EXPECT_EQ(names, (std::set<std::string>{"detect/ohc_clustered/i2t_poke", "respond/penalty/i2t_poke"}));
}

TEST(RegistryBenchmarks, GiveTheTimePerPairOnTheSamePairs) {
    const Json runs = measured("^per_pair/thesis/.*/i2t_poke$").at("benchmarks");
    ASSERT_EQ(runs.size(), 2U);
    EXPECT_EQ(runs[0].at("name"), "per_pair/thesis/without_test/i2t_poke");
    EXPECT_EQ(runs[1].at("name"), "per_pair/thesis/with_test/i2t_poke");
    for (const Json& run : runs) {
        EXPECT_GT(run.at("time_per_pair").get<double>(), 0.0);
        EXPECT_LT(run.at("time_per_pair").get<double>(), 1e-3) << "s";
        EXPECT_GT(run.at("pairs_per_tick").get<double>(), 1.0);
    }
    EXPECT_EQ(runs[0].at("ticks"), runs[1].at("ticks"));
    EXPECT_NEAR(runs[0].at("pairs_per_tick").get<double>(), runs[1].at("pairs_per_tick").get<double>(), 1e-9);
}

TEST(RegistryBenchmarks, EndAnAbsentMethodWithItsOutcome) {
    if (registry().absent_detectors().empty()) GTEST_SKIP() << "skipped: this build has every detector";
    const AbsentMethod& absent = registry().absent_detectors().front();
    const Json runs = measured("^detect/" + absent.name + "/i2t_poke$").at("benchmarks");
    ASSERT_EQ(runs.size(), 1U);
    EXPECT_TRUE(runs[0].at("error_occurred").get<bool>());
    EXPECT_EQ(runs[0].at("error_message"), "absent: " + absent.reason);
}

TEST(RegistryBenchmarks, EndABlownUpRunWithItsOutcome) {
    const std::filesystem::path file = std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / "i2t_stab.json";
    RunSpec spec;
    spec.mode = "closed_loop";
    spec.detector = "ohc_clustered";
    spec.response = "xpbd_contact";
    spec.contacts = default_contact_generator({.name = spec.response});
    spec.truth_stride = 0;
    const Outcome outcome = run_closed_loop(read_scene(file, std::nullopt), spec).outcome;
    ASSERT_FALSE(outcome.ok()) << "remedy: name a response and a scene of the benchmark on which it blows up";
    const Json runs = measured("^respond/xpbd_contact/i2t_stab$").at("benchmarks");
    ASSERT_EQ(runs.size(), 1U);
    EXPECT_EQ(runs[0].at("error_message"), std::string(name_of(outcome.kind)) + ": " + outcome.message);
}

TEST(RegistryBenchmarks, BadInputEndsWithStatusTwo) {
    EXPECT_EQ(test::run_program("--no_such_flag", TROCAR_MICROBENCH).status, 2);
    EXPECT_EQ(test::run_program("--benchmark_filter=no_such_benchmark", TROCAR_MICROBENCH).status, 2);
}

}  // namespace
}  // namespace trocar::bench
