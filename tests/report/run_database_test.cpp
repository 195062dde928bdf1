#include "report/run_database.hpp"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>

#include "report/run_table.hpp"
#include "report/synthetic.hpp"
#include "support/csv_text.hpp"
#include "support/program.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using test::synthetic;

struct Cell {
    int type;
    std::string text;     ///< of a TEXT
    double number = 0.0;  ///< of a REAL
};

struct Answer {
    std::vector<std::string> names;
    std::vector<std::string> types;  ///< as declared
    std::vector<std::vector<Cell>> rows;
};

Answer ask(const std::filesystem::path& file, const std::string& sql) {
    Answer answer;
    sqlite3* database = nullptr;
    EXPECT_EQ(sqlite3_open_v2(file.c_str(), &database, SQLITE_OPEN_READONLY, nullptr), SQLITE_OK);
    sqlite3_stmt* statement = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(database, sql.c_str(), -1, &statement, nullptr), SQLITE_OK)
        << sql << ": " << sqlite3_errmsg(database);
    for (int column = 0; column < sqlite3_column_count(statement); ++column) {
        const char* type = sqlite3_column_decltype(statement, column);
        answer.names.emplace_back(sqlite3_column_name(statement, column));
        answer.types.emplace_back(type == nullptr ? "" : type);
    }
    while (sqlite3_step(statement) == SQLITE_ROW) {
        std::vector<Cell> row;
        for (int column = 0; column < sqlite3_column_count(statement); ++column) {
            Cell cell{.type = sqlite3_column_type(statement, column), .text = {}};
            if (cell.type == SQLITE_TEXT) {
                const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement, column));
                cell.text.assign(text, static_cast<std::size_t>(sqlite3_column_bytes(statement, column)));
            } else {
                cell.number = sqlite3_column_double(statement, column);
            }
            row.push_back(std::move(cell));
        }
        answer.rows.push_back(std::move(row));
    }
    EXPECT_EQ(sqlite3_finalize(statement), SQLITE_OK);
    EXPECT_EQ(sqlite3_close(database), SQLITE_OK);
    return answer;
}

std::vector<std::vector<std::string>> words_of(const Answer& answer) {
    std::vector<std::vector<std::string>> rows;
    for (const std::vector<Cell>& cells : answer.rows) {
        rows.emplace_back();
        for (const Cell& cell : cells) rows.back().push_back(cell.text);
    }
    return rows;
}

/// Two modes, parameters, a failed run, and numbers that few digits do not hold.
std::vector<Record> runs() {
    std::vector<Record> records{
        synthetic({}), synthetic({.mode = "replay", .detector = "theirs:bv=AABB"}),
        synthetic({.response = "push:k=007", .outcome = {OutcomeKind::threw, "said \"no\", it's\nµm"}})};
    records[0].summary[Metric::force_max_n] = 0.1 + 0.2;
    records[0].summary[Metric::force_rms_n] = 5e-324;
    records[1].summary[Metric::force_max_n] = std::nextafter(1e308, 0.0);
    records[1].summary[Metric::force_rms_n] = std::nan("");
    records[0].spec.seed = 0xFFFFFFFFFFFFFFFFULL;
    records[1].environment["cpu"] = "another";
    return records;
}

TEST(RunDatabase, CellsAreThoseOfResultsCsv) {
    const test::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "runs.db";
    write_run_database(runs(), file);
    const auto files = results_files(runs());
    const auto csv = test::csv_rows(files.at("results.csv"));
    std::map<std::string, std::string> unit;
    for (const auto& row : test::csv_rows(files.at("figures.csv"))) unit[row[0]] = row[1];
    const Answer answer = ask(file, "SELECT * FROM results ORDER BY rowid");
    EXPECT_EQ(answer.names, csv[0]);
    ASSERT_EQ(answer.rows.size(), 3U);
    for (std::size_t column = 0; column < csv[0].size(); ++column) {
        const bool is_text = unit.at(csv[0][column]) == "text";
        EXPECT_EQ(answer.types[column], is_text ? "TEXT" : "REAL") << csv[0][column];
        for (std::size_t row = 0; row < answer.rows.size(); ++row) {
            const Cell& cell = answer.rows[row][column];
            const std::string& field = csv[row + 1][column];
            if (field.empty()) {
                EXPECT_EQ(cell.type, SQLITE_NULL) << csv[0][column];
            } else if (is_text) {
                EXPECT_EQ(cell.type, SQLITE_TEXT) << csv[0][column];
                EXPECT_EQ(cell.text, field) << csv[0][column];
            } else {
                EXPECT_EQ(cell.type, SQLITE_FLOAT) << csv[0][column];
                EXPECT_EQ(cell.number, std::strtod(field.c_str(), nullptr)) << csv[0][column];
            }
        }
    }
    const Answer numbers = ask(file, "SELECT force_max_n, force_rms_n, \"response.k\" FROM results ORDER BY rowid");
    EXPECT_EQ(numbers.rows[0][0].number, 0.1 + 0.2);
    EXPECT_EQ(numbers.rows[0][1].number, 5e-324);
    EXPECT_EQ(numbers.rows[1][0].number, std::nextafter(1e308, 0.0));
    EXPECT_EQ(numbers.rows[1][1].type, SQLITE_NULL);
    EXPECT_EQ(numbers.rows[2][2].text, "007") << "a parameter stays a word";
}

TEST(RunDatabase, FactsAreTheEnvironmentsAndMetricsAreFiguresCsv) {
    const test::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "runs.db";
    write_run_database(runs(), file);
    std::vector<std::vector<std::string>> facts;
    for (const Record& record : runs()) {
        for (const auto& [key, value] : record.environment) facts.push_back({run_id(record.spec), key, value});
    }
    const Answer stored = ask(file, "SELECT run_id, \"key\", value FROM facts ORDER BY rowid");
    EXPECT_EQ(words_of(stored), facts);
    EXPECT_EQ(words_of(ask(file, "SELECT mode FROM results JOIN facts USING (run_id) WHERE value = 'another'")),
              (std::vector<std::vector<std::string>>{{"replay"}}));
    Answer metrics = ask(file, "SELECT * FROM metrics ORDER BY rowid");
    auto rows = words_of(metrics);
    rows.insert(rows.begin(), metrics.names);
    EXPECT_EQ(rows, test::csv_rows(results_files(runs()).at("figures.csv")));
}

TEST(RunDatabase, TheExampleOfTheFormatsPrintsTheMedianPerMethod) {
    const std::string formats = test::read_file(std::string(TROCAR_SOURCE_DIR) + "/docs/FORMATS.md");
    const std::size_t begin = formats.find("```sql\n") + 7;
    const std::string example = formats.substr(begin, formats.find("```", begin) - begin);
    std::vector<Record> records;
    // Of one method an odd number of runs, of the other an even one, of both a failed run, which has no depth.
    for (const double depth : {3.0, 1.0, 50.0}) records.push_back(synthetic({.residual_mm = depth}));
    for (const double depth : {8.0, 2.0, 4.0, 5.0})
        records.push_back(synthetic({.response = "b", .residual_mm = depth}));
    for (const char* response : {"push", "b"})
        records.push_back(synthetic({.response = response, .outcome = {OutcomeKind::threw, "no"}}));
    records.push_back(synthetic({.mode = "replay"}));
    for (std::size_t i = 0; i < records.size(); ++i) records[i].spec.repetition = static_cast<std::int64_t>(i);
    const test::TemporaryFolder folder;
    write_run_database(records, folder.path() / "runs.db");
    const Answer answer = ask(folder.path() / "runs.db", example);
    ASSERT_EQ(answer.rows.size(), 2U);
    EXPECT_EQ(answer.rows[0][0].text, "mine + b (intersection)");
    EXPECT_DOUBLE_EQ(answer.rows[0][1].number, 4.5);
    EXPECT_EQ(answer.rows[1][0].text, "mine + push (intersection)");
    EXPECT_DOUBLE_EQ(answer.rows[1][1].number, 3.0);
}

TEST(RunDatabase, AnExistingFileIsReplacedByACompleteOneAlone) {
    const test::TemporaryFolder folder;
    const std::filesystem::path file = folder.write("runs.db", "yesterday's");
    std::vector<Record> twice{synthetic({}), synthetic({})};
    test::expect_holds(test::complaint_about(file, [&] { write_run_database(twice, file); }), {"results.run_id"});
    EXPECT_EQ(test::files_below(folder.path()), (std::map<std::string, std::string>{{"runs.db", "yesterday's"}}));
    for (const std::size_t count : {3U, 1U}) {
        std::vector<Record> records = runs();
        records.resize(count);
        write_run_database(records, file);
        EXPECT_EQ(ask(file, "SELECT run_id FROM results").rows.size(), count);
        EXPECT_EQ(ask(file, "PRAGMA integrity_check").rows[0][0].text, "ok");
        EXPECT_EQ(test::files_below(folder.path()).size(), 1U) << "nothing is left beside it";
    }
}

TEST(RunDatabase, PlacesThatCannotBeWrittenAreInputErrors) {
    const test::TemporaryFolder folder;
    const std::filesystem::path file = folder.write("file", "");
    const auto complaint = [](const std::filesystem::path& place) {
        return test::complaint_about(place, [&] { write_run_database(runs(), place); });
    };
    EXPECT_EQ(complaint(folder.path()), "expected a file that can be written, got a folder");
    EXPECT_EQ(complaint(folder.path() / "nowhere" / "runs.db"),
              "expected a file that can be written, got No such file or directory");
    EXPECT_EQ(complaint(file / "runs.db"), "expected a file that can be written, got Not a directory");
    EXPECT_EQ(complaint("/dev/null"), "expected a file that can be written, got a device, pipe or socket");
    EXPECT_EQ(test::files_below(folder.path()).size(), 1U);
}

TEST(RunDatabase, ColumnsThatDifferInCaseAloneAreRefused) {
    const test::TemporaryFolder folder;
    const std::vector<Record> records{synthetic({.response = "push:k=1"}), synthetic({.response = "push:K=1"})};
    test::expect_holds(test::complaint_of([&] { write_run_database(records, folder.path() / "a.db"); }),
                       {"response.k"});
}

}  // namespace
}  // namespace trocar
