#include "report/page_one.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "geometry/input_error.hpp"
#include "report/worst_tick.hpp"
#include "support/program.hpp"
#include "support/text.hpp"
#include "synthetic.hpp"

namespace trocar {
namespace {

using test::synthetic;

/// Two scenes. unilateral: 0.2 and 0.5 mm in 300 µs; baseline: 1 and 2 mm in 600 µs; twin moves as baseline does, bit
/// by bit; loser fails on b.
std::vector<Record> four_responses() {
    std::vector<Record> records{
        synthetic(
            {.scene = "a", .response = "unilateral", .first_tick_us = 300, .residual_mm = 0.2, .state_hash = "1"}),
        synthetic(
            {.scene = "b", .response = "unilateral", .first_tick_us = 250, .residual_mm = 0.5, .state_hash = "2"}),
        synthetic({.scene = "a", .response = "baseline", .first_tick_us = 600, .residual_mm = 1.0, .state_hash = "3"}),
        synthetic({.scene = "b", .response = "baseline", .first_tick_us = 500, .residual_mm = 2.0, .state_hash = "4"}),
        synthetic({.scene = "a", .response = "twin", .first_tick_us = 90, .residual_mm = 1.0, .state_hash = "3"}),
        synthetic({.scene = "b", .response = "twin", .first_tick_us = 90, .residual_mm = 2.0, .state_hash = "4"}),
        synthetic({.scene = "a", .response = "loser", .residual_mm = 0.1, .state_hash = "5"}),
        synthetic({.scene = "b", .response = "loser", .outcome = {OutcomeKind::unstable, "tick 7"}})};
    for (Record& record : records) record.environment["study.ours"] = "unilateral";
    return records;
}

std::vector<std::string> names(const std::vector<ResponseRow>& rows) {
    std::vector<std::string> list;
    for (const ResponseRow& row : rows) list.push_back(name_of_row(row, "mine"));
    return list;
}

TEST(PageOne, TheSentenceSetsTheNamedResponseAgainstTheBestOther) {
    const std::vector<Record> records = four_responses();
    const Draft draft(records);
    EXPECT_EQ(response_sentence(draft, response_rows(draft)),
              "Over 2 tissue scenes `unilateral` left 0.500 mm at worst, the best other response, `baseline`, 2.00 mm "
              "at 2.00 times the time; 1 of 6 runs failed.");
}

TEST(PageOne, AStudyThatNamesNobodySetsItsRowsAgainstEachOther) {
    std::vector<Record> records = four_responses();
    for (Record& record : records) record.environment.erase("study.ours");
    const Draft draft(records);
    const std::string sentence = response_sentence(draft, response_rows(draft));
    EXPECT_EQ(sentence.find("Over 2 tissue scenes `unilateral` left 0.500 mm at worst, the next, `baseline`, 2.00 mm"),
              0U)
        << sentence;
}

TEST(PageOne, RowsOfTheSameBitsStandOnceAndFailedOnesLast) {
    const std::vector<Record> records = four_responses();
    const Draft draft(records);
    EXPECT_EQ(
        names(response_rows(draft)),
        (std::vector<std::string>{"`unilateral` (intersection)", "`baseline` (intersection) = `twin` (intersection)",
                                  "`loser` (intersection)"}));
}

TEST(PageOne, ReadingsAreARangeInTheRowOfTheirResponseOnTheirScenes) {
    std::vector<Record> records = four_responses();
    // On scene a alone: 1.0 mm at the values of `baseline`, 0.4 and 3.0 mm at others.
    for (const auto& [response, residual] : {std::pair("baseline:k=1", 0.4), std::pair("baseline:k=9", 3.0)}) {
        records.push_back(
            synthetic({.scene = "a", .response = response, .residual_mm = residual, .state_hash = response}));
        records.back().environment["response.reading_of"] = "baseline";
        records.back().environment["response.setting"] = "reading";
    }
    const Draft draft(records);
    const std::vector<ResponseRow> rows = response_rows(draft);
    ASSERT_EQ(rows.size(), 3U);
    const Table table = responses_table(draft, rows);
    EXPECT_EQ(table.rows[1].cells[2], "2.00 (0.400–3.00)");
    EXPECT_EQ(table.rows[0].cells[2], "0.500");
    const Table readings = readings_table(draft, rows);
    ASSERT_EQ(readings.rows.size(), 2U);
    EXPECT_EQ(readings.rows[1].cells[2], "3.00");
    EXPECT_NE(response_sentence(draft, rows).find("1 of 8 runs failed."), std::string::npos);

    records.back().outcome = {OutcomeKind::unstable, "tick 7"};
    const Draft failed(records);
    EXPECT_EQ(responses_table(failed, response_rows(failed)).rows[1].cells[2], "2.00 (0.400–∞)");
}

TEST(PageOne, AMethodWrittenInPythonIsNamedAPrototype) {
    std::vector<Record> records = four_responses();
    for (const std::size_t i : {2U, 3U}) records[i].environment["response.library"] = "Python";
    const Draft draft(records);
    const Table table = responses_table(draft, response_rows(draft));
    EXPECT_TRUE(table.rows[1].cells[0].ends_with(", a prototype in Python")) << table.rows[1].cells[0];
    EXPECT_EQ(table.rows[0].cells[0].find("Python"), std::string::npos);
}

TEST(PageOne, NumbersAreWorstOverScenesAndMediansOverScenes) {
    std::vector<Record> records = four_responses();
    for (const std::size_t i : {0U, 1U}) {
        records[i].summary[Metric::force_bound_hard] = 0.2;
        records[i].summary[Metric::reference_force_max_hard] = 2.0;
        records[i].summary[Metric::reference_force_step_hard] = i == 0 ? 4.0 : 8.0;
    }
    records[0].summary[Metric::force_error_rms_hard] = 0.1;
    records[1].summary[Metric::force_error_rms_hard] = 0.3;
    records[0].summary[Metric::force_without_touch_m] = 2e-5;
    records[1].summary[Metric::force_without_touch_m] = 3e-5;
    records[0].summary[Metric::ruptures] = 0;
    records[1].summary[Metric::ruptures] = 2;
    const Draft draft(records);
    const Table table = responses_table(draft, response_rows(draft));
    // Depths 0.2 and 0.5 mm; steps 2 N over 4 N and over 8 N; an error of 0.3 N of 2 N.
    EXPECT_EQ(table.rows.at(0).cells,
              (std::vector<std::string>{"`unilateral` (intersection)", "0.350", "0.500, 2 tears", "0.0300",
                                        "1 of 2; 15.0 %", "0.500", "0.300", "0 of 2"}));
    EXPECT_EQ(table.rows.at(2).cells,
              (std::vector<std::string>{"`loser` (intersection)", "∞", "∞", "∞", "0 of 1; ∞ %", "∞", "∞", "1 of 2"}))
        << "a failed run is infinite, in a median of two as well";
    EXPECT_EQ(table.rows.at(0).command,
              "for scene in a.json b.json; do trocar run $scene --detector mine --response unilateral --contacts "
              "intersection --ticks 1110; done");
}

TEST(PageOne, ASceneThatAResponseDidNotRunOnIsReported) {
    std::vector<Record> records = four_responses();
    records.erase(records.begin() + 1);  // unilateral on b
    const Draft draft(records);
    const std::vector<ResponseRow> rows = response_rows(draft);
    const auto ours = std::find_if(rows.begin(), rows.end(), [](const ResponseRow& row) { return row.ours; });
    ASSERT_NE(ours, rows.end());
    EXPECT_NE(ours, rows.begin()) << "what ran on every scene stands first";
    const Table table = responses_table(draft, rows);
    EXPECT_EQ(table.rows.at(static_cast<std::size_t>(ours - rows.begin())).cells.back(), "0 of 1, 1 not run");
}

TEST(PageOne, OfMoreThanTenRowsTheBestOfEveryResponseAreShownAndTheRestIsReported) {
    std::vector<Record> records;
    for (int k = 1; k <= 12; ++k) {
        records.push_back(synthetic({.response = "soft:k=" + std::to_string(k),
                                     .residual_mm = 0.1 * k,
                                     .state_hash = "s" + std::to_string(k)}));
    }
    records.push_back(synthetic({.response = "late", .residual_mm = 9.0, .state_hash = "late"}));
    const Draft draft(records);
    const std::vector<ResponseRow> rows = response_rows(draft);
    ASSERT_EQ(rows.size(), 13U);
    const Table table = responses_table(draft, rows);
    ASSERT_EQ(table.rows.size(), page_one_rows);
    EXPECT_LE(table.columns.size(), page_one_columns);
    EXPECT_EQ(table.rows.front().cells.front(), "`soft:k=1` (intersection)");
    EXPECT_EQ(table.rows.back().cells.front(), "`late` (intersection)");
    test::expect_holds(table.note, {"Not shown, at worst: `soft:k=10` (intersection) 1.00 mm; `soft:k=11` "
                                    "(intersection) 1.10 mm; `soft:k=12` (intersection) 1.20 mm."});
}

TEST(PageOne, ADetectorThatHidesContactsIsNoMethod) {
    std::vector<Record> records = four_responses();
    records.push_back(synthetic(
        {.scene = "a", .detector = "blind", .response = "unilateral", .residual_mm = 0.0, .state_hash = "9"}));
    records.back().environment["detector.control"] = "yes";
    const Draft draft(records);
    EXPECT_EQ(response_rows(draft).size(), 3U);
}

TEST(PageOne, EveryFigureOfTheResponsesTableIsExplained) {
    const std::vector<Record> records = four_responses();
    const Draft draft(records);
    const Table table = responses_table(draft, response_rows(draft));
    for (std::size_t i = 1; i < table.columns.size(); ++i) {
        EXPECT_TRUE(table.columns[i].metric || !table.columns[i].help.empty()) << i;
    }
}

TEST(PageOne, TearsAreNamedBesideTheWorst) {
    std::vector<Record> records = four_responses();
    records[1].summary[Metric::ruptures] = 1;
    records[1].summary[Metric::reference_clears_hard] = 0;
    const Draft draft(records);
    test::expect_holds(response_sentence(draft, response_rows(draft)),
                       {"`unilateral` left 0.500 mm at worst (on b; 1 tear in all)"});
}

TEST(PageOne, DetectorsAreReportedOnTheSameFrames) {
    std::vector<Record> records;
    for (const std::int64_t process : {0, 1}) {
        records.push_back(synthetic({.mode = "replay", .repetition = process, .first_tick_us = 50}));
        records.push_back(synthetic({.mode = "replay",
                                     .detector = "theirs",
                                     .repetition = process,
                                     .first_tick_us = 100,
                                     .false_negatives = 1}));
    }
    const Draft draft(records);
    const Table table = detectors_table(draft);
    ASSERT_EQ(table.columns.size(), 7U);
    EXPECT_EQ(table.columns.at(5).header, "time / `theirs` [min–max of 2]");
    EXPECT_EQ(table.rows.at(0).cells,
              (std::vector<std::string>{"`mine`", "0 of 4440", "0", "50.0", "50.0", "0.500 [0.500–0.500]", "0 of 2"}));
    EXPECT_EQ(table.rows.at(1).cells.at(1), "1110 of 4440");
    EXPECT_EQ(
        make_report(records).page_one.find("Over 1 scene mine missed 0 and added 0 of 4440 pairs, the next, theirs "
                                           "missed 1110 and added 0 of 4440 pairs, at 2.00 times the time; 0 of "
                                           "4 runs failed."),
        0U)
        << make_report(records).page_one;
}

TEST(PageOne, AMedianHasTheIntervalOfItsRanks) {
    std::vector<Record> records;
    for (int scene = 1; scene <= 6; ++scene) {
        records.push_back(synthetic(
            {.scene = "s" + std::to_string(scene), .residual_mm = 1.0 * scene, .state_hash = std::to_string(scene)}));
    }
    const Draft draft(records);
    EXPECT_EQ(responses_table(draft, response_rows(draft)).rows.at(0).cells.at(1), "3.50 [1.00–6.00]");
}

TEST(PageOne, ADetectorsTargetsAreSharesOfWrongPairsAndAResponsesAreDepths) {
    // 1110 ticks with 4 true pairs; one is missed in each by theirs: 25 % of the pairs are wrong.
    const std::vector<Record> replays{
        synthetic({.mode = "replay", .first_tick_us = 50}),
        synthetic({.mode = "replay", .detector = "theirs", .first_tick_us = 100, .false_negatives = 1})};
    const Draft replay(replays);
    const LineChart pairs =
        targets_over_time(replay, make_verdict(replay.results, "theirs", "replay", replay.results.scenes("replay")));
    ASSERT_EQ(pairs.lines.size(), 2U);
    EXPECT_EQ(pairs.lines[0].name, "mine");
    EXPECT_EQ(pairs.lines[0].points[1].first, 50.0);
    EXPECT_EQ(pairs.lines[0].points.back().second, 1.0) << "every limit is met";
    EXPECT_NEAR(pairs.lines[1].points.back().second, 1.0 / 6.0, 1e-12) << "30 % alone is met";

    const std::vector<Record> records = four_responses();
    const Draft draft(records);
    const LineChart depths = targets_over_time(draft, make_verdict(draft.results, "theirs", "closed_loop", {"a", "b"}));
    ASSERT_EQ(depths.lines.size(), 3U);
    // unilateral: 0.2 mm meets 3, 1 and 0.3 mm in 300 µs; 0.5 mm meets 3 and 1 mm in 250 µs. Of 2 scenes × 6 limits.
    const auto& points = depths.lines[0].points;
    ASSERT_EQ(points.size(), 7U);
    EXPECT_EQ(points[1], (std::pair{250.0, 1.0 / 12.0}));
    EXPECT_EQ(points[5], (std::pair{300.0, 5.0 / 12.0}));
    EXPECT_EQ(points[6].second, 5.0 / 12.0);
    // loser: 0.1 mm on a; what failed on b meets nothing.
    EXPECT_NEAR(depths.lines[2].points.back().second, 4.0 / 12.0, 1e-12);
}

TEST(PageOne, RepeatsTheSentenceAndTheFirstTableOfReportsThatTheStudyQuotes) {
    std::vector<Record> records = four_responses();
    for (Record& record : records) record.environment["study.quoted_reports"] = "detectors,elsewhere";
    const std::vector<Record> other{synthetic({.mode = "replay", .first_tick_us = 50})};
    const Report report = make_report(records, {}, {}, own_assets, {{"detectors", other}, {"elsewhere", {}}});
    const std::string& page = report.files.at("report.md");
    test::expect_holds(
        page, {"1 of 6 runs failed. Over 1 scene `mine` missed 0 and added 0 of 4440 pairs; 0 of 1 runs failed.",
               "From the report `detectors`: commit `abc1234`, Paper CPU, 1 runs.",
               "The report `elsewhere` is not at hand: `trocar study elsewhere --publish`"});
    test::expect_holds(report.page_one, {"Detectors on the same frames, 1 scene"});
}

TEST(PageOne, HoldsRunsThatAQuotedReportHasTooAgainstTheirStates) {
    std::vector<Record> records = four_responses();
    for (Record& record : records) record.environment["study.quoted_reports"] = "other";
    std::vector<Record> published{records[0], records[1], records[2]};
    const auto page = [&] {
        return make_report(records, {}, {}, own_assets, {{"other", published}}).files.at("report.md");
    };
    test::expect_holds(page(), {"This study repeats 3 of them; 3 end in the same state, bit by bit."});
    EXPECT_EQ(page().find("Other states"), std::string::npos);
    published[1].state_hash = "another";
    test::expect_holds(page(), {"This study repeats 3 of them; 2 end in the same state, bit by bit.",
                                "Other states than in the report `other`: `mine + unilateral (intersection) on b`."});
}

TEST(PageOne, TakesQuotedReportsFromBesideItsFolderFirst) {
    const test::TemporaryFolder folder;
    std::vector<Record> records = four_responses();
    for (Record& record : records) record.environment["study.quoted_reports"] = "other";
    test::store_records(folder.path() / "here/mine", records);
    test::store_records(folder.path() / "published/other",
                        {synthetic({.mode = "replay", .scene = "far", .first_tick_us = 50})});
    const auto page = [&folder] {
        return write_report(folder.path() / "here/mine", {folder.path() / "published"}).page_one;
    };
    test::expect_holds(page(), {"of 4440 pairs"});
    test::store_records(folder.path() / "here/other",
                        {synthetic({.mode = "replay", .first_tick_us = 50, .true_pairs = 7})});
    test::expect_holds(page(), {"of 7770 pairs"});
}

TEST(PageOne, WhatFailedStandsOnARailOfItsOwn) {
    const std::vector<Record> records = four_responses();
    const Draft draft(records);
    const ScatterChart chart = depth_against_time(response_rows(draft));
    ASSERT_EQ(chart.series.size(), 3U);
    EXPECT_FALSE(chart.series.at(0).points.at(0).failed);
    EXPECT_NEAR(chart.series.at(0).points.at(0).x, 0.3, 1e-12) << "ms, of the slower scene";
    EXPECT_NEAR(chart.series.at(0).points.at(0).y, 0.5, 1e-12) << "mm, of the worse scene";
    EXPECT_TRUE(chart.series.at(2).points.at(0).failed);
    test::expect_holds(draw(chart), {">failed</text>", "1 ms"});
    EXPECT_NE(interactive(chart).find("\"name\":\"failed\""), std::string::npos);
}

TEST(PageOne, MarkdownIsPageOneAndLinksToTheRest) {
    const Report report = make_report(four_responses());
    const std::string& page = report.files.at("report.md");
    EXPECT_LT(page.size(), 10'000U);
    EXPECT_EQ(page.find("## Environment"), std::string::npos);
    EXPECT_NE(page.find("* [Environment](report.html#environment)"), std::string::npos) << page;
    EXPECT_NE(report.files.at("report.html").find("<h2 id=\"environment\">"), std::string::npos);
    EXPECT_NE(test::whole(report).find("## Environment"), std::string::npos);
}

TEST(PageOne, ItsLastLineReportsWhereTheNumbersComeFromAndHowToHaveThemAgain) {
    const std::string again =
        " This page again: `trocar report .` in its folder; the records anew: `trocar study made_up.json`.</sub>\n";
    test::expect_holds(make_report(four_responses()).files.at("report.md"),
                       {"<sub>Study `made_up`, commit `abc1234`, Paper CPU, seed 1, 8 runs." + again});
    std::vector<Record> replays{synthetic({.mode = "replay", .scene = "b"}),
                                synthetic({.mode = "replay", .scene = "a"})};
    replays[1].frames_hash = "00000000000000aa";
    for (Record& record : replays) record.environment["commit"] = "0123456789abcdef0123";
    const std::string frames = make_report(replays).files.at("report.md");
    // FNV-1a of 64 bits over "a00000000000000aab00000000000000ff".
    test::expect_holds(frames, {"<sub>Study `made_up`, commit `0123456789ab`, Paper CPU, seed 1, 2 runs. Frames "
                                "`468a08b491d01dbc`." +
                                again});
}

WorstTick seen() {
    WorstTick seen;
    seen.scene = "b";
    seen.tick = 7;
    seen.time = 0.007;
    WorstTick::State state;
    state.name = "`unilateral`";
    state.state_hash = "2";
    state.depth = 0.5;
    state.bodies = {{.name = "sheet", .kind = "tissue", .segments = {{.ends = {-5, 0, 5, 0}, .depth = 0.0}}},
                    {.name = "tool", .kind = "instrument", .segments = {{.ends = {-1, 5, 0, -0.5}, .depth = 0.25}}}};
    state.points = {{0.0, 0.1}};
    seen.states = {state};
    seen.force = {{.name = "`unilateral`", .points = {{0.0, 0.0}, {0.007, 1.5}}}};
    return seen;
}

TEST(WorstTick, IsReadAsItWasWritten) {
    const std::string text = to_json(seen());
    const WorstTick again = worst_tick_from_json(text, "f");
    EXPECT_EQ(to_json(again), text);
    EXPECT_EQ(again.states.at(0).bodies.at(1).segments.at(0).ends, (std::array<double, 4>{-1, 5, 0, -0.5}));
    EXPECT_EQ(again.force.at(0).points.at(1), (std::pair{0.007, 1.5}));
    EXPECT_THROW((void)worst_tick_from_json("{}", "f"), InputError);
    EXPECT_THROW((void)worst_tick_from_json(R"({"format":"another"})", "f"), InputError);
}

TEST(WorstTick, IsDrawnOnPageOneAndWithoutItThePageSaysHowToHaveIt) {
    const Report without = make_report(four_responses());
    EXPECT_NE(without.files.at("report.md").find("`trocar report reports/made_up --picture`"), std::string::npos);
    const Report with = make_report(four_responses(), to_json(seen()));
    EXPECT_EQ(with.files.at("report.md").find("--picture"), std::string::npos);
    EXPECT_NE(with.files.at("report.md").find("(charts/worst_tick.svg)"), std::string::npos);
    test::expect_holds(with.files.at("charts/worst_tick.svg"), {"0.500 mm deep.", "depth 0 to 0.500 mm"});
    EXPECT_TRUE(with.files.contains("charts/worst_tick_force.svg"));
}

/// All that `pattern` finds in its groups, in order.
std::vector<std::string> found_in(const std::string& text, const std::string& pattern) {
    std::vector<std::string> found;
    const std::regex regex(pattern);
    for (std::sregex_iterator match(text.begin(), text.end(), regex); match != std::sregex_iterator(); ++match) {
        for (std::size_t group = 1; group < match->size(); ++group) found.push_back((*match)[group].str());
    }
    return found;
}

/// How light a colour looks ("1b2027"), by the weights of ITU-R BT.709.
double lightness(const std::string& colour) {
    const auto channel = [&colour](std::size_t at) { return std::stoi(colour.substr(at, 2), nullptr, 16); };
    return 0.2126 * channel(0) + 0.7152 * channel(2) + 0.0722 * channel(4);
}

TEST(WorstTick, DeeperIsDarkerByItsShareOfTheDeepestAndLengthsAreDrawnToTheScaleThatIsReported) {
    std::vector<std::string> scale_before;
    for (const double deepest : {0.0625, 0.5, 64.0}) {  // mm
        WorstTick tick = seen();
        tick.states.at(0).depth = deepest;
        tick.states.at(0).bodies.at(1).segments.at(0).depth = deepest / 2.0;
        const std::string picture = draw(tick);
        const std::vector<std::string> scale = found_in(picture, R"re(height="10" fill="#([0-9a-f]{6})"/>)re");
        ASSERT_EQ(scale.size(), 40U) << picture;
        for (std::size_t i = 1; i < scale.size(); ++i) EXPECT_LT(lightness(scale[i]), lightness(scale[i - 1])) << i;
        if (!scale_before.empty()) {
            EXPECT_EQ(scale, scale_before) << deepest;
        }
        scale_before = scale;
        const std::vector<std::string> deep = found_in(picture, R"re(stroke="#([0-9a-f]{6})" stroke-width="4")re");
        ASSERT_EQ(deep.size(), 1U);
        EXPECT_LT(lightness(deep[0]), lightness(scale[19])) << "half as deep: between the two in the middle";
        EXPECT_GT(lightness(deep[0]), lightness(scale[20]));
        // The sheet, which is 10 mm long, and the bar with its length beside it.
        const std::vector<std::string> ends = found_in(
            picture,
            R"re(<line x1="([-0-9.]+)" y1="[-0-9.]+" x2="([-0-9.]+)" y2="[^"]*" stroke="[^"]*" stroke-width="2")re");
        const std::vector<std::string> reported = found_in(picture, R"re(>([0-9]+) mm</text>)re");
        ASSERT_EQ(ends.size(), 4U);
        ASSERT_EQ(reported.size(), 1U);
        const double pixels_per_mm = (std::stod(ends[1]) - std::stod(ends[0])) / 10.0;
        EXPECT_NEAR((std::stod(ends[3]) - std::stod(ends[2])) / std::stod(reported[0]), pixels_per_mm, 0.1);
    }
}

TEST(WorstTick, StatesStandSideBySideEachUnderItsNameWithItsOwnMarks) {
    WorstTick tick = seen();
    for (int more = 0; more < 2; ++more) tick.states.push_back(seen().states.front());
    const std::string picture = draw(tick);
    const std::vector<std::string> width = found_in(picture, R"re(viewBox="0 0 ([0-9]+) )re");
    const std::vector<std::string> panels =
        found_in(picture, R"re(<clipPath id="worst-[0-9]"><rect x="([-0-9.]+)" y="[0-9.]+" width="([0-9.]+)")re");
    const std::vector<std::string> names =
        found_in(picture, R"re(<text x="([-0-9.]+)" y="30.0" font-weight="600">unilateral<)re");
    const std::vector<std::string> rings = found_in(picture, R"re(<circle cx="([-0-9.]+)")re");
    ASSERT_EQ(width.size(), 1U) << picture;
    ASSERT_EQ(panels.size(), 6U) << picture;
    ASSERT_EQ(names.size(), 3U) << picture;
    ASSERT_EQ(rings.size(), 3U) << picture;
    double end_before = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        const double left = std::stod(panels[2 * i]);
        const double right = left + std::stod(panels[2 * i + 1]);
        EXPECT_GT(left, end_before) << i;
        EXPECT_EQ(std::stod(names[i]), left) << i;
        EXPECT_NEAR(std::stod(rings[i]), 0.5 * (left + right), 0.06) << "the point lies in the middle";
        end_before = right;
    }
    EXPECT_LT(end_before, std::stod(width[0]));
}

TEST(WorstTick, ShowsTheSceneWhereEitherRunIsDeepest) {
    std::vector<Record> records = four_responses();
    const auto runs = worst_tick_runs(records);
    ASSERT_TRUE(runs.has_value());
    EXPECT_EQ(runs->first->spec.response, "unilateral");
    EXPECT_EQ(runs->other->spec.response, "baseline");
    EXPECT_EQ(runs->other->spec.scene, "b");
    EXPECT_FALSE(runs->first_is_deeper);
    records[2].summary[Metric::force_error_rms_hard] = 0.1;  // of b there is no solution to set them against
    EXPECT_EQ(worst_tick_runs(records)->other->spec.scene, "a");
    records[0].summary[Metric::residual_penetration_max_m] = 3e-3;
    records[2].summary.erase(Metric::force_error_rms_hard);
    EXPECT_EQ(worst_tick_runs(records)->first->spec.scene, "a");
    EXPECT_TRUE(worst_tick_runs(records)->first_is_deeper);
}

}  // namespace
}  // namespace trocar
