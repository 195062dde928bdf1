// The benchmark as a program: it goes on where it stopped, a stored report comes back byte for byte, and an
// interruption ends it with status 130 and nothing half-written.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <set>
#include <thread>

#include "bench/bench_report.hpp"
#include "bench/session.hpp"
#include "geometry/input_error.hpp"
#include "report/csv_text.hpp"
#include "support/program.hpp"

namespace trocar::bench {
namespace {

int run_bench(const std::string& arguments) {
    const int status = std::system((std::string(TROCAR_BENCH) + " " + arguments + " >/dev/null 2>&1").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::map<std::string, std::string> files_of(const std::filesystem::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file()) files[entry.path().lexically_relative(folder)] = test::read_file(entry.path());
    }
    return files;
}

TEST(BenchProgram, FinishedCellsAreKeptAndTheReportComesBackByteForByte) {
    const test::TemporaryFolder folder;
    const std::string command = "detection --quick --only \"bodies: 4 \" --output " + folder.path().string();
    ASSERT_EQ(run_bench(command), 0);
    const std::map<std::string, std::string> first = files_of(folder.path());
    ASSERT_TRUE(first.contains("records.jsonl"));
    ASSERT_TRUE(first.contains("report.md"));
    ASSERT_TRUE(first.contains("report.html"));
    ASSERT_TRUE(first.contains("results.csv"));
    const auto rows = test::csv_rows(first.at("results.csv"));
    EXPECT_GT(rows.size(), 1U);
    EXPECT_EQ(std::set<std::string>(rows[0].begin(), rows[0].end()).size(), rows[0].size()) << "every header once";
    std::set<std::string> explained;
    for (const auto& row : test::csv_rows(first.at("figures.csv"))) explained.insert(row[0]);
    for (const std::string& column : rows[0]) EXPECT_TRUE(explained.contains(column)) << column;
    ASSERT_TRUE(first.contains("charts/time_against_bodies.svg"));
    // Times never repeat to the nanosecond: the same records mean that nothing was measured again.
    ASSERT_EQ(run_bench(command), 0);
    EXPECT_EQ(files_of(folder.path()), first);
    for (const auto& [name, content] : first) {
        if (name.starts_with("report") || name.starts_with("charts")) std::filesystem::remove(folder.path() / name);
    }
    ASSERT_EQ(run_bench("report " + folder.path().string()), 0);
    EXPECT_EQ(files_of(folder.path()), first);

    const std::vector<CellRecord> records = read_cells(folder.path() / "records.jsonl");
    ASSERT_EQ(records.size(), 1U);
    EXPECT_EQ(to_json_line(records[0]) + "\n", first.at("records.jsonl"));
    EXPECT_EQ(records[0].spec.bodies, 4);

    // A cell that was cut off in the middle is measured again.
    for (const auto& [name, content] : first) {
        if (name.starts_with("cells/")) std::filesystem::resize_file(folder.path() / name, content.size() / 2);
    }
    ASSERT_EQ(run_bench(command), 0);
    EXPECT_NE(test::read_file(folder.path() / "records.jsonl"), first.at("records.jsonl"));
}

TEST(BenchProgram, InterruptionEndsWith130AndLeavesNoResult) {
    const test::TemporaryFolder folder;
    const pid_t child = fork();
    if (child == 0) {
        (void)!freopen("/dev/null", "w", stderr);
        execl(TROCAR_BENCH, TROCAR_BENCH, "detection", "--quick", "--output", folder.path().c_str(),
              static_cast<char*>(nullptr));
        _exit(127);
    }
    // Interrupted in the middle of the first cell, which takes seconds.
    while (!std::filesystem::exists(folder.path() / "lock")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    ASSERT_EQ(kill(child, SIGINT), 0);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 130);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "records.jsonl"));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "report.md"));
}

TEST(BenchProgram, BadInputEndsWithStatusTwo) {
    const test::TemporaryFolder folder;
    EXPECT_EQ(run_bench("report " + folder.path().string()), 2);
    EXPECT_EQ(run_bench("detection --only \"no such cell\""), 2);
    EXPECT_EQ(run_bench("nonsense"), 2);
    {
        std::ofstream stream(folder.path() / "records.jsonl");
        stream << "{\"format\":\"trocar-bench-2\"}\n";
    }
    EXPECT_EQ(run_bench("report " + folder.path().string()), 2);
}

/// A record made by hand, so that what the report says can be known without measuring.
CellRecord made_up(const std::string& id) {
    CellRecord record;
    record.spec.id = id;
    record.spec.quick = true;
    record.binary = "0123456789abcdef";
    record.environment = {{"cpu", "none"}};
    record.triangles = 22000;
    record.measurement.true_pairs = 200;
    for (const auto& [label, own, ns] :
         {std::tuple{"ohc", true, 100000}, {"embree_collide", false, 600000}, {"fcl_bvh", false, 4000000}}) {
        MethodResult row;
        row.label = row.method = label;
        row.library = "made up";
        row.family = own ? "ohc" : "tree";
        row.own = row.claims_exact = own;
        for (std::int64_t step = 4; step < 24; ++step) {
            row.step.push_back(step);
            row.update_ns.push_back(ns / 4 + step);
            row.detect_ns.push_back(3 * ns / 4);
            row.wall_ns.push_back(ns + step);
        }
        row.true_pairs = 400;
        row.truth_steps = 2;
        record.measurement.methods.push_back(row);
    }
    return record;
}

TEST(BenchReport, RatiosAreTheOnesOfTheRecords) {
    const BenchReport report = make_report({made_up("size: light 20k x 2k")});
    const std::string& text = report.files.at("report.md");
    EXPECT_NE(text.find("| size: light 20k x 2k | `embree_collide` | 600 | 600, `embree_collide` | 6.00 | 15.0 | 6.00 "
                        "[6.00, 6.00]"),
              std::string::npos)
        << text.substr(0, 1500);
    EXPECT_NE(text.find("| size: light 20k x 2k | `fcl_bvh` | 4000 | 600, `embree_collide` | 30.0 | 75.0 | 40.0 [40.0, "
                        "40.0] first step |"),
              std::string::npos)
        << text.substr(0, 1500);
    EXPECT_TRUE(report.broken_claims.empty());
}

TEST(BenchReport, RowsWithinQueryDistanceStandBesideTheirsForMeetingPairs) {
    CellRecord record = made_up("reach: light 20k x 2k");
    record.spec.group = Group::query_distance;
    record.query_distance = 0.0003;
    record.measurement.true_near_pairs = 395;
    for (std::size_t k = 0; k < 3; ++k) {
        MethodResult row = record.measurement.methods[k];
        row.label += within_query_distance;
        row.within_query_distance = true;
        row.near_pairs = 395;
        for (std::size_t i = 0; i < row.step.size(); ++i) row.detect_ns[i] += row.update_ns[i] + row.detect_ns[i];
        if (k == 2) row.outcome = {OutcomeKind::unsupported, "cannot"};
        record.measurement.methods.push_back(row);
    }
    const CellRecord again = cell_from_json_line(to_json_line(record), "made up", 1);
    EXPECT_EQ(to_json_line(again), to_json_line(record));
    const std::string text = to_markdown(make_report({again}).document);
    EXPECT_NE(text.find("| `ohc` | 100 | 200 | 2.00 [2.00, 2.00] | 6.00 [6.00, 6.00] | n/a |"), std::string::npos)
        << text;
    EXPECT_NE(
        text.find(
            "Query distance 0.300 mm; 200 true pairs meet, 395 more are within the query distance. Not asked within "
            "the query distance, which they cannot: `fcl_bvh`."),
        std::string::npos)
        << text;
}

TEST(BenchReport, AWrongAnswerIsNeverAFastOne) {
    CellRecord record = made_up("size: light 20k x 2k");
    record.measurement.methods[0].false_negatives = 3;
    const BenchReport report = make_report({record});
    ASSERT_EQ(report.broken_claims.size(), 1U);
    EXPECT_NE(report.files.at("report.md").find("n/a (misses 3 and invents 0 of 400)"), std::string::npos);
}

}  // namespace
}  // namespace trocar::bench
