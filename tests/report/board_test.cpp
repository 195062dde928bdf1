// The page of many machines and versions: status words, filters and commands.
#include "report/board.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "geometry/input_error.hpp"
#include "report/report_files.hpp"
#include "support/browser.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

/// Scenes a and b by two responses, on one machine at one version.
std::vector<Record> study_of(const std::string& machine, const std::string& commit, double residual_mm) {
    std::vector<Record> records;
    for (const char* scene : {"a", "b"}) {
        for (const char* response : {"push", "hold"}) {
            records.push_back(test::synthetic({.scene = scene, .response = response, .residual_mm = residual_mm}));
        }
    }
    for (Record& record : records) {
        record.environment["cpu"] = machine;
        record.environment["cores"] = "2";
        record.environment["commit"] = commit;
        record.environment["dirty"] = "no";
        record.environment["study.file"] = "bench/studies/made_up.json";
    }
    return records;
}

std::size_t count_of(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

/// Two versions on `one`; on `two` a run failed, one is absent and one has no record.
std::vector<std::vector<Record>> sources() {
    std::vector<Record> two = study_of("two", "bbbbbbbbbbbbbbbb", 0.7);
    two[0].outcome = {OutcomeKind::unstable, "tick 7"};
    two[1].outcome = {OutcomeKind::absent, "no library"};
    two.pop_back();
    return {study_of("one", "aaaaaaaaaaaaaaaa", 0.5), study_of("one", "bbbbbbbbbbbbbbbb", 0.6), two};
}

TEST(Board, CountsEveryCellOnceUnderItsStatus) {
    const std::string page = make_board(sources()).at("index.html");
    const std::string first = page.substr(0, page.find("Methods over their scenes"));
    // machine, version, study, note, ok, failed, missing, excluded: four cells of a method on a scene each
    std::vector<std::vector<std::string>> rows;
    for (std::size_t at = first.find("<tr", first.find("<tbody>")); at != std::string::npos;
         at = first.find("<tr", at + 1)) {
        rows.emplace_back();
        const std::size_t end = first.find("</tr>", at);
        for (std::size_t cell = first.find("<td", at); cell < end; cell = first.find("<td", cell + 1)) {
            const std::size_t from = first.find('>', cell) + 1;
            rows.back().push_back(first.substr(from, first.find("</td>", from) - from));
        }
    }
    ASSERT_EQ(rows.size(), 3U);
    const auto counts = [&rows](std::size_t row) {
        return std::vector<std::string>(rows[row].begin() + 3, rows[row].end());
    };
    EXPECT_EQ(rows[0][0], "one, 2 cores");
    EXPECT_EQ(counts(0), (std::vector<std::string>{"stale", "4", "0", "0", "0"}));
    EXPECT_EQ(counts(1), (std::vector<std::string>{"", "4", "0", "0", "0"}));
    EXPECT_EQ(counts(2), (std::vector<std::string>{"", "1", "1", "1", "1"}));
}

TEST(Board, EveryRowHasACommandAndHistoryIsOfMachinesWithSeveralVersions) {
    const std::map<std::string, std::string> files = make_board(sources());
    const std::string& page = files.at("index.html");
    EXPECT_EQ(count_of(page, "<tr"), count_of(page, "data-command=\"") + count_of(page, "<thead>"));
    EXPECT_NE(page.find("trocar run bench/studies/a.json"), std::string::npos);
    const auto drawings =
        std::count_if(files.begin(), files.end(), [](const auto& file) { return file.first.starts_with("charts/"); });
    EXPECT_EQ(drawings, 3);
    EXPECT_NE(page.find("on one, 2 cores: worst penetration (mm) over the versions"), std::string::npos);
    EXPECT_EQ(page.find("on two, 2 cores: worst"), std::string::npos);
}

TEST(Board, RefusesARunThatStandsTwice) {
    auto twice = sources();
    twice.push_back(twice.front());
    try {
        make_board(twice);
        FAIL() << "accepted";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("two of one, 2 cores, version aaaaaaaaaaaa"), std::string::npos)
            << error.what();
    }
}

TEST(Board, SelectsShowTheRowsOfAMachineAndAVersion) {
    if (test::no_browser()) GTEST_SKIP() << "no chromium";
    const test::TemporaryFolder folder;
    const std::map<std::string, std::string> files = make_board(sources());
    write_report_files(folder.path(), files);
    const std::string title = test::title_of(files.at("index.html"), R"(
        var out = [], selects = document.querySelectorAll(".page-filters select");
        var shown = function () {
            return Array.from(document.querySelectorAll("main table")).map(function (table) {
                return Array.from(table.tBodies[0].rows).filter(function (row) {
                    return getComputedStyle(row).display !== "none"; }).length; }).join(","); };
        out.push(shown());
        selects[0].value = "two, 2 cores"; selects[0].dispatchEvent(new Event("change")); out.push(shown());
        selects[0].value = "one, 2 cores"; selects[0].dispatchEvent(new Event("change")); out.push(shown());
        selects[1].value = "aaaaaaaaaaaa"; selects[1].dispatchEvent(new Event("change")); out.push(shown());
        document.title = out.join("; ");)",
                                             folder.path());
    // Tables: studies (3 places), methods (2 of each place), cells (4 of each last version; folded, still displayed).
    EXPECT_EQ(title, "3,6,8; 1,2,4; 2,4,4; 1,2,0");
}

}  // namespace
}  // namespace trocar
