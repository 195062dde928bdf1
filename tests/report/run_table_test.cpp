#include "report/run_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <regex>
#include <set>

#include "measure/metrics.hpp"
#include "report/report.hpp"
#include "report/synthetic.hpp"
#include "support/csv_text.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

using test::csv_rows;
using test::synthetic;

/// Runs of two kinds, with parameters here and there, and a message that wants quotes.
std::vector<Record> mixed_records() {
    std::vector<Record> records;
    for (const char* detector : {"mine", "theirs:bv=AABB,update=refit"}) {
        records.push_back(synthetic({.detector = detector}));
        records.push_back(synthetic({.mode = "replay", .detector = detector}));
    }
    records.push_back(
        synthetic({.response = "push:k=200", .outcome = {OutcomeKind::threw, "said \"no\", twice\nand left"}}));
    records.back().spec.device = "tip=sum,saturation=3";
    records.back().spec.overrides = "k=400";
    return records;
}

std::size_t column_of(const std::vector<std::vector<std::string>>& rows, const std::string& name) {
    const auto found = std::find(rows[0].begin(), rows[0].end(), name);
    EXPECT_NE(found, rows[0].end()) << name;
    return static_cast<std::size_t>(found - rows[0].begin());
}

/// Fields of one column, of one mode or of all.
std::vector<std::string> fields_of(const std::vector<std::vector<std::string>>& rows, const std::string& name,
                                   const std::string& mode = "") {
    std::vector<std::string> fields;
    for (std::size_t i = 1; i < rows.size(); ++i) {
        if (mode.empty() || rows[i][column_of(rows, "mode")] == mode) fields.push_back(rows[i][column_of(rows, name)]);
    }
    return fields;
}

std::map<std::string, std::string> csv_files(const std::vector<Record>& records) {
    std::map<std::string, std::string> files;
    for (const auto& [name, content] : make_report(records).files) {
        if (name.ends_with(".csv")) files[name] = content;
    }
    return files;
}

TEST(ResultsCsv, EveryHeaderStandsOnceAndIsAWordThatFiguresCsvExplains) {
    const auto files = csv_files(mixed_records());
    EXPECT_EQ(files.size(), 2U);
    std::map<std::string, std::string> unit;
    const auto dictionary = csv_rows(files.at("figures.csv"));
    EXPECT_EQ(dictionary[0], (std::vector<std::string>{"name", "unit", "better", "meaning", "source"}));
    for (std::size_t i = 1; i < dictionary.size(); ++i) {
        EXPECT_TRUE(unit.emplace(dictionary[i][0], dictionary[i][1]).second) << dictionary[i][0];
        for (const std::string& field : dictionary[i]) EXPECT_FALSE(field.empty()) << dictionary[i][0];
        EXPECT_TRUE(std::regex_search(dictionary[i][3], std::regex("^[A-Z].*; (never empty|empty: .+)")))
            << dictionary[i][0] << ": " << dictionary[i][3];
    }
    const auto rows = csv_rows(files.at("results.csv"));
    const std::set<std::string> headers(rows[0].begin(), rows[0].end());
    EXPECT_EQ(headers.size(), rows[0].size());
    EXPECT_EQ(headers.size(), unit.size()) << "figures.csv explains no other column";
    for (const std::string& header : headers) {
        EXPECT_TRUE(std::regex_match(header, std::regex("[A-Za-z][A-Za-z0-9_.]*"))) << header;
        EXPECT_TRUE(unit.contains(header)) << header;
    }
    for (const MetricInfo& info : metrics()) {
        const auto found = unit.find(std::string(info.name));
        if (found == unit.end()) continue;
        EXPECT_EQ(found->second, info.unit) << info.name;
    }
    EXPECT_EQ(unit.at("residual_penetration_max_m"), "m");
}

TEST(ResultsCsv, HoldsTheRunsOfEveryModeAndExplainsCellsThatAModeLeavesEmpty) {
    std::vector<Record> records = mixed_records();
    records[0].summary[Metric::force_error_rms_hard] = 0.5;
    records[1].summary[Metric::work_max] = 7.0;
    for (const std::size_t i : {0U, 2U, 4U}) records[i].summary.erase(Metric::work_max);
    const auto files = csv_files(records);
    const auto rows = csv_rows(files.at("results.csv"));
    EXPECT_EQ(fields_of(rows, "mode"),
              (std::vector<std::string>{"closed_loop", "replay", "closed_loop", "replay", "closed_loop"}));
    std::map<std::string, std::string> meaning;
    for (const auto& row : csv_rows(files.at("figures.csv"))) meaning[row[0]] = row[3];
    EXPECT_TRUE(meaning.at("force_error_rms_hard").ends_with("(all runs of mode replay)"));
    EXPECT_TRUE(meaning.at("work_max").ends_with("(all runs of mode closed_loop)"));
    EXPECT_TRUE(meaning.at("ticks").ends_with("or the run failed")) << "known in both modes";
}

TEST(ResultsCsv, NoColumnIsEmptyInEveryRow) {
    std::vector<Record> records = mixed_records();
    const auto headers_of = [&records] { return csv_rows(csv_files(records).at("results.csv"))[0]; };
    const auto has = [](const std::vector<std::string>& headers, const std::string& name) {
        return std::find(headers.begin(), headers.end(), name) != headers.end();
    };
    const auto rows = csv_rows(csv_files(records).at("results.csv"));
    for (std::size_t column = 0; column < rows[0].size(); ++column) {
        EXPECT_TRUE(std::any_of(rows.begin() + 1, rows.end(), [&](const auto& row) { return !row[column].empty(); }))
            << rows[0][column];
    }
    EXPECT_FALSE(has(headers_of(), "knob"));
    records[1].spec.knob = "dt";
    EXPECT_TRUE(has(headers_of(), "knob"));
}

TEST(ResultsCsv, RunsHaveIdsOfTheirOwnThatOutliveARebuild) {
    std::vector<Record> records = mixed_records();
    records.push_back(records[0]);
    records.back().spec.repetition = 1;
    const auto ids_of = [](const std::vector<Record>& runs) {
        return fields_of(csv_rows(csv_files(runs).at("results.csv")), "run_id");
    };
    const std::vector<std::string> ids = ids_of(records);
    EXPECT_EQ(std::set<std::string>(ids.begin(), ids.end()).size(), records.size());
    for (const std::string& id : ids) EXPECT_TRUE(std::regex_match(id, std::regex("[0-9a-f]{16}"))) << id;
    std::vector<Record> again;
    for (const Record& record : records) again.push_back(record_from_json_line(to_json_line(record), "file", 1));
    EXPECT_EQ(ids_of(again), ids);
    std::reverse(again.begin(), again.end());
    EXPECT_EQ(ids_of(again), std::vector<std::string>(ids.rbegin(), ids.rend()));
}

TEST(ResultsCsv, MethodsAndParametersAreColumnsOfTheirOwn) {
    const auto rows = csv_rows(csv_files(mixed_records()).at("results.csv"));
    const auto column = [&](const std::string& name, const std::string& mode = "closed_loop") {
        return fields_of(rows, name, mode);
    };
    EXPECT_EQ(column("method"), (std::vector<std::string>{"mine + push (intersection)",
                                                          "theirs:bv=AABB,update=refit + push (intersection)",
                                                          "mine + push:k=200 (intersection)"}));
    EXPECT_EQ(column("method", "replay"), (std::vector<std::string>{"mine", "theirs:bv=AABB,update=refit"}));
    EXPECT_EQ(column("detector"), (std::vector<std::string>{"mine", "theirs", "mine"}));
    EXPECT_EQ(column("detector.bv"), (std::vector<std::string>{"", "AABB", ""}));
    EXPECT_EQ(column("detector.update"), (std::vector<std::string>{"", "refit", ""}));
    EXPECT_EQ(column("response"), (std::vector<std::string>{"push", "push", "push"}));
    EXPECT_EQ(column("response", "replay"), (std::vector<std::string>{"", ""}));
    EXPECT_EQ(column("response.k"), (std::vector<std::string>{"", "", "200"}));
    EXPECT_EQ(column("contacts"), (std::vector<std::string>{"intersection", "intersection", "intersection"}));
    EXPECT_EQ(column("device.saturation"), (std::vector<std::string>{"", "", "3"}));
    EXPECT_EQ(column("overrides.k"), (std::vector<std::string>{"", "", "400"}));
    EXPECT_EQ(column("outcome"), (std::vector<std::string>{"ok", "ok", "threw"}));
    EXPECT_EQ(column("message")[2], "said \"no\", twice\nand left");
}

TEST(ResultsCsv, NumbersReadBackAsTheRecordsHaveThem) {
    const std::vector<Record> records = mixed_records();
    const auto rows = csv_rows(csv_files(records).at("results.csv"));
    int numbers = 0;
    for (const auto& [metric, value] : records[0].summary) {
        const std::string name(info_of(metric).name);
        const auto found = std::find(rows[0].begin(), rows[0].end(), name);
        if (std::isnan(value)) {
            const bool empty = found == rows[0].end() || rows[1][column_of(rows, name)].empty();
            EXPECT_TRUE(empty) << name;
        } else {
            EXPECT_EQ(std::stod(rows[1][column_of(rows, name)]), value) << name;
            ++numbers;
        }
    }
    EXPECT_GT(numbers, 20);
}

TEST(ResultsCsv, BaseROpensThemAsTheyStand) {
    if (std::system("Rscript --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "r-base-core is not installed";
    const test::TemporaryFolder folder;
    const auto files = csv_files(mixed_records());
    for (const auto& [name, content] : files) std::ofstream(folder.path() / name) << content;
    std::ofstream(folder.path() / "read.R") << R"(
runs <- read.csv("results.csv")
what <- read.csv("figures.csv")
stopifnot(nrow(runs) == 5, !any(duplicated(names(runs))), all(names(runs) %in% what$name))
stopifnot(identical(names(runs), names(read.csv("results.csv", check.names = FALSE))))
stopifnot(is.numeric(runs$residual_penetration_max_m), is.character(runs$outcome), runs$message[5] == "said \"no\", twice\nand left")
cat(sprintf("%.17g", runs$residual_penetration_max_m[1]))
)";
    ASSERT_EQ(std::system(("cd " + folder.path().string() + " && Rscript read.R >out 2>err").c_str()), 0)
        << test::read_file(folder.path() / "err");
    EXPECT_EQ(std::stod(test::read_file(folder.path() / "out")),
              mixed_records()[0].summary.at(Metric::residual_penetration_max_m));
}

TEST(ResultsCsv, PandasOpensThemAsTheyStand) {
    if (std::system("/usr/bin/python3 -c 'import pandas' >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "python3-pandas is not installed";
    const test::TemporaryFolder folder;
    for (const auto& [name, content] : csv_files(mixed_records())) std::ofstream(folder.path() / name) << content;
    std::ofstream(folder.path() / "read.py") << R"(
import pandas
runs = pandas.read_csv("results.csv")
what = pandas.read_csv("figures.csv")
assert len(runs) == 5 and runs.columns.is_unique and set(runs.columns) <= set(what["name"])
assert runs["residual_penetration_max_m"].dtype == float and runs["message"][4] == 'said "no", twice\nand left'
)";
    EXPECT_EQ(std::system(("cd " + folder.path().string() + " && /usr/bin/python3 read.py >out 2>err").c_str()), 0)
        << test::read_file(folder.path() / "err");
}

TEST(ResultsCsv, FilesPerModeOfAnEarlierReportAreRemoved) {
    const test::TemporaryFolder folder;
    test::store_records(folder.path(), mixed_records());
    folder.write("results_replay.csv", "mode\nreplay\n");
    folder.write("my_results.csv", "mine\n");
    write_report(folder.path());
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "results_replay.csv"));
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "my_results.csv"));
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "results.csv"));
}

}  // namespace
}  // namespace trocar
