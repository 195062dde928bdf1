// Depth by kind of drawn scene: worst of a group's draws, median with its ranks, and a failed run as the worst of all.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <variant>

#include "report/sections.hpp"
#include "scene/judged_scenes.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

/// The records outlive the table.
Table kind_table(const std::vector<Record>& records) {
    Draft draft(records);
    add_kinds(draft);
    for (const Block& block : draft.document.blocks) {
        if (const auto* table = std::get_if<Table>(&block)) return *table;
    }
    return {};
}

/// Cell by response and header; empty without one.
std::string cell(const Table& table, const std::string& response, const std::string& header) {
    for (const TableRow& row : table.rows) {
        if (row.cells.front().find(response) == std::string::npos) continue;
        for (std::size_t c = 0; c < table.columns.size(); ++c) {
            if (table.columns[c].header == header) return row.cells[c];
        }
    }
    return {};
}

Record depth(const std::string& response, const std::string& scene, double residual_mm, const Outcome& outcome = {}) {
    return test::synthetic({.scene = scene,
                            .response = response,
                            .ticks = 20,
                            .residual_mm = residual_mm,
                            .state_hash = response + scene,
                            .outcome = outcome});
}

/// Depths of `push`: 1 to 6 mm.
std::vector<Record> six_scenes() {
    return {depth("push", "press_sheet_1", 1), depth("push", "point_sheet_1", 4), depth("push", "stab_sheet_1", 2),
            depth("push", "drag_sheet_1", 3),  depth("push", "over_bone_1", 6),   depth("push", "over_bone_2", 5)};
}

const char* const median_header = "median of all scenes [95 %]";
const char* const searched_header = "median, kinds like a scene of the search";
const char* const kept_header = "median, kinds kept from every search";

TEST(KindSection, GroupsHaveTheWorstOfTheirDraws) {
    const Table table = kind_table(six_scenes());
    ASSERT_EQ(table.rows.size(), 1U);
    EXPECT_EQ(cell(table, "push", "press on a sheet"), "4.00");
    EXPECT_EQ(cell(table, "push", "stab"), "2.00");
    EXPECT_EQ(cell(table, "push", "over a bone"), "6.00");
    EXPECT_EQ(cell(table, "push", "hand-held"), "") << "no scene of the study, no column";
    EXPECT_EQ(cell(table, "push", median_header), "3.50 [1.00 to 6.00]") << "of six values all ranks are needed";
    EXPECT_EQ(cell(table, "push", searched_header), "1.50") << "press_sheet and stab_sheet";
    EXPECT_EQ(cell(table, "push", kept_header), "5.50");
    EXPECT_EQ(cell(table, "push", "failed"), "0 of 6");
}

TEST(KindSection, AFailedRunIsDeeperThanAllOthersAndItsRowIsLast) {
    std::vector<Record> records = six_scenes();
    for (const char* scene : {"press_sheet_1", "point_sheet_1", "drag_sheet_1", "over_bone_1", "over_bone_2"}) {
        records.push_back(depth("jump", scene, 0.1));
    }
    records.push_back(depth("jump", "stab_sheet_1", 0.1, {OutcomeKind::unstable, "tick 3: it jumps"}));
    const Table table = kind_table(records);
    ASSERT_EQ(table.rows.size(), 2U);
    EXPECT_NE(table.rows.back().cells.front().find("jump"), std::string::npos);
    EXPECT_EQ(cell(table, "jump", "stab"), "∞");
    EXPECT_EQ(cell(table, "jump", "over a bone"), "0.100");
    EXPECT_EQ(cell(table, "jump", median_header), "0.100 [0.100 to ∞]");
    EXPECT_EQ(cell(table, "jump", searched_header), "∞") << "the mean of the middle two of 0.1 and ∞";
    EXPECT_EQ(cell(table, "jump", "failed"), "1 of 6");
}

TEST(KindSection, IsAbsentWithoutDrawnKinds) {
    EXPECT_TRUE(kind_table({depth("push", "i2t_poke", 1), depth("push", "press_20k", 1)}).rows.empty());
}

TEST(KindSection, HasAColumnForEveryKindOfTheDraw) {
    std::set<std::string> kinds;
    for (const DrawnScene& scene : draw_judged_scenes(1)) kinds.insert(scene.group);
    for (const std::string& kind : kinds) {
        const Table table = kind_table({depth("push", kind + "_1", 2), depth("push", "i2t_poke", 9)});
        ASSERT_EQ(table.rows.size(), 1U) << kind;
        ASSERT_GE(table.columns.size(), 4U);
        EXPECT_EQ(table.rows.front().cells[2], "2.00") << kind << ": its group";
    }
}

}  // namespace
}  // namespace trocar
