#include "report/table_choice.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "report/synthetic.hpp"
#include "support/csv_text.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using test::synthetic;

/// Two scenes, two responses, two processes, and a replay.
std::vector<Record> records() {
    std::vector<Record> list;
    for (const char* scene : {"poke", "drag"}) {
        for (const char* response : {"unilateral", "push:k=200"}) {
            for (const std::int64_t process : {0, 1}) {
                list.push_back(
                    synthetic({.scene = scene, .response = response, .repetition = process, .residual_mm = 0.25}));
            }
        }
        list.push_back(synthetic({.mode = "replay", .scene = scene}));
    }
    return list;
}

std::string words_of(const ChosenTable& table) {
    std::string text;
    for (const auto& row : table.rows) {
        for (const ChosenCell& cell : row) text += cell.word + " ";
        text += "/ ";
    }
    return text;
}

/// The one line that the choice is refused with.
std::string refusal(const TableChoice& choice) {
    return test::complaint_of([&choice] { choose_table(records(), choice); });
}

TEST(TableChoice, RowsFitAllNamesAndAnyValueOfAName) {
    const std::vector<std::string> columns{"scene", "response", "response.k"};
    EXPECT_EQ(words_of(choose_table(records(), {columns, {"scene=poke", "response=push"}})), "poke push 200 / ");
    EXPECT_EQ(words_of(choose_table(records(), {columns, {"scene=poke", "response=push", "response=unilateral"}})),
              "poke push 200 / poke unilateral  / ");
    EXPECT_EQ(words_of(choose_table(records(), {columns, {"response=push:k=200"}})),
              "drag push 200 / poke push 200 / ");
    EXPECT_EQ(words_of(choose_table(records(), {{"scene", "mode"}, {"mode=replay"}})), "drag replay / poke replay / ");
    EXPECT_EQ(choose_table(records(), {{"scene"}, {"repetition=1"}}).rows.size(), 4U);
    EXPECT_EQ(words_of(choose_table(records(), {columns, {"response!=unilateral"}})),
              "drag push 200 / poke push 200 / ");
    EXPECT_EQ(words_of(choose_table(records(), {columns, {"response.k!="}})), "drag push 200 / poke push 200 / ");
}

TEST(TableChoice, RowsStandInTheOrderAskedForElseByTheColumnsShown) {
    std::vector<Record> list = records();
    for (Record& record : list) {
        const bool poke = record.spec.scene == "poke";
        const bool ours = record.spec.response == "unilateral";
        record.summary[Metric::residual_penetration_max_m] =
            poke && ours ? std::nan("") : (poke ? 1.0 : 2.0) + (ours ? 0.5 : 0.0);
    }
    const std::vector<std::string> columns{"scene", "response"};
    const std::vector<std::string> where{"mode=closed_loop"};
    EXPECT_EQ(words_of(choose_table(list, {columns, where})),
              "drag push / drag unilateral / poke push / poke unilateral / ");
    EXPECT_EQ(words_of(choose_table(list, {columns, where, {"response", "scene:desc"}})),
              "poke push / drag push / poke unilateral / drag unilateral / ");
    EXPECT_EQ(words_of(choose_table(list, {columns, where, {"residual_penetration_max_m"}})),
              "poke push / drag push / drag unilateral / poke unilateral / ");
    EXPECT_EQ(words_of(choose_table(list, {columns, where, {"residual_penetration_max_m:desc"}})),
              "drag unilateral / drag push / poke push / poke unilateral / ");
    EXPECT_NE(refusal({{}, {}, {"scene:down"}}).find("NAME:desc"), std::string::npos);
    EXPECT_NE(refusal({{}, {}, {"scenes"}}).find("scene"), std::string::npos);
}

TEST(TableChoice, RowsThatReadAlikeAreDistinguished) {
    const TableChoice unseen{{"scene", "residual_penetration_max_m"}, {"mode=closed_loop"}};
    const std::vector<std::string> notes = choose_table(records(), unseen).notes;
    ASSERT_EQ(notes.size(), 2U);
    EXPECT_NE(notes[1].find("differ in response, response.k"), std::string::npos) << notes[1];
    const TableChoice seen{{"scene", "response", "residual_penetration_max_m"}, {"mode=closed_loop"}};
    const std::vector<std::string> left_out = choose_table(records(), seen).notes;
    ASSERT_EQ(left_out.size(), 1U) << "the processes that are left out, and nothing else";
    EXPECT_NE(left_out[0].find(" 4 more left out "), std::string::npos) << "of eight runs every second";
}

TEST(TableChoice, WhatIsLeftOutWithoutBeingAskedForIsReported) {
    EXPECT_EQ(choose_table(records(), {{"scene", "response"}, {}}).notes.size(), 2U);
    const ChosenTable all = choose_table(records(), {{"scene", "response", "repetition"}, {"mode=closed_loop"}});
    EXPECT_TRUE(all.notes.empty());
    EXPECT_EQ(all.rows.size(), 8U);
}

TEST(TableChoice, NumbersAreThoseOfTheRecordsInTheUnitThatIsNamed) {
    const ChosenTable table =
        choose_table(records(), {{"residual_penetration_max_m", "residual_penetration_max_m:mm",
                                  "residual_penetration_max_m:um", "total_median_ns:ms", "ticks_planned"},
                                 {}});
    const Record record = records()[0];
    EXPECT_EQ(table.rows[0][0].number, record.summary.at(Metric::residual_penetration_max_m));
    EXPECT_EQ(table.rows[0][1].number, 0.25);
    EXPECT_NEAR(table.rows[0][2].number, 250.0, 1e-9);
    EXPECT_NEAR(table.rows[0][3].number, 1e-6 * record.summary.at(Metric::total_median_ns), 1e-15);
    EXPECT_EQ(table.rows[0][4].number, 1110.0);
    EXPECT_EQ(table.columns[1].header, "residual penetration max (mm)");
    EXPECT_EQ(table.columns[1].name, "residual_penetration_max_mm");
}

TEST(TableChoice, EveryFormatHasTheSameRows) {
    const ChosenTable table =
        choose_table(records(), {{"scene", "response", "residual_penetration_max_m:mm"}, {"scene=poke"}});
    EXPECT_EQ(table_as_markdown(table),
              "| scene | response | residual penetration max (mm) |\n|---|---|---:|\n| poke | push | 0.250 |\n| "
              "poke | unilateral | 0.250 |\n");
    EXPECT_NE(table_as_latex(table).find("poke & unilateral & 0.250 \\\\"), std::string::npos) << table_as_latex(table);
    EXPECT_EQ(test::csv_rows(table_as_csv(table)),
              (std::vector<std::vector<std::string>>{{"scene", "response", "residual_penetration_max_mm"},
                                                     {"poke", "push", "0.25"},
                                                     {"poke", "unilateral", "0.25"}}));
}

TEST(TableChoice, WithoutColumnsItReportsWhoWhereAndHowMuch) {
    const ChosenTable table = choose_table(records(), {});
    std::vector<std::string> names;
    for (const ChosenColumn& column : table.columns) names.push_back(column.name);
    ASSERT_GE(names.size(), 5U);
    EXPECT_LE(names.size(), 8U);
    EXPECT_EQ(names[0], "scene");
    EXPECT_EQ(names[2], "response");
    EXPECT_NE(std::find(names.begin(), names.end(), "residual_penetration_max_mm"), names.end());
}

TEST(TableChoice, BadNamesGetOneLineThatListsNearOnes) {
    EXPECT_NE(refusal({{"residual_penetration_mx_m"}, {}}).find("residual_penetration_max_m"), std::string::npos);
    EXPECT_NE(refusal({{"scenes"}, {}}).find("scene"), std::string::npos);
    EXPECT_NE(refusal({{}, {"respons=unilateral"}}).find("response"), std::string::npos);
    EXPECT_NE(refusal({{}, {"scene=poker"}}).find("poke"), std::string::npos);
    EXPECT_NE(refusal({{}, {"scene"}}).find("NAME=VALUE"), std::string::npos);
    EXPECT_NE(refusal({{"residual_penetration_max_m:ms"}, {}}).find("(m)"), std::string::npos);
    EXPECT_NE(refusal({{"scene:mm"}, {}}).find("scene"), std::string::npos);
    EXPECT_NE(refusal({{}, {"mode=replay", "response=unilateral"}}).find("all of these"), std::string::npos);
    EXPECT_EQ(refusal({{"residual_penetration_mx_m"}, {}}).find('\n'), std::string::npos);
}

}  // namespace
}  // namespace trocar
