#include "report/report.hpp"
#include "report/page_one.hpp"
#include "report/verdict_order.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "geometry/input_error.hpp"
#include "method/registry.hpp"
#include "report/figures.hpp"
#include "report/regression.hpp"
#include "report/sections.hpp"
#include "report/verdict.hpp"
#include "support/commands.hpp"
#include "support/text.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

using test::synthetic;

/// mine: 100 µs and 0.5 mm left; theirs: 400 µs and 0.5 mm, same motion; theirs native: 200 µs and 2 mm.
/// Two processes each; the second is twice as slow for everybody.
std::vector<Record> three_methods() {
    std::vector<Record> records;
    for (const std::int64_t process : {0, 1}) {
        const std::int64_t factor = process + 1;
        records.push_back(synthetic({.repetition = process, .first_tick_us = 100 * factor}));
        records.push_back(
            synthetic({.detector = "theirs", .own = false, .repetition = process, .first_tick_us = 400 * factor}));
        records.push_back(synthetic({.detector = "theirs",
                                     .contacts = "native",
                                     .own = false,
                                     .repetition = process,
                                     .first_tick_us = 200 * factor,
                                     .residual_mm = 2.0,
                                     .false_negatives = 2,
                                     .false_positives = 1,
                                     .state_hash = "00000000000000bb"}));
    }
    return records;
}

Verdict verdict_of(const Results& results) {
    return make_verdict(results, "theirs", "closed_loop", results.scenes("closed_loop"));
}
Verdict verdict_of(Results&& results) = delete;  // the rows point into them

/// All that a report draws and says, but for the rows of single runs.
std::string all_but_results(const std::vector<Record>& records) {
    Report report = make_report(records);
    report.files.erase("results.csv");
    report.files.erase("figures.csv");
    std::string text = report.page_one;
    for (const auto& [name, content] : report.files) text += name + "\n" + content;
    return text;
}

TEST(Machines, TimesOfSeveralAreInNoTableAndStandBesideTheirRun) {
    const auto study = [](std::int64_t first_tick_us, const std::vector<std::string>& machines) {
        std::vector<Record> records;
        for (const char* mode : {"closed_loop", "replay"}) {
            for (const char* detector : {"mine", "theirs"}) {
                for (std::int64_t process = 0; process < 2; ++process) {
                    records.push_back(test::synthetic({.mode = mode,
                                                       .detector = detector,
                                                       .repetition = process,
                                                       .first_tick_us = first_tick_us * (process + 1)}));
                    records.back().environment["machine"] = machines[static_cast<std::size_t>(process)];
                }
            }
        }
        return records;
    };
    EXPECT_NE(all_but_results(study(100, {"a", "a"})), all_but_results(study(321, {"a", "a"})));
    const std::string report = all_but_results(study(100, {"a", "b"}));
    EXPECT_EQ(report, all_but_results(study(321, {"a", "b"})));
    EXPECT_NE(report.find("several machines"), std::string::npos);
    EXPECT_EQ(all_but_results(study(100, {"a", "a"})).find("several machines"), std::string::npos);
    const std::string runs = make_report(study(321, {"a", "b"})).files.at("results.csv");
    EXPECT_NE(runs.find("321000"), std::string::npos);
    EXPECT_NE(runs.find(",b,"), std::string::npos);
}

TEST(ReadRecords, ManyShortLinesThatAskForManyTicksAreRefusedWithTheFigure) {
    std::string line = to_json_line(Record());
    const std::string none = "\"rows\":{\"count\":0}";
    const std::size_t at = line.find(none);
    ASSERT_NE(at, std::string::npos) << line;
    line.replace(at, none.size(), "\"rows\":{\"count\":400000,\"pairs\":{\"all\":1}}");
    const test::TemporaryFolder folder;
    const std::string lines = line + "\n\n" + line + "\n" + line + "\n" + line + "\n";
    for (const std::filesystem::path& file :
         {folder.write("records.jsonl", lines), folder.write("records.jsonl.gz", gzipped(lines))}) {
        EXPECT_EQ(test::complaint_of([&] { (void)read_records(file); }),
                  file.string() +
                      ": line 4: expected at most 1000000 ticks of all records (--large lifts this), got 1200000");
    }
}

TEST(ReadRecords, TakesPlainAndCompressedOnesAndPrefersTheCompressedWhereBothAreThere) {
    const test::TemporaryFolder folder;
    const auto scene_of = [](const std::filesystem::path& input) { return read_records(input).at(0).spec.scene; };
    const auto line = [](const std::string& scene) {
        return to_json_line(synthetic({.scene = scene, .ticks = 3})) + "\n";
    };
    const std::filesystem::path plain = folder.write("records.jsonl", line("plain"));
    EXPECT_EQ(scene_of(folder.path()), "plain");
    const std::filesystem::path compressed = folder.write("records.jsonl.gz", gzipped(line("compressed")));
    EXPECT_EQ(scene_of(folder.path()), "compressed");
    EXPECT_EQ(scene_of(plain), "plain");
    EXPECT_EQ(scene_of(compressed), "compressed");
    // Even where it cannot be read: the older one would pass for it.
    const std::string half = gzipped(line("compressed")).substr(0, 50);
    folder.write("records.jsonl.gz", half);
    for (const std::string& command : {std::string("report "), std::string("table "), std::string("view "),
                                       "report --against " + plain.string() + " "}) {
        test::expect_refused(command + folder.path().string(),
                             compressed.string() + ": byte 50: expected a whole gzip file, got its end");
    }
}

TEST(RunFigures, QuantilesLeaveTheWarmUpOut) {
    // Tick i takes i µs: after 10 ticks of warm-up the times are 10, 11 ... 1109 µs.
    const Record record = synthetic({.first_tick_us = 0, .step_us = 1});
    const RunFigures figures = figures_of(record);
    EXPECT_EQ(figures[Metric::timed_ticks], 1100.0);
    EXPECT_DOUBLE_EQ(figures[Metric::total_median_ns], 559.5e3);
    EXPECT_NEAR(figures[Metric::total_p99_ns], (10.0 + 0.99 * 1099.0) * 1e3, 1e-6);
    EXPECT_EQ(figures[Metric::total_max_ns], 1109e3);
    EXPECT_EQ(figures[Metric::deadline_misses], 109.0) << "1001 to 1109 µs";
    EXPECT_EQ(figures[Metric::longest_burst], 109.0);
    EXPECT_EQ(figures[Metric::force_flips], 1109.0);
}

TEST(RunFigures, TooFewTicksHaveNoP99) {
    const Record record = synthetic({.ticks = 1009});
    EXPECT_TRUE(std::isnan(figures_of(record)[Metric::total_p99_ns]));
    EXPECT_FALSE(std::isnan(figures_of(synthetic({.ticks = 1010}))[Metric::total_p99_ns]));
}

TEST(RunFigures, ReplayCountsOnlyTheDetectorsStages) {
    Record record = synthetic({.mode = "replay", .first_tick_us = 70});
    for (StepRow& row : record.rows) row.stage_ns.at(static_cast<std::size_t>(Stage::contacts)) = 5'000'000;
    record.summary = summarize(record.rows, {.mode = record.spec.mode});
    EXPECT_EQ(figures_of(record)[Metric::total_median_ns], 70e3);
    record.summary = summarize(record.rows);
    EXPECT_EQ(figures_of(record)[Metric::total_median_ns], 5070e3);
}

TEST(RunFigures, EveryStageHasItsMedianAndItsTailAndTheStageSplitIsTheirMeanOverTheScenes) {
    std::vector<Record> records{synthetic({.scene = "drag", .ticks = 20}), synthetic({.scene = "poke", .ticks = 20})};
    for (std::size_t s = 0; s < stage_count; ++s) {
        const double ns = 1000.0 * static_cast<double>(s + 1);
        records[0].summary[stage_median(s)] = ns;
        records[1].summary[stage_median(s)] = 3.0 * ns;
        records[0].summary[stage_p99(s)] = 7.0 * ns;
    }
    const RunFigures figures = figures_of(records[0]);
    for (std::size_t s = 0; s < stage_count; ++s) {
        EXPECT_EQ(figures[stage_median(s)], 1000.0 * static_cast<double>(s + 1)) << stage_names.at(s);
        EXPECT_EQ(figures[stage_p99(s)], 7000.0 * static_cast<double>(s + 1)) << stage_names.at(s);
    }
    test::expect_holds(test::whole(make_report(records)),
                       {"| `mine + push (intersection)` | 2 | 2.00 | 4.00 | 6.00 | 8.00 | 10.0 | 12.0 | 42.0 |"});
    EXPECT_TRUE(std::isnan(figures_of(synthetic({.ticks = 20}))[stage_median(0)])) << "these rows have no such stage";
}

TEST(Processes, FewAreReportedByMinimumAndMaximum) {
    const Estimate estimate = across_processes({3.0, 1.0, 2.0});
    EXPECT_EQ(estimate.value, 2.0);
    EXPECT_EQ(estimate.low, 1.0);
    EXPECT_EQ(estimate.high, 3.0);
    EXPECT_EQ(estimate.processes, 3);
}

TEST(Processes, OneUnknownLeavesTheEstimateUnknown) {
    EXPECT_TRUE(std::isnan(across_processes({1.0, not_known}).value));
    EXPECT_TRUE(std::isnan(across_processes({}).value));
}

TEST(Processes, TenOrMoreGetAnIntervalInsideTheRange) {
    std::vector<double> values;
    for (int i = 1; i <= 20; ++i) values.push_back(i);
    const Estimate estimate = across_processes(values);
    EXPECT_EQ(estimate.value, 10.5);
    EXPECT_GT(estimate.low, 1.0);
    EXPECT_LT(estimate.low, 10.5);
    EXPECT_GT(estimate.high, 10.5);
    EXPECT_LT(estimate.high, 20.0);
}

TEST(Processes, IntervalsOfAReplayReportOfItsTicksToo) {
    // Twelve processes that differ in nothing: over processes alone the interval would be a point. Ticks go up from
    // 100 µs by 1 µs each, the second detector takes twice as long in every one.
    std::vector<Record> records;
    for (std::int64_t process = 0; process < 12; ++process) {
        records.push_back(synthetic({.mode = "replay", .detector = "theirs", .repetition = process, .step_us = 1}));
        records.push_back(synthetic(
            {.mode = "replay", .detector = "mine", .repetition = process, .first_tick_us = 200, .step_us = 2}));
    }
    const Results results(records);
    const Verdict verdict = make_verdict(results, "theirs", "replay", {"poke"});
    ASSERT_EQ(verdict.rows.size(), 2U);
    const VerdictRow& theirs = verdict.rows[0].reference ? verdict.rows[0] : verdict.rows[1];
    const VerdictRow& mine = verdict.rows[0].reference ? verdict.rows[1] : verdict.rows[0];
    // 1100 timed ticks from 110 µs on: median 659.5 µs. A quarter of the ticks is a block: four draws decide.
    EXPECT_DOUBLE_EQ(theirs.p50.value, 659.5e3);
    EXPECT_LT(theirs.p50.low, 500e3);
    EXPECT_GT(theirs.p50.high, 800e3);
    EXPECT_GE(theirs.p50.low, 110e3);
    EXPECT_LE(theirs.p50.high, 1209e3);
    EXPECT_NEAR(mine.p50.low, 2.0 * theirs.p50.low, 1e-6);
    // Paired by frame, the ratio is sharp all the same.
    EXPECT_EQ(estimate_text(mine.ratio, 1.0), "2.00 [2.00–2.00]");
    // A closed loop makes ticks of its own: processes alone.
    for (Record& record : records) record.spec.mode = "closed_loop";
    const Results loops(records);
    EXPECT_EQ(make_verdict(loops, "theirs", "closed_loop", {"poke"}).rows[0].p50.low,
              make_verdict(loops, "theirs", "closed_loop", {"poke"}).rows[0].p50.high);
}

TEST(Verdict, AControlIsReportedLastAndNeverRanked) {
    std::vector<Record> records = three_methods();
    const Results without_results(records);
    const Verdict without = verdict_of(without_results);
    // Better and faster than everybody, as nothing is that does nothing.
    records.push_back(synthetic({.detector = "blind", .first_tick_us = 1, .residual_mm = 0.0, .state_hash = "cc"}));
    records.back().environment["detector.control"] = "yes";
    const Results results(records);
    const Verdict verdict = verdict_of(results);
    ASSERT_EQ(verdict.rows.size(), 4U);
    EXPECT_EQ(verdict.rows[3].method.detector, "blind");
    EXPECT_TRUE(verdict.rows[3].control);
    EXPECT_FALSE(verdict.rows[3].dominated);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(verdict.rows[i].dominated, without.rows[i].dominated) << i;
}

TEST(Verdict, RowsThatMoveAlikeArePrintedAsOneThatNamesThemAll) {
    const std::vector<Record> records = three_methods();
    const Results results(records);
    const Table table = verdict_table(verdict_of(results), "", 1.0);
    ASSERT_EQ(table.rows.size(), 2U);
    EXPECT_EQ(table.rows[0].cells.at(1),
              "`mine` + `push` (intersection), moving alike: `theirs` (600 [400–800] / 600 [400–800] µs)");
    EXPECT_EQ(table.rows[1].cells.at(0).substr(0, 1), "2") << "numbers count the printed rows";
    EXPECT_EQ(table.rows[1].cells.at(1), "`theirs` + `push` (native)");
}

TEST(Verdict, RowsOfOneStateUnderOtherForcesAreTwo) {
    std::vector<Record> records{synthetic({.response = "push"}), synthetic({.response = "shove"})};
    const auto printed = [&records] {
        const Results results(records);
        return verdict_table(verdict_of(results), "", 1.0).rows.size();
    };
    EXPECT_EQ(printed(), 1U);
    records[1].summary[Metric::force_max_n] = 2.0;  // where scripts drive all bodies a state knows nothing of forces
    EXPECT_EQ(printed(), 2U);
}

TEST(Results, AnUnjudgedRunIsReportedWithWhatTruthSaysOfTheSameMotion) {
    std::vector<Record> records{synthetic({.residual_mm = 0.7}), synthetic({.detector = "fast", .residual_mm = 0.7}),
                                synthetic({.detector = "astray", .residual_mm = 0.7, .state_hash = "b"})};
    for (std::size_t i : {1U, 2U}) {
        records[i].spec.truth_stride = 0;
        for (const Metric judged : {Metric::residual_penetration_max_m, Metric::residual_penetration_median_m,
                                    Metric::false_negatives, Metric::true_pairs, Metric::false_positives}) {
            records[i].summary[judged] = not_known;
        }
    }
    const Results results(records);
    const auto left = [&results](const char* detector) {
        return results.find({"closed_loop", detector, "push", "intersection"}, "poke")
            ->first(Metric::residual_penetration_max_m);
    };
    EXPECT_DOUBLE_EQ(left("fast"), 0.7e-3);
    EXPECT_TRUE(std::isnan(left("astray"))) << "moved otherwise: nobody has judged that";
    const SceneResult* fast = results.find({"closed_loop", "fast", "push", "intersection"}, "poke");
    EXPECT_TRUE(std::isnan(fast->first(Metric::false_negatives))) << "pairs are its own";
}

/// mine is exact; theirs misses half of the pairs and is 2 mm deeper with 3 N more; twin moves as mine does.
std::vector<Record> detectors_of_one_response() {
    std::vector<Record> records{
        synthetic({.residual_mm = 0.5}),
        synthetic({.detector = "theirs", .own = false, .residual_mm = 2.5, .false_negatives = 2, .state_hash = "bb"}),
        synthetic({.detector = "twin", .own = false, .residual_mm = 0.5})};
    records[0].environment["detector.claims_exact"] = "yes";
    records[1].summary[Metric::force_max_n] = 4.0;
    records[1].summary[Metric::true_proximity_pairs] = 20.0;
    records[1].summary[Metric::proximity_false_negatives] = 7.0;
    return records;
}

TEST(Report, DetectionErrorsAreReportedAsDepthAndForceAgainstAnExactOne) {
    test::expect_holds(
        test::whole(make_report(detectors_of_one_response())),
        {"## Effect of detection errors",
         "| `theirs + push (intersection)` | `mine` | 2220 of 4440 | 7 of 20 | 0.500 → 2.50 | 2.00 (poke: "
         "0.500 → 2.50) | 3.00 (poke: 1.00 → 4.00) | 0 of 1 |",
         "Detection errors change nothing, bit by bit on every scene, in `twin + push (intersection)`."});
}

TEST(Report, WithoutAnExactRowNothingIsCompared) {
    std::vector<Record> records = detectors_of_one_response();
    records[0].environment["detector.claims_exact"] = "no";
    EXPECT_EQ(test::whole(make_report(records)).find("## Effect of detection errors"), std::string::npos);
}

TEST(Report, ARowThatFailsWithAnotherDetectorHasLostThatScene) {
    std::vector<Record> records = detectors_of_one_response();
    records[1] = synthetic({.detector = "theirs", .own = false, .outcome = {OutcomeKind::not_finite, "a vertex"}});
    EXPECT_NE(test::whole(make_report(records)).find("| 0 of 0, fails on 1 |"), std::string::npos);
}

TEST(Verdict, RowsAreSortedByErrorThenTime) {
    const std::vector<Record> records = three_methods();
    const Results results(records);
    const Verdict verdict = verdict_of(results);
    ASSERT_EQ(verdict.rows.size(), 3U);
    EXPECT_EQ(verdict.rows[0].method.label(), "mine + push (intersection)");
    EXPECT_EQ(verdict.rows[1].method.label(), "theirs + push (intersection)");
    EXPECT_EQ(verdict.rows[2].method.label(), "theirs + push (native)");
    EXPECT_FALSE(verdict.rows[0].dominated);
    EXPECT_TRUE(verdict.rows[1].dominated) << "as good and slower";
    EXPECT_TRUE(verdict.rows[2].dominated);
    EXPECT_EQ(verdict.rows[1].identical_to, 0);
    EXPECT_EQ(verdict.rows[2].identical_to, -1);
}

TEST(Verdict, NumbersAreThoseOfTheRecords) {
    const std::vector<Record> records = three_methods();
    const Results results(records);
    const Verdict verdict = verdict_of(results);
    // Processes at 100 and 200 µs: median 150.
    EXPECT_EQ(estimate_text(verdict.rows[0].p50, 1e-3), "150 [100–200]");
    EXPECT_EQ(estimate_text(verdict.rows[0].p99, 1e-3), "150 [100–200]");
    // 100/400 and 200/800: the ratio is paired by process, so the slow second process cancels.
    EXPECT_EQ(estimate_text(verdict.rows[0].ratio, 1.0), "0.250 [0.250–0.250]");
    EXPECT_EQ(estimate_text(verdict.rows[2].ratio, 1.0), "0.500 [0.500–0.500]");
    EXPECT_EQ(verdict.rows[2].planned.sum(Metric::true_pairs), 4.0 * 1110);
    EXPECT_EQ(verdict.rows[2].planned.sum(Metric::false_negatives), 2.0 * 1110);
    EXPECT_EQ(verdict.rows[2].planned.sum(Metric::false_positives), 1110.0);
    EXPECT_DOUBLE_EQ(verdict.rows[2].residual_max(), 2e-3);
    // Process against process of the same method is a factor 2 everywhere.
    EXPECT_DOUBLE_EQ(results.noise_floor(), 2.0);
}

TEST(Verdict, TearsAreCountedInAColumnOfTheirOwnAndExcuseNoDepth) {
    std::vector<Record> records{synthetic({.scene = "stab", .residual_mm = 0.5}),
                                synthetic({.scene = "drag", .residual_mm = 2.0})};
    for (Record& record : records) record.summary[Metric::reference_clears_hard] = 0.0;
    records[0].summary[Metric::ruptures] = 1;
    records[1].summary[Metric::ruptures] = 2;
    const Results results(records);
    const Verdict verdict = verdict_of(results);
    EXPECT_NEAR(verdict.rows.front().residual_max(), 2e-3, 1e-12);
    const Table table = verdict_table(verdict, "", 1.0);
    EXPECT_EQ(table.rows.front().cells.at(5), "1.25 / 2.00");
    EXPECT_EQ(table.columns.at(6).header, "tears");
    EXPECT_EQ(table.rows.front().cells.at(6), "3");
}

TEST(Verdict, ResponsesStandInOneOrderHereAndOnPageOne) {
    // By the worst depth of tissue scenes: the geometric mean over scenes, a rigid scene and pairs missed say
    // otherwise.
    std::vector<Record> records{
        synthetic({.scene = "poke", .response = "even", .residual_mm = 1.0, .false_negatives = 2, .state_hash = "a"}),
        synthetic({.scene = "stab", .response = "even", .residual_mm = 1.0, .state_hash = "b"}),
        synthetic({.scene = "poke", .response = "uneven", .residual_mm = 0.01, .state_hash = "c"}),
        synthetic({.scene = "stab", .response = "uneven", .residual_mm = 1.1, .state_hash = "d"}),
        synthetic({.scene = "cross", .pair_class = "I2I", .response = "even", .residual_mm = 9.0, .state_hash = "e"}),
        synthetic(
            {.scene = "cross", .pair_class = "I2I", .response = "uneven", .residual_mm = 0.1, .state_hash = "f"})};
    const Draft draft(records);
    const Verdict verdict = verdict_of(draft.results);
    const std::vector<ResponseRow> rows = response_rows(draft);
    ASSERT_EQ(verdict.rows.size(), 2U);
    ASSERT_EQ(rows.size(), 2U);
    EXPECT_EQ(verdict.rows.front().method.response, "even");
    EXPECT_EQ(rows.front().who.front().response, "even");
    EXPECT_NEAR(verdict.rows.front().residual_max(), 1e-3, 1e-12);
    EXPECT_NEAR(rows.front().residual_max(), 1e-3, 1e-12);
    // The rigid scene has a table of its own.
    EXPECT_EQ(response_rows(draft, false).front().who.front().response, "uneven");
    EXPECT_NE(test::whole(make_report(records)).find("## Responses without tissue"), std::string::npos);
}

TEST(Verdict, ARigidSceneDecidesNoTieOfTissueScenes) {
    // Alike in tissue but for time; in the rigid scene the slower one there is the faster one.
    std::vector<Record> records{
        synthetic({.scene = "poke", .response = "one", .first_tick_us = 100, .state_hash = "a"}),
        synthetic({.scene = "poke", .response = "two", .first_tick_us = 200, .state_hash = "b"}),
        synthetic({.scene = "cross", .pair_class = "I2I", .response = "one", .first_tick_us = 900, .state_hash = "c"}),
        synthetic({.scene = "cross", .pair_class = "I2I", .response = "two", .first_tick_us = 300, .state_hash = "d"})};
    const Draft draft(records);
    EXPECT_EQ(response_rows(draft).front().who.front().response, "one");
    EXPECT_EQ(verdict_of(draft.results).rows.front().method.response, "one");
}

TEST(Verdict, ResponsesAreOrderedByFailuresThenDepthsThenTime) {
    struct Standing {
        bool control = false;
        int failed = 0;
        bool not_run = false;
        double worst = 1e-3;   // m
        double median = 1e-4;  // m
        double p99 = 1e5;      // ns
    };
    const auto order = [](const Standing& standing) {
        const Record record;
        RunFigures run{.record = &record};
        run[Metric::residual_penetration_max_m] = standing.worst;
        run[Metric::residual_penetration_median_m] = standing.median;
        const SceneResult result{.runs = {run}, .p50_resamples = {}, .p99_resamples = {}};
        VerdictRow row;
        row.control = standing.control;
        row.failed_runs = standing.failed;
        row.judged.results = {&result};
        row.slowest_tick = standing.p99;
        return response_order(row, standing.not_run);
    };
    const auto behind = [&order](const Standing& other) { return order({}) < order(other); };
    EXPECT_TRUE(behind({.control = true}));
    EXPECT_TRUE(behind({.failed = 1, .worst = 0.0}));
    EXPECT_TRUE(behind({.not_run = true, .worst = 0.0}));
    EXPECT_TRUE(behind({.worst = 2e-3, .median = 0.0}));
    EXPECT_TRUE(behind({.median = 2e-4, .p99 = 0.0}));
    EXPECT_TRUE(behind({.p99 = 2e5}));
    EXPECT_TRUE(behind({.worst = not_known}));
}

/// Replays of one method by as many processes as an interval needs. `ns` gives the time of a tick by process and tick.
std::vector<Record> timed_replays(const std::string& detector, std::int64_t ticks, const auto& ns) {
    std::vector<Record> records;
    for (std::int64_t process = 0; process < processes_for_interval; ++process) {
        Record record =
            synthetic({.mode = "replay", .detector = detector, .repetition = process, .ticks = warm_up_ticks + ticks});
        for (StepRow& row : record.rows) {
            row.stage_ns.at(static_cast<std::size_t>(Stage::detect)) = ns(process, row.tick - warm_up_ticks);
        }
        records.push_back(std::move(record));
    }
    return records;
}

TEST(Results, BlocksOfResampledTicksFollowWhatAllProcessesShare) {
    constexpr std::int64_t ticks = 200;
    const auto is_late = [](std::int64_t tick) { return tick >= ticks / 2; };
    // Neighbouring ticks of all processes differ; one process alone was disturbed for half of its run.
    const auto restless = [&](std::int64_t process, std::int64_t tick) {
        return (tick % 2 == 0 ? 100'000 : 200'000) + (process == 3 && is_late(tick) ? 50'000'000 : 0) + 10 * process;
    };
    // The scene itself becomes expensive in its second half.
    const auto steady = [&](std::int64_t process, std::int64_t tick) {
        return (is_late(tick) ? 900'000 : 100'000) + 10 * process;
    };
    const auto times_of = [](const auto& ns) {
        std::vector<std::vector<double>> times;
        for (std::int64_t process = 0; process < processes_for_interval; ++process) {
            times.emplace_back();
            for (std::int64_t tick = 0; tick < ticks; ++tick) {
                times.back().push_back(static_cast<double>(ns(process, tick)));
            }
        }
        return times;
    };
    std::vector<Record> records = timed_replays("restless", ticks, restless);
    const std::vector<std::vector<double>> times = times_of(restless);
    const auto expect_block = [&](std::int64_t block) {
        const Results results(records);
        const auto expected = resampled_quantiles(times, {0.5, 0.99}, block, 1);
        for (const Method& method : results.methods("replay")) {
            if (method.detector != "restless") continue;
            EXPECT_EQ(results.find(method, "poke")->p50_resamples, expected[0]);
            EXPECT_EQ(results.find(method, "poke")->p99_resamples, expected[1]);
            return;
        }
        ADD_FAILURE() << "no such method";
    };
    expect_block(1);
    // Beside a method that needs long blocks all are drawn in those.
    for (Record& record : timed_replays("steady", ticks, steady)) records.push_back(std::move(record));
    const std::int64_t longest = block_length(ticks, lag_one_correlation(times_of(steady).front()));
    ASSERT_GT(longest, 10);
    expect_block(longest);
}

TEST(Verdict, AContactAsSoftAsItsSceneAsksIsNoError) {
    // The stiff one leaves less depth, but its operator is 2 mm from where k lets it be.
    std::vector<Record> records{
        synthetic({.scene = "cross", .pair_class = "I2I", .residual_mm = 0.8}),
        synthetic({.scene = "cross", .pair_class = "I2I", .response = "stiff", .residual_mm = 0.1, .state_hash = "b"})};
    records[0].summary[Metric::position_error_worst_equal_k] = 0.2e-3;
    records[1].summary[Metric::position_error_worst_equal_k] = 2.0e-3;
    const Results results(records);
    const Verdict verdict = verdict_of(results);
    const auto soft = std::find_if(verdict.rows.begin(), verdict.rows.end(),
                                   [](const VerdictRow& row) { return row.method.response == "push"; });
    ASSERT_NE(soft, verdict.rows.end());
    EXPECT_NEAR(soft->error, 0.2e-3, 1e-12);
    EXPECT_NEAR(soft->residual_max(), 0.8e-3, 1e-12) << "reported all the same";
}

TEST(Verdict, TimesOverScenesAreGeometricMeans) {
    // 100 and 400 µs: geometric mean 200. Reference 200 and 3200: ratios 1/2 and 1/8, mean 1/4.
    const std::vector<Record> records{synthetic({.scene = "a", .first_tick_us = 100}),
                                      synthetic({.scene = "b", .first_tick_us = 400}),
                                      synthetic({.scene = "a", .detector = "theirs", .first_tick_us = 200}),
                                      synthetic({.scene = "b", .detector = "theirs", .first_tick_us = 3200})};
    const Results results(records);
    const Verdict verdict = verdict_of(results);
    EXPECT_NEAR(verdict.rows[0].p50.value, 200e3, 1e-6);
    EXPECT_NEAR(verdict.rows[0].ratio.value, 0.25, 1e-12);
}

TEST(Verdict, ARatioIsOfTheProcessesThatBothHave) {
    // 100 / 400 and 200 / 800 µs; the third process of either has nothing beside it.
    for (const bool reference_has_more : {true, false}) {
        std::vector<Record> records;
        for (const std::int64_t process : {0, 1, 2}) {
            const std::int64_t factor = process + 1;
            if (process < 2 || !reference_has_more) {
                records.push_back(synthetic({.repetition = process, .first_tick_us = 100 * factor}));
            }
            if (process < 2 || reference_has_more) {
                records.push_back(synthetic(
                    {.detector = "theirs", .own = false, .repetition = process, .first_tick_us = 400 * factor}));
            }
        }
        const Results results(records);
        const Verdict verdict = verdict_of(results);
        ASSERT_EQ(verdict.rows.size(), 2U);
        const VerdictRow& mine = verdict.rows.front();
        EXPECT_EQ(mine.method.detector, "mine");
        EXPECT_EQ(estimate_text(mine.ratio, 1.0), "0.250 [0.250–0.250]");
        EXPECT_EQ(mine.ratio.processes, 2);
        EXPECT_EQ(estimate_text(mine.p50, 1e-3), reference_has_more ? "150 [100–200]" : "200 [100–300]");
    }
}

TEST(Verdict, ARatioWithinTheNoiseIsReportedAsNearOne) {
    std::vector<Record> records{synthetic({.detector = "theirs", .own = false, .first_tick_us = 400})};
    for (const int tick_us : {250, 300, 500, 700}) {
        const std::string name = "takes " + std::to_string(tick_us);
        records.push_back(synthetic({.detector = name, .first_tick_us = tick_us, .state_hash = name}));
    }
    const Results results(records);
    const auto ratios = [verdict = verdict_of(results)](double noise_floor) {
        std::map<std::string, std::string> by_name;
        for (const TableRow& row : verdict_table(verdict, "", noise_floor).rows) {
            by_name[row.cells.at(1).substr(0, 9)] = row.cells.at(10);
        }
        return by_name;
    };
    using Reported = std::map<std::string, std::string>;
    EXPECT_EQ(ratios(1.5), (Reported{{"`theirs` ", "1"},
                                     {"`takes 25", "0.625"},
                                     {"`takes 30", "≈ 0.750"},
                                     {"`takes 50", "≈ 1.25"},
                                     {"`takes 70", "1.75"}}));
    EXPECT_EQ(ratios(not_known), (Reported{{"`theirs` ", "1"},
                                           {"`takes 25", "0.625"},
                                           {"`takes 30", "0.750"},
                                           {"`takes 50", "1.25"},
                                           {"`takes 70", "1.75"}}));
}

TEST(Verdict, AFailedSceneLeavesNoMeanAndGoesLast) {
    std::vector<Record> records = three_methods();
    records.push_back(synthetic({.scene = "stab", .first_tick_us = 1000, .residual_mm = 9.0}));
    records.push_back(synthetic({.scene = "stab",
                                 .detector = "theirs",
                                 .own = false,
                                 .outcome = {OutcomeKind::crashed, "signal 11 (Segmentation fault)"}}));
    const Results results(records);
    const Verdict verdict = verdict_of(results);
    const VerdictRow& last = verdict.rows.back();
    EXPECT_EQ(last.method.label(), "theirs + push (intersection)");
    EXPECT_EQ(last.failed_runs, 1);
    EXPECT_TRUE(std::isnan(last.p50.value));
    const Table table = verdict_table(verdict, "", 1.0);
    EXPECT_EQ(table.rows.back().cells.at(8), "fails");
    EXPECT_EQ(table.rows.back().cells.back(), "1 of 3 runs, 1 of 2 scenes ok");
}

TEST(Verdict, AMethodOfSomeScenesComparesWithNoneOfAll) {
    std::vector<Record> records;
    for (const char* detector : {"mine", "theirs"}) {
        for (const char* scene : {"a", "b"}) {
            records.push_back(
                synthetic({.scene = scene, .detector = detector, .first_tick_us = 100, .residual_mm = 5.0}));
        }
    }
    records.push_back(synthetic({.scene = "a", .detector = "guest", .first_tick_us = 300, .residual_mm = 1.0}));
    records.push_back(synthetic({.scene = "a", .detector = "late", .first_tick_us = 400, .residual_mm = 2.0}));
    const Results results(records);
    const Verdict verdict = verdict_of(results);
    ASSERT_EQ(verdict.rows.size(), 2U);
    ASSERT_EQ(verdict.partial.size(), 2U);
    EXPECT_EQ(verdict.partial[0].method.detector, "guest");
    EXPECT_FALSE(verdict.partial[0].dominated) << "row mine is faster on other scenes";
    EXPECT_TRUE(verdict.partial[1].dominated) << "by guest, of the same scenes";
    EXPECT_NEAR(verdict.partial[0].p50.value, 300e3, 1e-6) << "mean over the scenes that it ran on";
    const Table table = partial_table(verdict, "", 1.0);
    EXPECT_EQ(table.rows.at(0).cells.at(1), "a");
    EXPECT_TRUE(make_verdict(results, "theirs", "closed_loop", {"a"}).partial.empty());
}

TEST(Regression, SameRecordsAreTheSameAndTheClockTakesNoPart) {
    const std::vector<Record> before = three_methods();
    std::vector<Record> after;
    for (const std::int64_t process : {0, 1}) {
        after.push_back(synthetic({.repetition = process, .first_tick_us = 777}));
        after.push_back(synthetic({.detector = "theirs", .own = false, .repetition = process, .first_tick_us = 5}));
    }
    after.push_back(before[2]);
    const StudyComparison found = compare_studies(before, after, 1e-9);
    EXPECT_TRUE(found.same()) << found.changes.front().figure;
    EXPECT_EQ(found.compared, 3);
}

TEST(Regression, AChangedFigureIsReportedBeforeAndAfter) {
    const std::vector<Record> before{synthetic({.residual_mm = 0.5})};
    const std::vector<Record> after{synthetic({.residual_mm = 0.75, .false_negatives = 1})};
    const StudyComparison found = compare_studies(before, after, 1e-9);
    EXPECT_FALSE(found.same());
    const auto has = [&found](const std::string& figure, const std::string& from, const std::string& to) {
        return std::any_of(found.changes.begin(), found.changes.end(), [&](const FigureChange& change) {
            return change.run == "closed_loop poke: mine + push (intersection)" && change.figure == figure &&
                   change.before == from && change.after == to;
        });
    };
    EXPECT_TRUE(has("residual_penetration_max_m [m]", "0.000500", "0.000750"));
    EXPECT_TRUE(has("false_negatives", "0", "1110"));
    EXPECT_TRUE(
        has("pairs / contacts / native contacts, first at tick 0 (1110 ticks differ)", "4 / 0 / 0", "3 / 0 / 0"));
    EXPECT_TRUE(compare_studies(before, {synthetic({.residual_mm = 0.5000001})}, 1e-3).same());
}

TEST(Regression, MissingExtraAndStaleRunsFail) {
    const std::vector<Record> before{synthetic({.scene = "a"}), synthetic({.scene = "b"})};
    std::vector<Record> after{synthetic({.scene = "b"}), synthetic({.scene = "c"})};
    after[0].spec.scene_hash = "another";
    const StudyComparison found = compare_studies(before, after, 1.0);
    EXPECT_EQ(found.missing, std::vector<std::string>{"closed_loop a: mine + push (intersection)"});
    EXPECT_EQ(found.extra, std::vector<std::string>{"closed_loop c: mine + push (intersection)"});
    EXPECT_EQ(found.stale, std::vector<std::string>{"closed_loop b: mine + push (intersection)"});
    EXPECT_FALSE(found.same());
    EXPECT_FALSE(compare_studies({}, {}, 1.0).same()) << "nothing compared is no success";
}

TEST(Report, DistinguishesNotApplicableFromZeroAndFailure) {
    std::vector<Record> records = three_methods();
    records.push_back(synthetic({.detector = "lost", .outcome = {OutcomeKind::absent, "lost: library not found"}}));
    records.push_back(synthetic({.scene = "liver", .outcome = {OutcomeKind::unsupported, "no data"}}));
    records.push_back(
        synthetic({.scene = "stab", .outcome = {OutcomeKind::timed_out, "ended after the limit of 5 s"}}));
    const std::string markdown = test::whole(make_report(records));
    test::expect_holds(
        markdown,
        {"absent (lost: library not found)",
         "| closed_loop | `mine + push (intersection)` | liver | unsupported (no data) | 1 |",
         "| closed_loop | `mine + push (intersection)` | stab | timed_out (ended after the limit of 5 s) | 1 |"});
    EXPECT_EQ(markdown.find("No run failed"), std::string::npos);
}

TEST(Report, RecallIsGivenWithAndWithoutTouches) {
    // Per tick 4 true pairs, 1 of them touching; 2 missed, 1 of these touching; 1 extra: precision 2/3, recall 2/4,
    // without touches 2/3, F1 = 2 * 2 / (4 + 3).
    const std::vector<Record> records{synthetic({.mode = "replay", .false_negatives = 2, .false_positives = 1})};
    test::expect_holds(test::whole(make_report(records)),
                       {"| `mine` | 4440 | 1110 | 0.667 | 0.500 | 0.667 | 0.571 | 2220 / 1110 | 1 of 1 |",
                        "misses 2220 of 4440, adds 1110"});
    const std::vector<Record> one_tick{synthetic({.mode = "replay", .ticks = 1, .false_negatives = 1})};
    test::expect_holds(test::whole(make_report(one_tick)), {"misses 1 of 4"});
}

TEST(Report, AnAnswerCutByALimitIsNeverOk) {
    for (const std::string mode : {"replay", "closed_loop"}) {
        Record record = synthetic({.mode = mode});
        for (std::size_t i = 0; i < 7; ++i) record.rows[i].truncated = true;
        record.summary = summarize(record.rows);
        const std::string markdown = test::whole(make_report({record}));
        const std::string expected = mode == "replay" ? "| poke | cut in 7 ticks |" : "0 / 0 of 4440, cut in 7 ticks";
        EXPECT_NE(markdown.find(expected), std::string::npos) << mode << "\n" << markdown;
        EXPECT_NE(markdown.find("7 ticks truncated"), std::string::npos) << mode;
    }
}

TEST(Report, AlmostAllIsNeverPrintedAsAll) {
    Record record = synthetic({.mode = "replay", .true_pairs = 1000});
    record.rows[0].false_negatives = 1;
    record.rows[0].false_negatives_touch = 0;
    record.rows[0].pairs -= 1;
    record.summary = summarize(record.rows);
    const std::string markdown = test::whole(make_report({record}));
    EXPECT_NE(markdown.find("| 0.999999 |"), std::string::npos) << "1 of 1 110 000 pairs is missing";
}

TEST(Report, TableTwoOneHasNumbersWhereAResponseStandsForARowAndNotMeasuredElsewhere) {
    std::vector<Record> records = three_methods();
    EXPECT_NE(test::whole(make_report(records)).find("| in no row |"), std::string::npos);
    // Three runs of 1100 timed ticks of a response that stands for a row: 9 mm left at worst with tissue, 1.25 mm
    // without.
    Record tissue = synthetic({.response = "bounce", .residual_mm = 3.5});
    Record rigid = synthetic({.scene = "cross", .pair_class = "I2I", .response = "bounce", .residual_mm = 1.25});
    Record broken = synthetic({.scene = "stab", .response = "bounce", .outcome = {OutcomeKind::unstable, "blew up"}});
    Record torn = synthetic({.scene = "drag", .response = "bounce", .residual_mm = 9.0});
    for (Record* record : {&tissue, &rigid, &broken, &torn}) {
        record->environment["response.table_row"] = "B. Mirtich et al";
        record->environment["response.without_tissue"] = "acts as springs where nothing bends";
        for (StepRow& row : record->rows) row.stage_ns.at(static_cast<std::size_t>(Stage::respond)) = 7000;
        record->summary = summarize(record->rows);
        records.push_back(*record);
    }
    records.back().summary[Metric::ruptures] = 1;
    records.back().summary[Metric::reference_clears_hard] = 0;
    test::expect_holds(test::whole(make_report(records)),
                       {"| B. Mirtich et al | Impulse based | Y / N / N | `bounce` (intersection) | 3 of 4 | "
                        "4 | 7.00 | 107 | 0 of 3300 | 1.25 | 9.00 |",
                        "| D. Baraff et al | Constraint | N / Y / Y | not measured |",
                        " Each of `bounce` acts as springs where nothing bends.",
                        "| P. Volino et al [48, 49] | Impulse based | Y / N / Y | not measured |"});
}

TEST(Report, EveryResponseNamesARowOfTableTwoOneOrNone) {
    const std::vector<std::string> rows = table_2_1_rows();
    EXPECT_EQ(rows.size(), 17U);
    for (const ResponseEntry& entry : registry().responses()) {
        EXPECT_TRUE(entry.table_row == "none" || std::find(rows.begin(), rows.end(), entry.table_row) != rows.end())
            << entry.name << ": " << entry.table_row;
    }
}

/// A point of a sweep, at 1 ms a tick.
Record swept(test::SyntheticRun run) {
    run.mode = "work_precision";
    Record record = synthetic(run);
    record.environment["run.dt_s"] = "0.001";
    record.rows.clear();
    return record;
}

/// The knob k at 50 and 100 for one response, at 100 for another that is slower and worse.
std::vector<Record> sweep() {
    const auto at = [](const char* response, const char* point, std::int64_t us, double left) {
        return swept({.response = response, .first_tick_us = us, .residual_mm = left, .knob = "k", .point = point});
    };
    return {at("soft", "50", 100, 2.0), at("soft", "100", 200, 0.5), at("slow", "100", 300, 0.75)};
}

TEST(Report, SettledScenesAreTheWorstOverTheDetectorsAndMotionsAreReportedOnce) {
    const auto run = [](const std::string& detector, const std::string& response, const std::string& hash,
                        double settled, double ruptures) {
        Record record = synthetic({.detector = detector, .response = response, .residual_mm = 4.0, .state_hash = hash});
        record.summary[Metric::residual_penetration_settled_m] = settled;
        record.summary[Metric::ruptures] = ruptures;
        record.summary[Metric::reference_clears_hard] = 0.0;
        record.summary[Metric::substeps] = 16.0;
        return record;
    };
    const std::vector<Record> records{
        run("mine", "tearing", "a1", 2.0e-3, 3.0),  run("twin", "tearing", "a1", 2.0e-3, 3.0),
        run("mine", "clearing", "b1", 0.5e-4, 0.0), run("theirs", "clearing", "b2", 3.0e-3, 0.0),
        run("mine", "gentle", "c1", 0.5e-4, 0.0),   run("mine", "brief", "d1", not_known, 0.0)};
    const std::string markdown = test::whole(make_report(records));
    test::expect_holds(markdown,
                       {"| response | poke |\n", "| hard contact, within the strain limit | no |",
                        "| `clearing` (intersection) | not cleared (3.00 mm residual) |",
                        "| `gentle` (intersection) | cleared (4.00 mm at worst before) |",
                        "| `tearing` (intersection) | rupture reported (2.00 mm residual) |",
                        "| I2T | poke | `mine + tearing (intersection)`, moving alike: `twin` | 2.00 | no | 3 |"});
    EXPECT_EQ(markdown.find("| I2T | poke | `twin"), std::string::npos);
    EXPECT_NE(markdown.find("Sub-steps of the integrator per tick (n_sub): 16 on poke."), std::string::npos);
}

TEST(Report, ABlindDetectorSaysNothingOfWhatAResponseClears) {
    std::vector<Record> records{synthetic({.residual_mm = 4.0, .state_hash = "a1"}),
                                synthetic({.detector = "blind", .residual_mm = 9.0, .state_hash = "b1"})};
    for (Record& record : records) {
        record.summary[Metric::reference_clears_hard] = 1.0;
        record.summary[Metric::residual_penetration_settled_m] = record.spec.detector == "blind" ? 9.0e-3 : 0.0;
    }
    const auto row = [&records] {
        const std::string markdown = test::whole(make_report(records));
        const std::size_t at = markdown.find("\n| `push` (intersection) | ", markdown.find("Which scenes are clear"));
        return at == std::string::npos ? markdown : markdown.substr(at + 1, markdown.find('\n', at + 1) - at - 1);
    };
    EXPECT_EQ(row(), "| `push` (intersection) | not cleared (9.00 mm residual) |");
    records[1].environment["detector.control"] = "yes";
    EXPECT_EQ(row(), "| `push` (intersection) | cleared (4.00 mm at worst before) |");
}

TEST(Report, OutcomesOfOneMotionStandInOneRowThatNamesAll) {
    const std::string markdown =
        test::whole(make_report({synthetic({}), synthetic({.detector = "twin"}), synthetic({.response = "shove"})}));
    test::expect_holds(markdown, {"| poke | `mine + push (intersection)`, moving alike: `mine + shove (intersection)`, "
                                  "`twin` |"});
    const std::size_t outcomes = markdown.find("**Outcome of every closed-loop run");
    const std::string table = markdown.substr(outcomes, markdown.find("<sub>", outcomes) - outcomes);
    EXPECT_EQ(table.find("| poke | `twin"), std::string::npos);
}

TEST(Report, WorkAndPrecisionMarksDominatedPoints) {
    const Report report = make_report(sweep());
    test::expect_holds(
        test::whole(report),
        {"| `mine + soft` | 50 N/m | n/a | 100 | 2.00 | n/a / n/a | ok |",
         "| `mine + soft` | 100 N/m | n/a | 200 | 0.500 |",
         "| `mine + slow` | 100 N/m | n/a | 300 | 0.750 † | n/a / n/a | ok |",
         "| poke | k | `mine + soft` at 100 N/m | 0.500 mm | 200 | `mine + soft` at 50 N/m | 2.00 mm | 100 |",
         "> On poke over `k`, the least residual penetration is that of `mine + soft` at 100 N/m (0.500 mm "
         "at worst, 200 µs per "});
    test::expect_holds(report.files.at("charts/work_precision_1.svg"),
                       {"mine + soft, k = 50 N/m: 100 µs, 2.00 mm", "1 ms"});
}

TEST(Report, PointsOfOneCurveHaveTheNameOfTheMethodWithoutTheKnobAndWithAllElse) {
    const auto point = [](const std::string& detector, const std::string& response, const std::string& knob,
                          const std::string& value) {
        return swept({.detector = detector, .response = response, .ticks = 20, .knob = knob, .point = value});
    };
    std::vector<Record> records;
    for (const std::string value : {"50", "100"}) {
        records.push_back(point("mine", "alone:k=" + value, "response.k", value));
        records.push_back(point("mine", "first:k=" + value + ",mu=1", "response.k", value));
        records.push_back(point("mine", "middle:a=1,k=" + value + ",mu=1", "response.k", value));
        records.push_back(point("mine", "unilateral:friction_k=7,k=" + value, "response.k", value));
        records.push_back(point("grid:bv=AABB,cell=" + value, "", "detector.cell", value));
    }
    records.push_back(point("mine", "default", "response.k", "50"));
    records.push_back(point("mine", "other:friction_k=7", "response.k", "50"));
    const std::string markdown = test::whole(make_report(records));
    for (const char* curve : {"mine + alone", "mine + first:mu=1", "mine + middle:a=1,mu=1",
                              "mine + unilateral:friction_k=7", "grid:bv=AABB over cell"}) {
        for (const char* value : {"50", "100"}) {
            EXPECT_NE(markdown.find(fmt::format("| `{}` | {} | ", curve, value)), std::string::npos)
                << curve << " at " << value << '\n'
                << markdown;
        }
    }
    test::expect_holds(markdown, {"| `mine + default` | 50 | ", "| `mine + other:friction_k=7` | 50 | "});
}

TEST(Report, ForceErrorsAreRankedBeyondTheBoundOfTheReferenceOnly) {
    std::vector<Record> records = sweep();
    const auto with_forces = [&records](double first, double second, double third) {
        const std::array<double, 3> errors{first, second, third};
        for (std::size_t i = 0; i < records.size(); ++i) {
            records[i].environment["reference.hard"] = "order in step 1.0; bound 0.02 N RMS";
            records[i].environment["reference.equal_k"] = "no reference (for a test)";
            records[i].summary[Metric::force_error_rms_hard] = errors.at(i);
            records[i].summary[Metric::force_bound_hard] = 0.02;
        }
        return make_report(records);
    };
    // soft at 50 and at 100 N/m, slow at 100 N/m: two lie within the bound, so the faster of them stands first.
    const Report ranked = with_forces(0.5, 0.019, 0.001);
    test::expect_holds(test::whole(ranked),
                       {"| poke | k | hard contact | `mine + soft` at 100 N/m | ≤ 0.0200 | 0.0200 | 200 |",
                        "| `mine + slow` | 100 N/m | n/a | 300 | 0.750 † | n/a / 0.00100 † | ok |",
                        "| `mine + soft` | 50 N/m | n/a | 100 | 2.00 | n/a / 0.500 | ok |",
                        "Hard contact: order in step 1.0; bound 0.02 N RMS. Equal k: no reference (for a test)."});
    EXPECT_FALSE(ranked.files.contains("charts/work_precision_1_equal_k.svg"));
    test::expect_holds(ranked.files.at("charts/work_precision_1_hard.svg"), {"force error against hard contact"});
    const Report alike = with_forces(0.02, 0.019, 0.001);
    EXPECT_NE(test::whole(alike).find("| poke | k | hard contact | not ranked |  | 0.0200 |  |"), std::string::npos);
    EXPECT_FALSE(alike.files.contains("charts/work_precision_1_hard.svg"));
}

TEST(Report, EveryStiffnessIsHeldAgainstTheReferenceOfItsOwn) {
    std::vector<Record> records = sweep();
    // soft at 50 N/m, soft and slow at 100 N/m: the references of the two stiffnesses know their forces differently.
    const std::array<double, 3> errors{0.03, 0.03, 0.5};
    for (std::size_t i = 0; i < records.size(); ++i) {
        const bool fine = records[i].spec.point == "50";
        records[i].environment["reference.hard"] = "bound 9 N";
        records[i].environment["reference.equal_k"] = fine ? "bound 0.01 N RMS" : "bound 0.04 N RMS";
        records[i].summary[Metric::force_error_rms_equal_k] = errors.at(i);
        records[i].summary[Metric::force_bound_equal_k] = fine ? 0.01 : 0.04;
    }
    const Report reported = make_report(records);
    const std::string& markdown = test::whole(reported);
    // 0.03 N at 100 N/m may be 0.04 N: that of 50 N/m is the least.
    test::expect_holds(markdown, {"| poke | k | contact of equal k | `mine + soft` at 50 N/m | 0.0300 | 0.0100 | 100 |",
                                  "| `mine + slow` | 100 N/m | n/a | 300 | 0.750 † | 0.500 † / n/a | ok |",
                                  "Equal k at 50 N/m: bound 0.01 N RMS. Equal k at 100 N/m: bound 0.04 N RMS.",
                                  "The reference itself knows 0.0100 to 0.0400 N."});
    test::expect_holds(reported.files.at("charts/work_precision_1_equal_k.svg"),
                       {"mine + soft, k = 50 N/m: 100 µs, 0.0300 N"});

    // A point without one keeps the place of the others.
    records[0].environment["reference.equal_k"] = "no reference (none is stored for k = 50 N/m)";
    records[0].summary[Metric::force_error_rms_equal_k] = not_known;
    records[0].summary[Metric::force_bound_equal_k] = not_known;
    const Report partly = make_report(records);
    test::expect_holds(test::whole(partly), {"Equal k at 50 N/m: no reference (none is stored for k = 50 N/m).",
                                             "| `mine + soft` | 50 N/m | n/a | 100 | 2.00 | n/a / n/a | ok |"});
    EXPECT_EQ(partly.files.at("charts/work_precision_1_equal_k.svg").find("k = 50 N/m"), std::string::npos);
}

TEST(Report, ASettingThatAStudyTurnsIsNobodysDefault) {
    Record turned =
        synthetic({.mode = "work_precision", .detector = "mine:cell=2", .knob = "detector.cell", .point = "2"});
    Record chosen = synthetic({.detector = "mine"});
    Record passing = synthetic({.mode = "work_precision", .detector = "mine", .knob = "detector.cell", .point = "1"});
    test::expect_holds(test::whole(make_report({turned, passing, chosen})),
                       {"| detector | `mine:cell=2` |   |  | none declared | turned by the study |",
                        "| detector | `mine` |   |  | none declared | default |",
                        "| detector | `mine` | `mine` | not run | not tuned |"});
}

TEST(Report, AHalvedTickCostsTwiceAsMuchPerSimulatedTime) {
    std::vector<Record> records = sweep();
    for (Record& record : records) {
        record.spec.knob = "dt";
        record.spec.point = record.spec.point == "50" ? "0.0005" : "0.001";
        record.environment["run.dt_s"] = record.spec.point;
    }
    test::expect_holds(test::whole(make_report(records)), {"| `mine + soft` | 0.0005 s | n/a | 200 | 2.00 † |"});
}

TEST(Report, KnobsThatAreTurnedAreNoNoise) {
    std::vector<Record> records = sweep();
    EXPECT_TRUE(std::isnan(Results(records).noise_floor()));
    // The same point in two processes is one: 100 and 150 µs.
    Record again = records.front();
    again.spec.repetition = 1;
    again.summary.at(Metric::total_median_ns) *= 1.5;
    records.push_back(again);
    EXPECT_DOUBLE_EQ(Results(records).noise_floor(), 1.5);
    EXPECT_TRUE(Results(records).methods("work_precision").empty());
}

TEST(Report, NoiseIsTheRatioThatNineteenOfTwentyPairsOfProcessesStayBelow) {
    // Twenty-one scenes, two processes each: exp(0), exp(0.01), … exp(0.2) times as slow. The 0.95 quantile of
    // 0, 0.01, … 0.2 is 0.19 exactly.
    std::vector<Record> records;
    for (int i = 0; i <= 20; ++i) {
        for (int process = 0; process < 2; ++process) {
            records.push_back(synthetic({.scene = "scene" + std::to_string(i), .repetition = process, .ticks = 20}));
            records.back().summary[Metric::total_median_ns] = 1e5 * std::exp(process == 0 ? 0.01 * i : 0.0);
        }
    }
    EXPECT_NEAR(Results(records).noise_floor(), std::exp(0.19), 1e-12);
}

TEST(Report, ABaselineLeftOutIsOneOfTheThingsThatAreChanged) {
    // Least left: mine, then theirs; the third detector is behind both.
    const Report report = make_report({synthetic({.detector = "mine", .residual_mm = 0.1}),
                                       synthetic({.detector = "theirs", .own = false, .residual_mm = 0.2}),
                                       synthetic({.detector = "third", .own = false, .residual_mm = 0.3})});
    test::expect_holds(test::whole(report), {"| `theirs` left out | `mine + push (intersection)` | yes |",
                                             "| `mine` left out | `theirs + push (intersection)` | left out itself |"});
}

TEST(Report, DepthOfASceneWhereOnlyTheContactYieldsIsCalledItsOwn) {
    test::expect_holds(test::whole(make_report({synthetic({.scene = "cross", .pair_class = "I2I"}), synthetic({})})),
                       {"On cross nothing but the contact gives way"});
    EXPECT_EQ(test::whole(make_report({synthetic({})})).find("nothing but the contact"), std::string::npos);
}

TEST(Report, AWinnerThatHangsOnOneSceneIsReportedAsSuch) {
    // mine is better on a, theirs on b, and by more: geometric means 1.73 and 1.41 mm.
    const std::vector<Record> records{
        synthetic({.scene = "a", .residual_mm = 1.0}), synthetic({.scene = "b", .residual_mm = 3.0}),
        synthetic({.scene = "a", .detector = "theirs", .own = false, .residual_mm = 2.0, .state_hash = "b"}),
        synthetic({.scene = "b", .detector = "theirs", .own = false, .residual_mm = 1.0, .state_hash = "b"})};
    test::expect_holds(test::whole(make_report(records)),
                       {"| nothing: the order of the tables, all scenes | `theirs + push (intersection)` | yes |",
                        "| scene b left out | `mine + push (intersection)` |",
                        "| scene a left out | `theirs + push (intersection)` |", "Yes: 2 different rows come first"});
}

TEST(Report, AQuantileThatOneProcessLacksIsOfTooFewTicks) {
    const std::string markdown =
        test::whole(make_report({synthetic({.ticks = 1010}), synthetic({.repetition = 1, .ticks = 1009})}));
    const std::size_t row = markdown.find("| poke | `mine + push (intersection)` | 1000 |");
    ASSERT_NE(row, std::string::npos);
    EXPECT_LT(markdown.find("| n too small |", row), markdown.find('\n', row));
}

/// A run by the clock, with figures of both loops.
Record clocked(const std::string& detector, double ticks, double overruns) {
    Record record = synthetic({.mode = "paced", .detector = detector});
    record.summary.merge(Summary{{Metric::substeps, 4},
                                 {Metric::paced_ticks, ticks},
                                 {Metric::paced_overruns, overruns},
                                 {Metric::paced_skipped, 1000.0 - ticks},
                                 {Metric::paced_latency_median_ns, 130e3},
                                 {Metric::paced_latency_p99_ns, 700e3},
                                 {Metric::paced_latency_p999_ns, not_known},
                                 {Metric::paced_latency_max_ns, 1.5e6},
                                 {Metric::paced_cpu_median_ns, 110e3},
                                 {Metric::paced_cpu_p999_ns, not_known},
                                 {Metric::paced_switches, 6},
                                 {Metric::paced_steal, 0.025},
                                 {Metric::paced_age_p99_ns, 1.4e6},
                                 {Metric::paced_force_step_p999_n, 0.02},
                                 {Metric::paced_stiffness_p999_n_per_m, 2000},
                                 {Metric::paced_damping_ns_per_m, 1},
                                 {Metric::empty_ticks, 1000},
                                 {Metric::empty_overruns, 1},
                                 {Metric::empty_skipped, 2},
                                 {Metric::empty_latency_median_ns, 1e3},
                                 {Metric::empty_latency_p999_ns, 9e3},
                                 {Metric::empty_latency_max_ns, 90e3},
                                 {Metric::empty_cpu_median_ns, 300},
                                 {Metric::empty_cpu_p999_ns, 2e3},
                                 {Metric::empty_switches, 5},
                                 {Metric::empty_age_p99_ns, 1.01e6}});
    return record;
}

TEST(Report, APacedLoopIsHeldAgainstTheEmptyOneOfItsRun) {
    // Three of 1000 against one of 1000: 5/16 by chance; a share 0.95^(1/4) bounds the ratio.
    const Report report = make_report({clocked("mine", 1000, 3)});
    test::expect_holds(
        report.files.at("report.md"),
        {"| detector + response | CPU per tick p50 / p99.9 (µs) | overruns of ticks | skipped periods | overruns ÷ "
         "empty loop's | contact model age p99 (ms) | force step in contact p99.9 (N) | apparent stiffness p99.9 (N/m) "
         "/ damping for passivity (N s/m) |",
         "| empty loop, of all runs | 0.300 / 2.00 | 1 of 1000 | 2 |",
         "| `mine + push (intersection)` | 110 / n too small | 3 of 1000 | 0 | 3.00, at most 77.5, p 0.31",
         "| 1.40 | 0.0200 | 2000 / 1.00 |", "without dither"});
    test::expect_holds(test::whole(report),
                       {"| poke | `mine + push (intersection)` | 1000 | 4 | 130 | 700 | n too small | 1500 | 6 | 2.50 "
                        "| 1 of 1000 | 1.00 | 9.00 | 90.0 | 5 |"});
    Record dithered = clocked("mine", 1000, 3);
    dithered.spec.overrides = "dither=1e-05";
    test::expect_holds(make_report({dithered}).files.at("report.md"), {"a dither of 10.0 µm at every tick"});
}

TEST(Report, PacedRowsStandByTheirShareOfOverrunsAfterTheEmptyLoopOfAllRuns) {
    Record broken = clocked("broken", 1000, 0);
    broken.outcome = {OutcomeKind::unstable, "tick 3: too stiff"};
    // Fewer overruns, but in every tick.
    const std::string page =
        make_report({broken, clocked("slow", 2, 2), clocked("quick", 1000, 5)}).files.at("report.md");
    const auto place = [&page](const std::string& text) {
        EXPECT_NE(page.find(text), std::string::npos) << text << page;
        return page.find(text);
    };
    const std::size_t empty = place("| empty loop, of all runs | 0.300 / 2.00 | 2 of 2000 | 4 |");
    const std::size_t quick = place("| `quick + push (intersection)` | 110 / n too small | 5 of 1000 | 0 | 5.00,");
    const std::size_t slow =
        place("| `slow + push (intersection)` | 110 / n too small | 2 of 2 | 998 | 1000, at most ");
    const std::size_t failed = place("| `broken + push (intersection)` | unstable (tick 3: too stiff) |");
    EXPECT_LT(empty, quick);
    EXPECT_LT(quick, slow);
    EXPECT_LT(slow, failed);
    test::expect_holds(page,
                       {"> Released by the clock, ticks overrun the millisecond in 5 of 1000 (`quick + push "
                        "(intersection)`) to 2 of 2 (`slow + push (intersection)`), those of an empty loop in 2 of "
                        "2000."});
}

TEST(Report, PacedFiguresThatARecordLacksAreNotKnown) {
    test::expect_holds(make_report({synthetic({.mode = "paced"})}).files.at("report.md"),
                       {"| empty loop, of all runs | n/a / n too small | n/a | n/a |",
                        "| `mine + push (intersection)` | n/a / n too small | n/a | n/a | n/a | n too small |"});
}

/// A run whose detection takes this long in every tick.
Record sized(const std::string& scene, int triangles, std::int64_t detect_us, const std::string& stepper) {
    Record record = synthetic({.mode = "cost_by_size", .scene = scene, .ticks = 30, .first_tick_us = detect_us});
    record.spec.stepper = stepper == "semi_implicit" ? "" : stepper;
    record.environment["run.stepper"] = stepper;
    record.environment["run.tissue_triangles"] = std::to_string(triangles);
    record.summary[Metric::substeps] = 7;
    return record;
}

TEST(Report, CostBySizeIsOneChartPerFamilyAndStepperWithSizesAscending) {
    Record failed = sized("organ_9k", 9000, 1, "implicit");
    failed.outcome = {OutcomeKind::unstable, "tick 3: too stiff"};
    const Report report =
        make_report({sized("sheet_20k", 20000, 300, "implicit"), sized("sheet_2k", 2000, 40, "implicit"),
                     sized("sheet_2k", 2000, 60, "semi_implicit"), failed});
    const std::string& markdown = test::whole(report);
    EXPECT_NE(markdown.find("## Cost by size"), std::string::npos);
    const std::size_t small = markdown.find("| sheet_2k | `mine + push` | `implicit` | 2000 | 7 | 20 | 40.0 |");
    const std::size_t large = markdown.find("| sheet_20k | `mine + push` | `implicit` | 20000 | 7 | 20 | 300 |");
    ASSERT_NE(small, std::string::npos) << markdown;
    ASSERT_NE(large, std::string::npos) << markdown;
    EXPECT_LT(small, large);
    test::expect_holds(markdown,
                       {"| organ_9k | `mine + push` | `implicit` | 9000 | 7 | unstable (tick 3: too stiff) |"});
    // Families in alphabetical order; the organ has failed and no point.
    EXPECT_FALSE(report.files.contains("charts/cost_by_size_1.svg"));
    test::expect_holds(report.files.at("charts/cost_by_size_2.svg"),
                       {"sheet_20k, 20000 triangles, detect: 300 µs", "sheet_2k, 2000 triangles, whole tick: 40.0 µs",
                        "tissue triangles, sheet, implicit"});
    EXPECT_TRUE(report.files.contains("charts/cost_by_size_3.svg"));
    const std::string& page = report.files.at("report.md");
    const std::size_t head =
        page.find("| scene | detector + response | tissue triangles | `implicit` | `semi_implicit` |");
    EXPECT_NE(head, std::string::npos) << page;
    const std::size_t organ = page.find("| organ_9k | `mine + push` | 9000 | unstable (tick 3: too stiff) |  |");
    const std::size_t first = page.find("| sheet_2k | `mine + push` | 2000 | 40.0 | 60.0 |");
    const std::size_t second = page.find("| sheet_20k | `mine + push` | 20000 | 300 |  |");
    EXPECT_TRUE(organ < first && first < second && second != std::string::npos) << page;
}

TEST(Report, ASizeThatNoRunReportedStandsInARowOfItsOwn) {
    // A method that ran out of time reported no triangles.
    const auto late = [](const std::string& scene) {
        Record record = sized(scene, 1, 1, "implicit");
        record.environment.erase("run.tissue_triangles");
        record.outcome = {OutcomeKind::timed_out, "1 s"};
        return record;
    };
    const std::string page =
        make_report({late("sheet_1M"), sized("sheet_20k", 20000, 300, "semi_implicit"), late("sheet_20k"),
                     sized("sheet_2k", 2000, 40, "implicit"), sized("sheet_2k", 2000, 60, "semi_implicit")})
            .files.at("report.md");
    const std::size_t first = page.find("| sheet_2k | `mine + push` | 2000 | 40.0 | 60.0 |");
    const std::size_t second = page.find("| sheet_20k | `mine + push` | 20000 | timed_out (1 s) | 300 |");
    const std::size_t third = page.find("| sheet_1M | `mine + push` | n/a | timed_out (1 s) |  |");
    EXPECT_TRUE(first < second && second < third && third != std::string::npos) << page;
}

TEST(Report, DepthErrorOfADetectorIsTheMedianOverScenesAndTheWorstOfAll) {
    std::vector<Record> records;
    for (const auto& [scene, median, worst] :
         {std::tuple{"one", 0.009, 0.011}, std::tuple{"two", 0.001, 0.020}, std::tuple{"three", 0.002, 0.004}}) {
        records.push_back(synthetic({.scene = scene}));
        records.back().summary[Metric::depth_error_median_m] = median;
        records.back().summary[Metric::depth_error_max_m] = worst;
    }
    test::expect_holds(test::whole(make_report(records)), {"| `mine` | 2.00 / 20.0 | n/a |"});
}

TEST(Report, ForceErrorsAgainstBothReferencesAreReported) {
    std::vector<Record> records = three_methods();
    EXPECT_NE(test::whole(make_report(records)).find("| no reference |"), std::string::npos);
    for (Record& record : records) {
        record.summary[Metric::force_error_rms_equal_k] = 0.125;
        record.summary[Metric::force_error_rms_hard] = 0.5;
    }
    EXPECT_NE(test::whole(make_report(records)).find("| 0.125 / 0.500 |"), std::string::npos);
    // A reference that knows its force to 0.75 N only cannot report an error of 0.5 N.
    for (Record& record : records) record.summary[Metric::force_bound_hard] = 0.75;
    EXPECT_NE(test::whole(make_report(records)).find("| 0.125 / ≤ 0.750 |"), std::string::npos);
}

TEST(Report, SettledDepthIsHeldAgainstATenthOfAMillimetre) {
    Record record = synthetic({.residual_mm = 0.05});
    record.summary[Metric::residual_penetration_settled_m] = 0.05e-3;
    test::expect_holds(test::whole(make_report({record})), {"| 0.0500 | no reference | 0 | cleared |"});
    record.summary[Metric::residual_penetration_settled_m] = 3e-3;
    record.summary[Metric::wrong_side_vertices_last] = 7;
    test::expect_holds(test::whole(make_report({record})), {"7 vertices stay on the wrong side, no rupture reported"});
    record.summary[Metric::ruptures] = 1;
    EXPECT_NE(test::whole(make_report({record})).find("| rupture reported |"), std::string::npos);
}

TEST(Report, SamplesWithoutASideStandBesideTheDepthWhereThereAreAny) {
    Record record = synthetic({.residual_mm = 0.05});
    record.summary[Metric::side_undecided_max] = 0.0;
    EXPECT_EQ(test::whole(make_report({record})).find(" undecided)"), std::string::npos);
    record.summary[Metric::side_undecided_max] = 12.0;
    const std::string report = test::whole(make_report({record}));
    for (std::size_t found = 0, times = 0; times < 3; ++times) {  // verdict, run by run, clearing
        found = report.find("(12 undecided)", found + 1);
        EXPECT_NE(found, std::string::npos) << times;
    }
    EXPECT_NE(report.find("Undecided: sample points"), std::string::npos);
}

TEST(Report, DirtyTreeAndNoisyMachineAreStamped) {
    std::vector<Record> records = three_methods();
    EXPECT_NE(test::whole(make_report(records)).find("Noisy machine"), std::string::npos);
    EXPECT_EQ(test::whole(make_report(records)).find("uncommitted changes"), std::string::npos);
    for (Record& record : records) record.environment["dirty"] = "yes";
    EXPECT_NE(test::whole(make_report(records)).find("uncommitted changes"), std::string::npos);
}

TEST(Report, DifferentFramesForDifferentDetectorsAreReported) {
    std::vector<Record> records{synthetic({.mode = "replay"}), synthetic({.mode = "replay", .detector = "theirs"})};
    EXPECT_NE(test::whole(make_report(records)).find("`00000000000000ff` | yes |"), std::string::npos);
    records[1].frames_hash = "00000000000000fe";
    EXPECT_NE(test::whole(make_report(records)).find("| no |"), std::string::npos);
}

TEST(Report, RebuiltItLeavesNoDrawingOfYesterday) {
    const test::TemporaryFolder folder;
    test::store_records(folder.path(), three_methods());
    const Report report = write_report(folder.path());
    EXPECT_EQ(report.files, make_report(three_methods()).files) << "nothing is lost in the records";
    const std::filesystem::path left_over = folder.write("charts/of_yesterday.svg", "<svg/>");
    ASSERT_TRUE(std::filesystem::exists(left_over));
    write_report(folder.path());
    EXPECT_FALSE(std::filesystem::exists(left_over));
}

TEST(Report, OfAFolderWithoutRecordsIsBadInput) {
    const test::TemporaryFolder folder;
    test::expect_refused("report " + folder.path().string(), "records.jsonl");
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Report, HalfALineIsBadInputWithItsNumber) {
    const test::TemporaryFolder folder;
    const std::string line = to_json_line(synthetic({.ticks = 3}));
    folder.write("records.jsonl", line + "\n" + line.substr(0, line.size() / 2) + "\n");
    test::expect_refused("report " + folder.path().string(), "line 2");
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "report.md"));
}

}  // namespace
}  // namespace trocar
