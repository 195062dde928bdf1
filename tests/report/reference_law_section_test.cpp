// The two verdicts against stored references: rows by law, shares of the peak, ties by the bound, failed runs.
#include <gtest/gtest.h>

#include <string>
#include <variant>
#include <vector>

#include "report/sections.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

/// The records outlive the tables.
std::vector<Table> law_tables(const std::vector<Record>& records) {
    Draft draft(records);
    add_reference_laws(draft);
    std::vector<Table> tables;
    for (const Block& block : draft.document.blocks) {
        if (const auto* table = std::get_if<Table>(&block)) tables.push_back(*table);
    }
    return tables;
}

constexpr double no_error = -1.0;

/// Bounds 0.1 N and 1 mm; the reference's largest force is 2 N.
Record run_of(const std::string& response, const std::string& scene, double hard_error,
              double scene_law_error = no_error, const Outcome& outcome = {}) {
    Record record = test::synthetic(
        {.scene = scene, .response = response, .residual_mm = 1.0, .state_hash = response + scene, .outcome = outcome});
    record.summary[Metric::k_scene_n_per_m] = 500.0;
    record.summary[Metric::k_effective_n_per_m] = 1e6;
    if (hard_error >= 0.0) {
        record.summary[Metric::force_error_rms_hard] = hard_error;
        record.summary[Metric::force_bound_hard] = 0.1;
        record.summary[Metric::reference_force_max_hard] = 2.0;
        record.summary[Metric::position_error_worst_hard] = 0.01 * hard_error;
        record.summary[Metric::position_bound_hard] = 0.001;
    }
    if (scene_law_error >= 0.0) {
        record.summary[Metric::k_effective_n_per_m] = 500.0;
        record.summary[Metric::force_error_rms_equal_k] = scene_law_error;
        record.summary[Metric::force_bound_equal_k] = 0.1;
        record.summary[Metric::reference_force_max_equal_k] = 1.0;
    }
    return record;
}

std::vector<std::string> cells_of(const Table& table, const std::string& response) {
    for (const TableRow& row : table.rows) {
        if (row.cells.front().find("`" + response + "`") != std::string::npos) {
            // Without the name and the time.
            return {row.cells.begin() + 1, row.cells.end() - 1};
        }
    }
    return {};
}

TEST(ReferenceLawSection, ErrorsAreWithinTheBoundOrSharesOfThePeak) {
    const std::vector<Table> tables =
        law_tables({run_of("good", "a", 0.05), run_of("good", "b", 0.4), run_of("good", "c", 0.2),
                    run_of("poor", "a", 0.3), run_of("poor", "b", 0.45), run_of("poor", "c", 0.9)});
    ASSERT_EQ(tables.size(), 1U) << "nobody has the scene's law";
    EXPECT_NE(tables[0].caption.find("Hard contact"), std::string::npos);
    // Of 0.4 and 0.2 N over 2 N; places are wrong by 0.5, 4 and 2 mm.
    EXPECT_EQ(cells_of(tables[0], "good"),
              (std::vector<std::string>{"1 of 3; 15.0 %", "10.0", "0 / 3 / 0", "1 of 3; 3.00 mm"}));
    // 0.3 − 0.05 and 0.9 − 0.2 are more than 2 × 0.1 N, 0.45 − 0.4 is not.
    EXPECT_EQ(cells_of(tables[0], "poor"),
              (std::vector<std::string>{"0 of 3; 22.5 %", "22.5", "0 / 1 / 2", "0 of 3; 4.50 mm"}));
    EXPECT_NE(tables[0].rows.front().cells.front().find("good"), std::string::npos);
}

TEST(ReferenceLawSection, AFailedRunIsInfinitelyWrongAndLast) {
    // Alone it would be first.
    const std::vector<Table> tables =
        law_tables({run_of("good", "a", 0.5), run_of("good", "b", 0.5), run_of("fails", "a", 0.0),
                    run_of("fails", "b", no_error, no_error, {OutcomeKind::crashed, "signal 11"})});
    ASSERT_EQ(tables.size(), 1U);
    EXPECT_EQ(cells_of(tables[0], "fails"),
              (std::vector<std::string>{"1 of 2; ∞ %", "∞", "1 / 0 / 1", "1 of 2; ∞ mm"}));
    EXPECT_NE(tables[0].rows.back().cells.front().find("fails"), std::string::npos);
}

TEST(ReferenceLawSection, RowsOfTheScenesLawAreThoseWithItsStiffness) {
    const std::vector<Table> tables = law_tables({run_of("soft", "a", 0.9, 0.3), run_of("soft", "b", 0.9, 0.05),
                                                  run_of("stiff", "a", 0.05), run_of("stiff", "b", 0.05)});
    ASSERT_EQ(tables.size(), 2U);
    EXPECT_EQ(tables[0].rows.size(), 2U);
    ASSERT_EQ(tables[1].rows.size(), 1U);
    EXPECT_NE(tables[1].caption.find("Law of the scene"), std::string::npos);
    EXPECT_EQ(cells_of(tables[1], "soft"), (std::vector<std::string>{"1 of 2; 30.0 %", "17.5", "0 / 2 / 0", "n/a"}));
}

TEST(ReferenceLawSection, AnErrorWithoutABoundIsNotJudged) {
    std::vector<Record> records{run_of("good", "a", 0.05), run_of("good", "b", 0.4)};
    for (Record& record : records) record.summary[Metric::position_bound_hard] = not_known;
    const std::vector<Table> tables = law_tables(records);
    ASSERT_EQ(tables.size(), 1U);
    EXPECT_EQ(cells_of(tables[0], "good").back(), "n/a");
    EXPECT_EQ(cells_of(tables[0], "good").front(), "1 of 2; 20.0 %");
}

TEST(ReferenceLawSection, ScenesWithoutAReferenceAreLeftOut) {
    const std::vector<Table> tables = law_tables({run_of("good", "a", 0.05), run_of("good", "b", no_error)});
    ASSERT_EQ(tables.size(), 1U);
    EXPECT_EQ(cells_of(tables[0], "good").front(), "1 of 1");
    EXPECT_TRUE(law_tables({run_of("good", "b", no_error)}).empty());
}

}  // namespace
}  // namespace trocar
