// The script of a report's page, in a browser: what a reader clicks does what it says.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "report/report.hpp"
#include "report/report_files.hpp"
#include "support/browser.hpp"
#include "support/program.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

std::string title_after(const std::vector<Record>& records, const std::string& probe) {
    const test::TemporaryFolder folder;
    const Report report = make_report(records);
    write_report_files(folder.path(), report.files);
    return test::title_of(report.files.at("report.html"), probe, folder.path());
}

/// Eleven rows of 1.1 to 0.1 mm and rising times, so that no two columns sort alike.
std::vector<Record> eleven() {
    std::vector<Record> records;
    for (int k = 1; k <= 11; ++k) {
        records.push_back(test::synthetic({.response = "r" + std::to_string(k),
                                           .first_tick_us = 10 * k,
                                           .residual_mm = 1.2 - 0.1 * k,
                                           .state_hash = "s" + std::to_string(k)}));
    }
    return records;
}

TEST(PageScript, SortsFiltersAndShowsCommands) {
    if (test::no_browser()) GTEST_SKIP() << "no chromium";
    const std::string title = title_after(eleven(), R"(
        var out = [], table = document.querySelectorAll("main table")[0];
        var first = function () { return table.tBodies[0].rows[0].cells[0].textContent; };
        out.push(first());
        table.tHead.rows[0].cells[6].click(); out.push(first());
        table.tHead.rows[0].cells[6].click(); out.push(first());
        table.querySelector("td.again button").click();
        out.push(table.tBodies[0].rows[1].textContent);
        table.querySelector("td.again button").click();
        out.push(table.querySelectorAll("tr.command").length);
        var filter = document.querySelector("input.filter"), all = filter.nextElementSibling.querySelector("table");
        filter.value = "r7"; filter.dispatchEvent(new Event("input"));
        out.push(Array.from(all.tBodies[0].rows).filter(function (row) { return !row.hidden; }).length);
        document.title = out.join("; ");)");
    EXPECT_EQ(title,
              "r11 (intersection); r2 (intersection); r11 (intersection); trocar run poke.json --detector mine "
              "--response r11 --contacts intersection --ticks 1110; 0; 1");
}

TEST(PageScript, EveryChartHasADescriptionThatTheScriptBesideThePageDraws) {
    if (test::no_browser()) GTEST_SKIP() << "no chromium";
    EXPECT_EQ(title_after(eleven(), R"(
        var figures = Array.from(document.querySelectorAll("figure[data-chart]"));
        document.title = figures.length > 0 && figures.every(function (figure) {
            var option = window.trocarCharts.chartOption(JSON.parse(figure.dataset.chart));
            return option.series.length > 0 && option.series[0].data.length > 0;
        });)"),
              "true");
    // Words and marks of the drawn chart, and the still one put away.
    EXPECT_EQ(title_after(eleven(), R"(
        var figure = document.querySelector("figure[data-chart]");
        window.trocarDraw(figure);
        var drawn = figure.querySelector("div.chart svg"), still = figure.querySelector(":scope > svg");
        document.title = drawn.querySelectorAll("text").length > 5 && drawn.querySelectorAll("path").length > 5 &&
            still.style.display === "none";)"),
              "true");
}

TEST(PageScript, ChartsAreDrawnInAReportThatWasMovedAndByTheSharedScript) {
    if (test::no_browser()) GTEST_SKIP() << "no chromium";
    const std::string probe = R"(
        var figure = document.querySelector("figure[data-chart]");
        window.trocarDraw(figure);
        document.title = figure.querySelectorAll("div.chart svg path").length > 5;)";
    for (const bool shared : {false, true}) {
        const test::TemporaryFolder folder;
        if (shared) write_shared_assets(folder.path());
        test::store_records(folder.path() / "report", eleven());
        write_report(folder.path() / "report");
        EXPECT_EQ(std::filesystem::exists(folder.path() / "report" / own_assets), !shared);
        const test::TemporaryFolder elsewhere;
        std::filesystem::rename(folder.path() / "report", (shared ? folder : elsewhere).path() / "moved");
        const std::filesystem::path page = (shared ? folder : elsewhere).path() / "moved" / "report.html";
        EXPECT_EQ(test::title_of(test::read_file(page), probe, page.parent_path()), "true") << shared;
    }
}

TEST(PageScript, EveryRowHasACommandAndHeadersOfFiguresAreExplained) {
    if (test::no_browser()) GTEST_SKIP() << "no chromium";
    EXPECT_EQ(title_after(eleven(), R"(
        document.title = document.querySelectorAll("td.again button").length ===
            document.querySelectorAll("tbody tr").length &&
            document.querySelector("th:nth-child(3) abbr").title.indexOf("residual_penetration_max_m in m") > 0;)"),
              "true");
}

TEST(PageScript, NoTableOfAPublishedReportIsWiderThanThePage) {
    if (test::no_browser()) GTEST_SKIP() << "no chromium";
    int pages = 0;
    for (const auto& entry : std::filesystem::directory_iterator(TROCAR_SOURCE_DIR "/reports")) {
        const std::filesystem::path page = entry.path() / "report.html";
        if (!std::filesystem::exists(page)) continue;
        ++pages;
        const test::TemporaryFolder folder;
        EXPECT_EQ(test::title_of(test::read_file(page), R"(
            document.querySelectorAll("details").forEach(function (part) { part.open = true; });
            document.title = Array.from(document.querySelectorAll("main table")).filter(function (table) {
                return table.parentNode.scrollWidth > table.parentNode.clientWidth;
            }).map(function (table) { return table.tHead.textContent; }).join("; ");)",
                                 folder.path()),
                  "")
            << page;
    }
    EXPECT_GT(pages, 5);
}

}  // namespace
}  // namespace trocar
