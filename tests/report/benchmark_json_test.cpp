// Runs in the formats of other programs, read by Google Benchmark's own compare.py.
#include "report/benchmark_json.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "geometry/input_error.hpp"
#include "report/table_choice.hpp"
#include "support/program.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

/// Processes of one run whose ticks take 100 µs times `factor`, and some noise.
std::vector<Record> processes_at(double factor, int count, const std::string& machine = "m1") {
    std::vector<Record> records;
    for (int i = 0; i < count; ++i) {
        const double time = factor * (100.0 + i);
        records.push_back(test::synthetic({.repetition = i, .first_tick_us = static_cast<std::int64_t>(time)}));
        records.back().environment["machine"] = machine;
    }
    return records;
}

nlohmann::json google(const std::vector<Record>& records) {
    return nlohmann::json::parse(google_benchmark_json(choose_runs(records, {})));
}

nlohmann::json dashboard(const std::vector<Record>& records, const std::vector<std::string>& metrics = {}) {
    return nlohmann::json::parse(smaller_is_better_json(choose_runs(records, {}), metrics));
}

TEST(GoogleBenchmarkJson, CompareHoldsNineProcessesAgainstNineByItsUTest) {
    const std::string compare = "/usr/share/benchmark/compare.py";
    if (!std::filesystem::exists(compare) || std::system("/usr/bin/python3 -c 'import scipy' 2>/dev/null") != 0) {
        GTEST_SKIP() << "libbenchmark-tools or python3-scipy is not installed (./test.sh full installs them)";
    }
    const test::TemporaryFolder folder;
    const auto write = [&](const char* name, double factor) {
        return folder.write(name, google_benchmark_json(choose_runs(processes_at(factor, 9), {}))).string();
    };
    const test::ProgramResult result =
        test::run_program("--no-color -d " + (folder.path() / "out.json").string() + " benchmarks " +
                              write("a.json", 1.0) + " " + write("b.json", 2.0),
                          "/usr/bin/python3 " + compare);
    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.out.find("WARNING"), std::string::npos) << "too few repetitions: " << result.out;
    const nlohmann::json report = nlohmann::json::parse(test::read_file(folder.path() / "out.json"));
    ASSERT_EQ(report.size(), 2U) << "the run, and compare.py's mean of all: " << report;
    EXPECT_EQ(report[0]["name"], "closed_loop/poke/mine + push (intersection)");
    ASSERT_EQ(report[0]["measurements"].size(), 9U);
    for (const nlohmann::json& one : report[0]["measurements"]) EXPECT_NEAR(one["time"].get<double>(), 1.0, 0.02);
    // Two samples of nine that do not overlap: below 2/C(18,9) = 4e-5 exactly, 4e-4 by the normal approximation.
    EXPECT_EQ(report[0]["utest"]["have_optimal_repetitions"], true);
    EXPECT_LT(report[0]["utest"]["time_pvalue"].get<double>(), 0.001);
}

TEST(GoogleBenchmarkJson, RunsWithoutATimeAreLeftOutAndThoseOfSeveralMachinesRefused) {
    std::vector<Record> records = processes_at(1.0, 2);
    records.push_back(test::synthetic({.scene = "stab", .outcome = {OutcomeKind::crashed, "signal 11"}}));
    records.back().environment["machine"] = "m2";
    const nlohmann::json json = google(records);
    ASSERT_EQ(json["benchmarks"].size(), 2U);
    EXPECT_EQ(json["benchmarks"][1]["real_time"], 101000.0) << "ns";
    EXPECT_EQ(json["benchmarks"][1]["repetition_index"], 1);
    EXPECT_EQ(json["context"]["host_name"], "m1");

    for (const Record& record : processes_at(1.0, 1, "m2")) records.push_back(record);
    EXPECT_THROW(google(records), InputError);
    EXPECT_EQ(choose_runs(records, {"machine=m1"}).size(), 2U);
    EXPECT_THROW(google({test::synthetic({.mode = "resolution"})}), InputError) << "runs that others may disturb";
    EXPECT_THROW(google({test::synthetic({.outcome = {OutcomeKind::crashed, "signal 11"}})}), InputError);
}

TEST(GoogleBenchmarkJson, RunsThatDifferInMoreThanTheirProcessHaveDifferentNames) {
    std::vector<Record> records = processes_at(1.0, 2);
    for (const char* setting : {"tuned", "recommended"}) {
        records.push_back(test::synthetic({}));
        records.back().spec.setting = setting;
        records.back().environment["machine"] = "m1";
    }
    std::map<std::string, int> names;
    const nlohmann::json json = google(records);
    for (const nlohmann::json& entry : json["benchmarks"]) ++names[entry["name"].get<std::string>()];
    ASSERT_EQ(names.size(), 3U);
    EXPECT_EQ(names["closed_loop/poke/mine + push (intersection)"], 2);
}

TEST(DashboardJson, HasTheMedianOverTheProcessesInTheMetricsUnit) {
    const nlohmann::json json = dashboard(processes_at(1.0, 3), {"total_median_ns", "residual_penetration_max_m"});
    ASSERT_EQ(json.size(), 2U);
    EXPECT_EQ(json[0], (nlohmann::json{{"name", "closed_loop/poke/mine + push (intersection)/total_median_ns"},
                                       {"unit", "ns"},
                                       {"value", 101000.0},
                                       {"range", "100000 to 102000"}}));
    EXPECT_EQ(json[1]["unit"], "m");
    EXPECT_DOUBLE_EQ(json[1]["value"].get<double>(), 0.0005);
}

TEST(DashboardJson, RefusesWhatIsNotBetterWhenSmallerAndTimesOfSeveralMachines) {
    std::vector<Record> records = processes_at(1.0, 2);
    for (const char* name : {"ticks", "nothing", "scene", "total_median_ns:ms"}) {
        EXPECT_THROW(dashboard(records, {name}), InputError) << name;
    }
    for (const Record& record : processes_at(3.0, 1, "m2")) records.push_back(record);
    EXPECT_THROW(dashboard(records), InputError);
    EXPECT_EQ(dashboard(records, {"residual_penetration_max_m"}).size(), 1U) << "no time";
}

}  // namespace
}  // namespace trocar
