#include "measure/metrics.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
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

TEST(Metrics, AreExplainedOnceEach) {
    std::set<std::string> names;
    std::set<std::string_view> meanings;
    EXPECT_EQ(metrics().size(), metric_count);
    for (const MetricInfo& info : metrics()) {
        EXPECT_TRUE(names.emplace(info.name).second) << info.name;
        EXPECT_TRUE(meanings.insert(info.meaning).second) << info.name << " has the meaning of another metric";
        EXPECT_FALSE(info.unit.empty()) << info.name;
        EXPECT_FALSE(text_of(info.source).empty()) << info.name;
        EXPECT_EQ(header_of(info) == info.name, info.unit == "1") << info.name;
        EXPECT_EQ(&info_of(info.metric), &info);
        EXPECT_EQ(metric_of(info.name), info.metric);
    }
    EXPECT_FALSE(metric_named("nonsense"));
    EXPECT_THROW((void)metric_of("nonsense"), std::logic_error);
}

TEST(Summary, ForcesAndTheirStepsAreTheLargestOfAllTicks) {
    std::vector<StepRow> rows{row_of(0), row_of(1), row_of(2), row_of(3)};
    // The largest force and the largest step are neither first nor last.
    rows[0].tool_force = Vector3(0.0, 0.0, 1.0);
    rows[1].tool_force = Vector3(0.0, 3.0, 4.0);
    rows[2].tool_force = Vector3(0.0, -3.0, 0.0);
    rows[3].tool_force = Vector3(0.0, -2.0, 0.0);
    const auto figures = summarize(rows);
    EXPECT_DOUBLE_EQ(figures.at(Metric::force_max_n), 5.0);
    EXPECT_DOUBLE_EQ(figures.at(Metric::force_jump_max_n), std::sqrt(52.0));
    EXPECT_DOUBLE_EQ(figures.at(Metric::force_rms_n), std::sqrt(39.0 / 4.0));
    EXPECT_EQ(figures.at(Metric::force_flips), 1.0);
}

TEST(Summary, PairFiguresFollowTheirDefinitions) {
    std::vector<StepRow> rows(2);
    rows[0].pairs = 9;  // 8 true ones and 1 that is not; 2 missed of which 1 touches
    rows[0].true_pairs = 10;
    rows[0].true_touch = 4;
    rows[0].false_negatives = 2;
    rows[0].false_negatives_touch = 1;
    rows[0].false_positives = 1;
    rows[1].pairs = 1000;  // not judged
    const auto figures = summarize(rows);
    EXPECT_DOUBLE_EQ(figures.at(Metric::precision), 8.0 / 9.0);
    EXPECT_DOUBLE_EQ(figures.at(Metric::recall), 0.8);
    EXPECT_DOUBLE_EQ(figures.at(Metric::recall_without_touches), 5.0 / 6.0);
    EXPECT_DOUBLE_EQ(figures.at(Metric::f1), 16.0 / 19.0);
    EXPECT_EQ(figures.at(Metric::judged_ticks), 1.0);
}

TEST(Summary, RecallOfTheDeepestIsOverAllTicksThatWereJudged) {
    std::vector<StepRow> rows{row_of(0), row_of(1), row_of(2)};
    for (StepRow* row : {&rows[0], &rows[1]}) row->true_pairs = 30;
    rows[0].deepest_pairs = 10;
    rows[0].deepest_false_negatives = 1;
    rows[1].deepest_pairs = 6;
    rows[1].deepest_false_negatives = 3;
    EXPECT_DOUBLE_EQ(summarize(rows).at(Metric::recall_deepest), 12.0 / 16.0);
    rows[1].deepest_pairs = -1;
    EXPECT_TRUE(std::isnan(summarize(rows).at(Metric::recall_deepest))) << "a tick without a count";
}

TEST(Summary, TicksThatWereCutOrFailedAreCounted) {
    std::vector<StepRow> rows{row_of(0), row_of(1), row_of(2)};
    rows[1].truncated = rows[2].truncated = true;
    rows[2].outcome = OutcomeKind::unstable;
    const auto figures = summarize(rows);
    EXPECT_EQ(figures.at(Metric::truncated_ticks), 2.0);
    EXPECT_EQ(figures.at(Metric::failed_ticks), 1.0);
}

TEST(Summary, NothingJudgedIsNotZero) {
    const auto figures = summarize({row_of(0), row_of(1)});
    for (const char* name : {"precision", "recall", "false_negatives", "false_positives", "residual_penetration_max_m",
                             "depth_error_max_m", "ticks_to_clear_max", "uncleared", "overshoot_max_m", "force_flips",
                             "force_above_30hz_share", "force_jump_max_n", "max_strain", "wrong_side_last",
                             "side_undecided_max", "side_undecided_ticks"}) {
        EXPECT_TRUE(std::isnan(figures.at(metric_of(name)))) << name;
    }
}

TEST(Summary, UndecidedSidesAreCountedOverJudgedTicks) {
    std::vector<StepRow> rows(4);
    rows[0].side_undecided = 0;
    rows[2].side_undecided = 7;
    rows[3].side_undecided = 2;
    EXPECT_EQ(summarize(rows).at(Metric::side_undecided_max), 7.0);
    EXPECT_EQ(summarize(rows).at(Metric::side_undecided_ticks), 2.0);
}

TEST(Summary, TimesLeaveOutTheWarmUpAndFailedTicks) {
    std::vector<StepRow> rows;
    for (int i = 0; i < warm_up_ticks; ++i) rows.push_back(row_of(1000000));
    rows[3].pairs = 1;
    for (int i = 0; i < 101; ++i) rows.push_back(row_of(i));
    rows.push_back(row_of(5000000));
    rows.back().outcome = OutcomeKind::unstable;
    const auto figures = summarize(rows);
    EXPECT_EQ(figures.at(Metric::detect_median_ns), 150.0);
    EXPECT_EQ(figures.at(Metric::total_median_ns), 157.0);
    EXPECT_EQ(figures.at(Metric::total_max_ns), 207.0);
    EXPECT_EQ(figures.at(Metric::total_cold_ns), 1000107.0);
    EXPECT_TRUE(std::isnan(figures.at(Metric::total_p99_ns)));
    EXPECT_TRUE(std::isnan(figures.at(Metric::respond_median_ns)));
    EXPECT_TRUE(std::isnan(figures.at(Metric::allocations_median)));
    EXPECT_EQ(figures.at(Metric::failed_ticks), 1.0);
}

TEST(Summary, ForceJumpIsTheLargestStepBetweenNeighbours) {
    std::vector<StepRow> rows(4);
    rows[0].tool_force = Vector3(0, 0, 0);
    rows[1].tool_force = Vector3(3, 4, 0);
    rows[2].tool_force = Vector3(3, 4, 1);
    const auto figures = summarize(rows);
    EXPECT_DOUBLE_EQ(figures.at(Metric::force_jump_max_n), 5.0);
    EXPECT_DOUBLE_EQ(figures.at(Metric::force_rms_n), std::sqrt((25.0 + 26.0) / 3.0));
}

TEST(Summary, TheFirstTickJumpsFromZeroInTheLargestJumpAlone) {
    std::vector<StepRow> rows(1200);
    for (StepRow& row : rows) {
        row.tool_force = Vector3(0, 3, 4);
        row.tip_force = Vector3(0, 0, 2);
        row.device_force = Vector3(1, 0, 0);
    }
    rows[600].tool_force = Vector3(0, 3, 5);
    const auto figures = summarize(rows);
    EXPECT_DOUBLE_EQ(figures.at(Metric::force_jump_max_n), 5.0);
    EXPECT_DOUBLE_EQ(figures.at(Metric::tip_force_jump_max_n), 2.0);
    EXPECT_DOUBLE_EQ(figures.at(Metric::device_force_jump_max_n), 1.0);
    EXPECT_DOUBLE_EQ(figures.at(Metric::force_jump_p99_n), 0.0);
    rows[0].tool_force = Vector3::Zero();
    EXPECT_DOUBLE_EQ(summarize(rows).at(Metric::force_jump_max_n), 5.0) << "from the first tick to the second";
}

TEST(Summary, ResidualCountsTicksWithAPairOrADepth) {
    std::vector<StepRow> rows(4);
    for (StepRow& row : rows) row.residual_penetration = 0.0;
    EXPECT_EQ(summarize(rows).at(Metric::residual_penetration_median_m), 0.0);
    rows[2].residual_penetration = 2e-3;
    rows[2].pairs = 1;
    const auto figures = summarize(rows);
    EXPECT_EQ(figures.at(Metric::residual_penetration_median_m), 2e-3);
    EXPECT_EQ(figures.at(Metric::residual_penetration_final_m), 0.0);
}

TEST(Summary, TimeOfAReplayedTickIsTheDetectorsAlone) {
    std::vector<StepRow> rows;
    for (int i = 0; i < 20; ++i) rows.push_back(row_of(0));
    EXPECT_EQ(summarize(rows).at(Metric::total_median_ns), 107.0) << "move + update + detect + derive";
    EXPECT_EQ(summarize(rows, {.mode = "replay"}).at(Metric::total_median_ns), 102.0) << "update + detect";
}

TEST(Summary, MissesAndBurstsAreTicksAboveAMillisecond) {
    std::vector<StepRow> rows;
    for (int i = 0; i < 10 + 30; ++i) {
        rows.push_back(row_of(0));
        // After the warm-up: ticks 5, 6, 7 and 20 are late.
        const int timed = i - 10;
        if (timed == 5 || timed == 6 || timed == 7 || timed == 20) rows.back().stage_ns[2] = 1'000'000;
    }
    const auto figures = summarize(rows);
    EXPECT_EQ(figures.at(Metric::timed_ticks), 30.0);
    EXPECT_EQ(figures.at(Metric::deadline_misses), 4.0);
    EXPECT_EQ(figures.at(Metric::longest_burst), 3.0);
    // 26 of 30 take 107 ns; rank 0.9 * 29 = 26.1 lies among the late ones.
    EXPECT_EQ(figures.at(Metric::total_p90_ns), 1'000'007.0);
}

/// A depth in mm on every `stride`-th tick.
std::vector<StepRow> depths(const std::vector<double>& mm, std::int64_t stride = 1) {
    std::vector<StepRow> rows;
    for (std::size_t i = 0; i < mm.size(); ++i) {
        for (std::int64_t between = 0; between < stride; ++between) {
            StepRow row;
            row.tick = static_cast<std::int64_t>(rows.size());
            row.time = 0.001 * static_cast<double>(row.tick);
            if (between == 0) row.residual_penetration = 1e-3 * mm[i];
            rows.push_back(row);
        }
    }
    return rows;
}

TEST(Summary, TicksToClearCountFromTheFirstDepthToTheFirstClearTick) {
    // Two spells above 0.1 mm: ticks 1 to 3 (cleared at 4), 6 to 7 (cleared at 8).
    const auto figures = summarize(depths({0, 0.5, 2, 0.2, 0.1, 0.05, 0.3, 0.2, 0, 0}));
    EXPECT_EQ(figures.at(Metric::ticks_to_clear_max), 3.0);
    EXPECT_EQ(figures.at(Metric::ticks_to_clear_median), 2.5);
    EXPECT_EQ(figures.at(Metric::re_penetrations), 1.0);
    EXPECT_EQ(figures.at(Metric::uncleared), 0.0);
    // The same depths on every 8th tick last eight times as long.
    EXPECT_EQ(summarize(depths({0, 0.5, 2, 0.2, 0.1, 0.05, 0.3, 0.2, 0, 0}, 8)).at(Metric::ticks_to_clear_max), 24.0);
}

TEST(Summary, DepthThatStaysIsNotCleared) {
    const auto figures = summarize(depths({0, 0, 0.5, 0.5, 0.2}));
    EXPECT_EQ(figures.at(Metric::uncleared), 1.0);
    EXPECT_TRUE(std::isnan(figures.at(Metric::ticks_to_clear_max))) << "no spell ended";
    EXPECT_EQ(figures.at(Metric::re_penetrations), 0.0);
    EXPECT_EQ(summarize(depths({0, 0.09, 0.1, 0})).at(Metric::uncleared), 0.0) << "never above a tenth";
}

TEST(Summary, SettledResidualStartsTwoHundredMillisecondsAfterTheMotion) {
    std::vector<double> mm(400, 0.0);
    mm[250] = 3.0;  // too early to count: the motion ends at 100 ms
    mm[350] = 0.4;
    EXPECT_DOUBLE_EQ(summarize(depths(mm), {.motion_end = 0.1}).at(Metric::residual_penetration_settled_m), 0.4e-3);
    EXPECT_DOUBLE_EQ(summarize(depths(mm), {.motion_end = 0.04}).at(Metric::residual_penetration_settled_m), 3.0e-3);
    EXPECT_TRUE(std::isnan(summarize(depths(mm), {.motion_end = 0.3}).at(Metric::residual_penetration_settled_m)))
        << "run too short";
    EXPECT_TRUE(std::isnan(summarize(depths(mm)).at(Metric::residual_penetration_settled_m))) << "nothing moves";
}

TEST(Summary, FlipsAreTurnsByMoreThanARightAngle) {
    std::vector<StepRow> rows(5);
    rows[0].tool_force = Vector3(1, 0, 0);
    rows[1].tool_force = Vector3(1, 5, 0);
    rows[2].tool_force = Vector3(5, -2, 0);  // 5 - 10 < 0
    rows[3].tool_force = Vector3(0, -1, 0);
    rows[4].tool_force = Vector3(0, 1, 0);
    EXPECT_EQ(summarize(rows).at(Metric::force_flips), 2.0);
}

TEST(Summary, GeometryFiguresFollowTheirDefinitions) {
    std::vector<StepRow> rows(4);  // of the last one nothing is known but an overshoot
    const std::array<double, 3> depth_error{1.0, 4.0, 2.0};
    const std::array<double, 3> native_error{3.0, 7.0, 6.0};
    const std::array<double, 3> strain{0.25, 0.75, 0.5};
    const std::array<double, 3> strain_over{0.0, 0.125, 0.0625};
    const std::array<double, 3> volume{2.0, 1.0, 0.5};
    const std::array<double, 3> translation{0.5, 0.75, 0.25};
    const std::array<double, 3> residual_penetration_mean{0.0, 2.0, 4.0};
    const std::array<double, 3> residual_penetration{0.0, 8.0, 4.0};
    const std::array<std::int64_t, 3> vertices{3, 1, 2};
    const std::array<std::int64_t, 3> samples{5, 7, 6};
    for (std::size_t i = 0; i < 3; ++i) {
        rows[i].depth_error = depth_error.at(i);
        rows[i].native_depth_error = native_error.at(i);
        rows[i].max_strain = strain.at(i);
        rows[i].strain_over = strain_over.at(i);
        rows[i].overlap_volume = volume.at(i);
        rows[i].min_translation = translation.at(i);
        rows[i].residual_penetration_mean = residual_penetration_mean.at(i);
        rows[i].residual_penetration = residual_penetration.at(i);
        rows[i].wrong_side_vertices = vertices.at(i);
        rows[i].wrong_side = samples.at(i);
    }
    rows[3].overshoot = 0.125;
    const std::map<std::string, double> expected{{"depth_error_median_m", 2.0},
                                                 {"depth_error_max_m", 4.0},
                                                 {"native_depth_error_median_m", 6.0},
                                                 {"native_depth_error_max_m", 7.0},
                                                 {"max_strain", 0.75},
                                                 {"strain_over_max", 0.125},
                                                 {"overlap_volume_max_m3", 2.0},
                                                 {"min_translation_max_m", 0.75},
                                                 {"overshoot_max_m", 0.125},
                                                 {"residual_penetration_mean_m", 3.0},  // of the two ticks with a depth
                                                 {"residual_penetration_median_m", 6.0},  // of these as well
                                                 {"residual_penetration_max_m", 8.0},
                                                 {"residual_penetration_final_m", 4.0},
                                                 {"wrong_side_vertices_max", 3.0},
                                                 {"wrong_side_vertices_last", 2.0},
                                                 {"wrong_side_max", 7.0},
                                                 {"wrong_side_last", 6.0}};
    const auto figures = summarize(rows);
    for (const auto& [name, value] : expected) EXPECT_EQ(figures.at(metric_of(name)), value) << name;
}

TEST(Summary, CountsAreSummedAndLoadsAreAtTheirLargest) {
    std::vector<StepRow> rows(3);
    EXPECT_TRUE(std::isnan(summarize(rows).at(Metric::passed_through))) << "nobody was asked";
    const std::array<std::int64_t, 3> few{1, 0, 2};
    for (std::size_t i = 0; i < 3; ++i) {
        rows[i].ruptures = few.at(i);
        rows[i].contacts_offered = 15 * few.at(i);
        rows[i].contacts_used = 5 * few.at(i);
        rows[i].skipped = {few.at(i), 2 * few.at(i), 3 * few.at(i), 4 * few.at(i)};
        rows[i].no_hit = 100 * few.at(i);
        rows[i].limited_edges = 1000 * few.at(i);
        rows[i].detached = 10000 * few.at(i);
        rows[i].grasped = 7 * few.at(i);
        rows[i].saturated = few.at(i) > 0;
    }
    rows[1].passed_through = 0;
    rows[2].passed_through = 4;
    rows[0].roll_torque = 0.5;
    rows[1].roll_torque = -2.0;
    rows[0].tip_force = Vector3(3, 4, 0);
    rows[1].tip_force = Vector3(0, 0, 12);
    rows[1].device_force = Vector3(6, 8, 0);
    rows[2].device_force = Vector3(6, 8, 1);
    rows[1].tool_moment = Vector3(0, -3, 4);
    const std::map<std::string, double> expected{{"ruptures", 3.0},
                                                 {"contacts_offered", 45.0},
                                                 {"contacts_used", 15.0},
                                                 {"skipped_apart", 3.0},
                                                 {"skipped_no_direction", 6.0},
                                                 {"skipped_not_handled", 9.0},
                                                 {"skipped_reduced", 12.0},
                                                 {"no_hit", 300.0},
                                                 {"limited_edges", 3000.0},
                                                 {"detached", 30000.0},
                                                 {"grasped_max", 14.0},
                                                 {"saturated_ticks", 2.0},
                                                 {"passed_through", 4.0},
                                                 {"roll_torque_max_nm", 2.0},
                                                 {"tip_force_max_n", 12.0},
                                                 {"tip_force_jump_max_n", 13.0},
                                                 {"device_force_jump_max_n", 1.0},
                                                 {"tool_moment_max_nm", 5.0}};
    const auto figures = summarize(rows);
    for (const auto& [name, value] : expected) EXPECT_DOUBLE_EQ(figures.at(metric_of(name)), value) << name;
    EXPECT_DOUBLE_EQ(figures.at(Metric::device_force_max_n), std::sqrt(101.0));
}

TEST(FastPart, TwoTonesAreDistinguished) {
    // 10 Hz of amplitude 3 and 100 Hz of amplitude 1 over whole periods: mean squares 9/2 and 1/2.
    constexpr int n = 1001;
    std::vector<Vector3> force;
    for (int i = 0; i < n; ++i) {
        const double t = 2.0 * std::numbers::pi * i / (n - 1);
        force.emplace_back(3.0 * std::sin(10.0 * t), std::sin(100.0 * t), 2.0);
    }
    const FastPart part = part_above(force, 0.001, 30.0);
    EXPECT_NEAR(part.rms, std::sqrt(0.5), 0.01);
    EXPECT_NEAR(part.share, 0.1, 0.002);
    EXPECT_NEAR(part_above(force, 0.001, 200.0).share, 0.0, 1e-3);
    EXPECT_NEAR(part_above(force, 0.001, 5.0).share, 1.0, 1e-3);
}

TEST(FastPart, ARampIsSlow) {
    std::vector<Vector3> force;
    for (int i = 0; i < 100; ++i) force.emplace_back(0.1 * i, 0.0, -0.3 * i);
    EXPECT_NEAR(part_above(force, 0.001, 30.0).rms, 0.0, 1e-12);
    EXPECT_TRUE(std::isnan(part_above({Vector3::Zero()}, 0.001, 30.0).rms));
}

}  // namespace
}  // namespace trocar
