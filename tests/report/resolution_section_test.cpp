// Interpenetration resolution as reported: what is counted, how a failed run counts, the order of the rows.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "report/report.hpp"
#include "report/sections.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

/// `ticks` < 0: not resolved, because of `cause`.
Record resolution(const std::string& response, const std::string& scene, double ticks, bool cleared,
                  const std::string& cause = "resolved") {
    Record record = test::synthetic({.mode = "resolution", .scene = scene, .response = response});
    record.summary[Metric::resolution_resolved] = ticks < 0 ? 0.0 : 1.0;
    record.summary[Metric::resolution_cleared] = cleared ? 1.0 : 0.0;
    record.summary[Metric::resolution_ticks] = ticks < 0 ? std::nan("") : ticks;
    record.summary[Metric::resolution_kick] = 2.0;
    record.summary[Metric::resolution_excess_energy] = 0.5;
    record.environment["resolution.cause"] = cause;
    return record;
}

std::vector<std::string> row_of(const Table& table, const std::string& response) {
    for (const TableRow& row : table.rows) {
        if (row.cells.front().find(response) != std::string::npos) return row.cells;
    }
    return {};
}

std::vector<Record> resolutions() {
    std::vector<Record> list{resolution("push", "rest_a", 10, true),
                             resolution("push", "moving_a", 30, false),
                             resolution("push", "silent_a", -1, false, "wrong side held"),
                             resolution("pull", "rest_a", 4, false),
                             resolution("pull", "moving_a", -1, false, "too slow"),
                             resolution("pull", "silent_a", -1, false, "too slow"),
                             resolution("jump", "rest_a", 5, true),
                             resolution("jump", "moving_a", 6, true),
                             resolution("jump", "silent_a", 7, true)};
    list.back().outcome = {OutcomeKind::unstable, "tick 3: it jumps"};
    return list;
}

TEST(ResolutionSection, CountsEveryGroupAndAFailedRunAsUnresolved) {
    const std::vector<Record> all = resolutions();
    const Draft draft(all);
    const Table table = resolution_table(draft);
    ASSERT_EQ(table.columns.size(), 6U);
    EXPECT_EQ(table.columns[1].header, "at rest, moving");
    EXPECT_EQ(table.columns[2].header, "silent detector");
    const std::vector<std::string> push = row_of(table, "push");
    EXPECT_EQ(push[1], "2 / 1 of 2");
    EXPECT_EQ(push[2], "0 / 0 of 1");
    EXPECT_EQ(push[3], "30.0 [∞]");
    EXPECT_EQ(push[4], "2.00 [2.00]");
    const std::vector<std::string> jump = row_of(table, "jump");
    EXPECT_EQ(jump[1], "2 / 2 of 2");
    EXPECT_EQ(jump[2], "0 / 0 of 1");
    EXPECT_EQ(jump[3], "6.00 [∞]");
    EXPECT_EQ(jump[4], "2.00 [∞]") << "a failed run is worse than all others";
}

TEST(ResolutionSection, LeavesOutWhatIsResolvedWithoutAResponse) {
    std::vector<Record> all = resolutions();
    all.push_back(resolution("none", "moving_a", 12, false));
    all.push_back(resolution("none", "rest_a", -1, false, "nothing reported"));
    const Draft draft(all);
    const Table table = resolution_table(draft);
    EXPECT_EQ(row_of(table, "push")[1], "1 / 1 of 1");
    EXPECT_EQ(row_of(table, "none")[1], "0 / 0 of 1");
    EXPECT_NE(table.note.find("moving_a"), std::string::npos);
    EXPECT_EQ(table.note.find("rest_a"), std::string::npos);
}

TEST(ResolutionSection, OrdersByResolvedThenByTicks) {
    const std::vector<Record> all = resolutions();
    const Draft draft(all);
    const Table table = resolution_table(draft);
    ASSERT_EQ(table.rows.size(), 3U);
    EXPECT_NE(table.rows[0].cells.front().find("jump"), std::string::npos);
    EXPECT_NE(table.rows[1].cells.front().find("push"), std::string::npos);
    EXPECT_NE(table.rows[2].cells.front().find("pull"), std::string::npos);
}

TEST(ResolutionSection, PageOneHasTheBestRowOfEveryResponseAndSaysWhoResolvesHowMany) {
    std::vector<Record> all = resolutions();
    for (const char* scene : {"rest_a", "moving_a", "silent_a"}) {
        all.push_back(resolution("push:k=2", scene, 3, false));
        all.push_back(resolution("thesis", scene, -1, false, "too slow"));
    }
    for (Record& record : all) record.environment["study.ours"] = "jump";
    const Draft draft(all);
    const Table table = resolution_page(draft);
    ASSERT_EQ(table.rows.size(), 4U);
    EXPECT_NE(table.rows[0].cells.front().find("push:k=2"), std::string::npos);
    EXPECT_EQ(resolution_sentence(draft), "Of 3 interpenetrations `push:k=2` resolves 3, `jump` 2, `thesis` 0.");
}

TEST(ResolutionSection, SaysWhyAndIsOnPageOne) {
    const Report report = make_report(resolutions());
    const std::string& html = report.files.at("report.html");
    EXPECT_NE(html.find("too slow 2"), std::string::npos);
    EXPECT_NE(html.find("wrong side held 1"), std::string::npos);
    EXPECT_NE(html.find("unstable 1"), std::string::npos);
    EXPECT_NE(html.find("2 of 3<span class=\"range\">[20.8 to 93.9 %]"), std::string::npos)
        << "Wilson's interval by hand: 0.2077, 0.9385";
    EXPECT_NE(html.find("0 / 1, p 1.00"), std::string::npos) << "pull beside the first row";
    EXPECT_NE(report.files.at("report.md").find("2 / 1 of 2"), std::string::npos);
}

}  // namespace
}  // namespace trocar
