#include "measure/metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <stdexcept>

#include "measure/statistics.hpp"

namespace trocar {
namespace {

StepRow row_of(std::int64_t tick) {
    StepRow row;
    row.tick = tick;
    row.stage_ns = {1, 2, 100 + tick, 4, -1, -1};
    return row;
}

TEST(Summary, EveryFigureIsExplainedOnce) {
    std::set<std::string> names;
    for (const SummaryFigure& figure : summary_figures()) {
        EXPECT_TRUE(names.insert(figure.name).second) << figure.name;
        EXPECT_FALSE(figure.unit.empty()) << figure.name;
        EXPECT_FALSE(figure.meaning.empty()) << figure.name;
    }
    for (const auto& [name, value] : summarize({row_of(0)})) EXPECT_NO_THROW((void)summary_figure(name)) << name;
    EXPECT_THROW((void)summary_figure("nonsense"), std::logic_error);
}

TEST(Summary, PairFiguresFollowTheirDefinitions) {
    std::vector<StepRow> rows(2);
    rows[0].pairs = 9;  // 8 true ones and 1 that is not; 2 missed of which 1 touches
    rows[0].true_pairs = 10;
    rows[0].true_touch = 4;
    rows[0].missing = 2;
    rows[0].missing_touch = 1;
    rows[0].extra = 1;
    rows[1].pairs = 1000;  // not judged
    const auto figures = summarize(rows);
    EXPECT_DOUBLE_EQ(figures.at("precision"), 8.0 / 9.0);
    EXPECT_DOUBLE_EQ(figures.at("recall"), 0.8);
    EXPECT_DOUBLE_EQ(figures.at("recall_without_touches"), 5.0 / 6.0);
    EXPECT_DOUBLE_EQ(figures.at("f1"), 16.0 / 19.0);
    EXPECT_EQ(figures.at("judged_ticks"), 1.0);
}

TEST(Summary, NothingJudgedIsNotZero) {
    const auto figures = summarize({row_of(0), row_of(1)});
    for (const char* name : {"precision", "recall", "missing", "extra", "residual_max_m", "depth_error_max_m",
                             "force_error_rms_n", "force_jump_max_n", "max_strain", "wrong_side_last"}) {
        EXPECT_TRUE(std::isnan(figures.at(name))) << name;
    }
}

TEST(Summary, TimesLeaveOutTheWarmUpAndFailedTicks) {
    std::vector<StepRow> rows;
    for (int i = 0; i < warm_up_ticks; ++i) rows.push_back(row_of(1000000));
    rows[3].pairs = 1;
    for (int i = 0; i < 101; ++i) rows.push_back(row_of(i));
    rows.push_back(row_of(5000000));
    rows.back().outcome = OutcomeKind::unstable;
    const auto figures = summarize(rows);
    EXPECT_EQ(figures.at("detect_median_ns"), 150.0);
    EXPECT_EQ(figures.at("total_median_ns"), 157.0);
    EXPECT_EQ(figures.at("total_max_ns"), 207.0);
    EXPECT_EQ(figures.at("total_cold_ns"), 1000107.0);
    EXPECT_TRUE(std::isnan(figures.at("total_p99_ns")));
    EXPECT_TRUE(std::isnan(figures.at("respond_median_ns")));
    EXPECT_TRUE(std::isnan(figures.at("allocations_median")));
    EXPECT_EQ(figures.at("failed_ticks"), 1.0);
}

TEST(Summary, ForceJumpIsTheLargestStepBetweenNeighbours) {
    std::vector<StepRow> rows(4);
    rows[0].tool_force = Vector3(0, 0, 0);
    rows[1].tool_force = Vector3(3, 4, 0);
    rows[2].tool_force = Vector3(3, 4, 1);
    const auto figures = summarize(rows);
    EXPECT_DOUBLE_EQ(figures.at("force_jump_max_n"), 5.0);
    EXPECT_DOUBLE_EQ(figures.at("force_rms_n"), std::sqrt((25.0 + 26.0) / 3.0));
}

TEST(Summary, ResidualCountsTicksWithAPairOrADepth) {
    std::vector<StepRow> rows(4);
    for (StepRow& row : rows) row.max_depth = 0.0;
    EXPECT_EQ(summarize(rows).at("residual_median_m"), 0.0);
    rows[2].max_depth = 2e-3;
    rows[2].pairs = 1;
    const auto figures = summarize(rows);
    EXPECT_EQ(figures.at("residual_median_m"), 2e-3);
    EXPECT_EQ(figures.at("residual_last_m"), 0.0);
}

}  // namespace
}  // namespace trocar
