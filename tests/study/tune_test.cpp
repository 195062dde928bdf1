// The search for settings: its points, its scores, and that its stages find the least of a bowl.
#include "study/tune.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "geometry/input_error.hpp"
#include "method/registry.hpp"
#include "study/study.hpp"
#include "support/commands.hpp"
#include "support/program.hpp"

namespace trocar {
namespace {

TEST(Sobol, HasThePointsOfTheLiterature) {
    // Bratley and Fox 1988; Joe and Kuo 2008: the first points of the first four dimensions, in Gray-code order.
    const std::vector<std::vector<double>> points{{0, 0, 0, 0},
                                                  {0.5, 0.5, 0.5, 0.5},
                                                  {0.75, 0.25, 0.25, 0.25},
                                                  {0.25, 0.75, 0.75, 0.75},
                                                  {0.375, 0.375, 0.625, 0.875},
                                                  {0.875, 0.875, 0.125, 0.375},
                                                  {0.625, 0.125, 0.875, 0.625},
                                                  {0.125, 0.625, 0.375, 0.125}};
    for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(sobol_point(i, 4), points[i]) << i;
}

TEST(Sobol, EveryDimensionHasOnePointInEverySixtyFourth) {
    for (std::size_t dimension = 0; dimension < most_tuned_parameters; ++dimension) {
        std::set<int> cells;
        for (std::uint64_t i = 0; i < 64; ++i) {
            cells.insert(static_cast<int>(64.0 * sobol_point(i, most_tuned_parameters).at(dimension)));
        }
        EXPECT_EQ(cells.size(), 64U) << dimension;
    }
}

Tune bowl() {
    Tune tune;
    tune.name = "bowl";
    tune.detector = "ohc_clustered";
    tune.scenes = {"/a.json", "/b.json"};
    tune.first_scenes = 1;
    tune.responses.push_back({.method = "penalty",
                              .contacts = {"intersection", "tracked_proximity"},
                              .stepper = "",
                              .ranges = {{.key = "k", .from = 1e3, .to = 1e7, .log = true},
                                         {.key = "relaxation_time", .from = 0.0003, .to = 0.0303}}});
    return tune;
}

TEST(TuneSetting, RangesAreLinearOrLogarithmicAndTheLastPlaceIsTheGenerator) {
    const Tune tune = bowl();
    EXPECT_EQ(setting_at(tune.responses[0], {0.5, 0.5, 0.2}),
              (TuneSetting{"penalty:k=100000,relaxation_time=0.0153", "intersection"}));
    EXPECT_EQ(setting_at(tune.responses[0], {0.0, 1.0, 0.7}),
              (TuneSetting{"penalty:k=1000,relaxation_time=0.0303", "tracked_proximity"}));
    EXPECT_EQ(setting_at(tune.responses[0], {1.0, 0.0, 1.0}).contacts, "tracked_proximity");
}

Record run_with(double depth, double jump, OutcomeKind outcome = OutcomeKind::ok) {
    Record record;
    record.outcome.kind = outcome;
    record.summary[Metric::residual_penetration_max_m] = depth;
    record.summary[Metric::force_jump_max_n] = jump;
    return record;
}

TEST(TuneScore, IsTheMedianOfLogarithmsAndFailuresAndLimitsComeFirst) {
    Tune tune = bowl();
    tune.depth_offset = 0.5;
    const Record shallow = run_with(0.5, 1.0);
    const Record deep = run_with(1.5, 1.0);
    const Record jumpy = run_with(0.0, 9.0);
    const Record failed = run_with(0.0, 0.0, OutcomeKind::unstable);
    EXPECT_NEAR(score_of(tune, {&shallow, &deep}).objective, 0.5 * (std::log(1.0) + std::log(2.0)), 1e-12);
    EXPECT_EQ(score_of(tune, {&shallow, &deep}).broken, 0);
    EXPECT_EQ(score_of(tune, {&shallow, &failed}).broken, 1);
    EXPECT_TRUE(std::isinf(score_of(tune, {&shallow, &failed}).objective));
    EXPECT_NEAR(score_of(tune, {&shallow, &deep, &failed}).objective, std::log(2.0), 1e-12);
    EXPECT_EQ(score_of(tune, {&jumpy}).broken, 0);
    tune.limits[Metric::force_jump_max_n] = 5.0;
    EXPECT_EQ(score_of(tune, {&jumpy}).broken, 1);
    EXPECT_LT(score_of(tune, {&deep}), score_of(tune, {&jumpy})) << "a setting that keeps the limits comes first";
}

TEST(TuneScore, ForceStepsAreLimitedByThoseOfTheReferenceWhereThereIsOne) {
    Tune tune = bowl();
    tune.force_step = {.times_reference = 2.0, .plus = 0.05};
    Record run = run_with(0.5, 0.25);
    EXPECT_EQ(score_of(tune, {&run}).broken, 0) << "no reference is known";
    run.summary[Metric::reference_force_step_hard] = 0.11;
    EXPECT_EQ(score_of(tune, {&run}).broken, 0) << "0.25 N of 0.27 N";
    run.summary[Metric::reference_force_step_hard] = 0.09;
    EXPECT_EQ(score_of(tune, {&run}).broken, 1) << "0.25 N of 0.23 N";
}

/// Least at k = 2e5, relaxation_time = 0.01, on tracked_proximity.
TuneScore bowl_score(const TuneSetting& setting) {
    const MethodSpec spec = parse_method(setting.response);
    const double k = std::log10(std::stod(spec.parameters.at("k")) / 2e5);
    const double time = (std::stod(spec.parameters.at("relaxation_time")) - 0.01) / 0.03;
    return {.broken = 0, .objective = k * k + time * time + (setting.contacts == "intersection" ? 1.0 : 0.0)};
}

TEST(TuneSearch, FindsTheLeastOfABowlFromBothStartsBetterThanAFullGridOfItsBudget) {
    const Tune tune = bowl();
    std::vector<double> found;
    for (int start = 0; start < tune_starts; ++start) {
        TuneSearch search(tune, tune.responses[0], start);
        std::size_t runs = 0;
        for (int stage = 0; stage < TuneSearch::stages; ++stage) {
            const std::vector<TuneSetting> settings = search.settings(stage);
            EXPECT_EQ(settings.size(), stage == 0 ? tune.first : stage == 1 ? tune.second : tune.local / local_rounds);
            std::vector<TuneScore> scores;
            scores.reserve(settings.size());
            for (const TuneSetting& setting : settings) scores.push_back(bowl_score(setting));
            search.take_scores(stage, scores);
            runs += settings.size();
        }
        EXPECT_EQ(runs, 64U + 16U + 32U);
        EXPECT_EQ(search.best().setting.contacts, "tracked_proximity");
        EXPECT_EQ(search.best().score, bowl_score(search.best().setting));
        found.push_back(search.best().score.objective);
        // 7 x 8 x 2 settings: the slow obvious way at the same cost.
        double grid = std::numeric_limits<double>::infinity();
        for (int i = 0; i < 7; ++i) {
            for (int j = 0; j < 8; ++j) {
                grid = std::min(grid, bowl_score(setting_at(tune.responses[0], {i / 6.0, j / 7.0, 0.9})).objective);
            }
        }
        EXPECT_LT(found.back(), grid);
    }
    TuneSearch one(tune, tune.responses[0], 0);
    TuneSearch other(tune, tune.responses[0], 1);
    EXPECT_NE(one.settings(0), other.settings(0));
}

TEST(TuneResult, IsConvergedWhereTheStartsAgreeWithinFivePercent) {
    TuneResult result;
    result.by_start = {{0, std::log(1.00)}, {0, std::log(1.04)}};
    EXPECT_TRUE(result.converged());
    result.by_start[1].objective = std::log(1.06);
    EXPECT_FALSE(result.converged());
    result.by_start[1] = {1, std::log(1.0)};
    EXPECT_FALSE(result.converged()) << "one of them breaks a limit";
}

/// The bytes of the published file are the seed of the judged scenes, so that the same search must write them again.
TEST(TunedText, HasTheLimitsAsThePublishedFileHasThem) {
    const auto published =
        nlohmann::ordered_json::parse(test::read_file(std::filesystem::path(TROCAR_SOURCE_DIR) / "bench/tuned.json"));
    const Tune tune = read_tune(std::filesystem::path(TROCAR_SOURCE_DIR) / "bench/tune.json", {});
    const auto text = nlohmann::ordered_json::parse(tuned_text(tune, {}));
    for (const char* key : {"format", "tune", "seed", "objective", "limits", "budget"}) {
        EXPECT_EQ(text.at(key).dump(), published.at(key).dump()) << key;
    }
}

TEST(TuneStage, IsAStudyOfItsSettingsOnTheFirstScenesAndThenOnAll) {
    Tune tune = bowl();
    tune.scenes = {std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_poke.json",
                   std::string(TROCAR_SOURCE_DIR) + "/scenes/i2t_stab.json"};
    const std::vector<std::vector<TuneSetting>> settings{{{"penalty:k=1000", "intersection"},
                                                          {"penalty:k=1000", "tracked_proximity"},
                                                          {"penalty:k=2000", "tracked_proximity"}}};
    const test::TemporaryFolder folder;
    for (const int stage : {0, 1}) {
        const std::filesystem::path file = folder.path() / "study.json";
        std::ofstream(file) << tune_stage_text(tune, stage, settings);
        const std::vector<PlannedRun> plan = make_plan(read_study(file, {}, {}));
        EXPECT_EQ(plan.size(), stage == 0 ? 3U : 6U);
    }
}

/// The message of a file that is refused.
std::string refusal(const std::string& responses, const std::string& more = "") {
    const test::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "tune.json";
    std::ofstream(file) << R"({"format": "trocar-tune-1", "name": "t", "detector": "ohc", "first_scenes": 1,
        "scenes": [")" << TROCAR_SOURCE_DIR
                        << R"(/scenes/i2t_poke.json"], "responses": [)" << responses << "]" << more << "}";
    try {
        (void)read_tune(file, {});
    } catch (const InputError& error) {
        return error.what();
    }
    return "taken";
}

TEST(TuneFile, FaultsAreNamedWithTheirPlace) {
    const auto penalty = [](const std::string& ranges) {
        return R"({"method": "penalty", "contacts": ["intersection"], "ranges": {)" + ranges + "}}";
    };
    EXPECT_EQ(refusal(penalty(R"("k": {"from": 1, "to": 2})")), "taken");
    const auto expect_place = [](const std::string& message, const std::string& place) {
        EXPECT_NE(message.find(place), std::string::npos) << message;
    };
    expect_place(refusal(penalty(R"("k": {"from": 2, "to": 2})")), "/responses/0/ranges/k: expected a range with from");
    expect_place(refusal(penalty(R"("k": {"from": 0, "to": 2, "log": true})")), "/responses/0/ranges/k/from");
    expect_place(refusal(penalty(R"("stiffness": {"from": 1, "to": 2})")), "/responses/0/ranges/stiffness");
    expect_place(refusal(penalty("")), "/responses/0/ranges: expected 1 to 4 parameters");
    expect_place(refusal(penalty(R"("k": {"from": 1, "to": 2})"), R"(, "limits": {"depth": 1})"), "/limits");
    expect_place(refusal(penalty(R"("k": {"from": 1, "to": 2})"), R"(, "force_step_limit": {"times_reference": 2})"),
                 "/force_step_limit");
    expect_place(
        refusal(penalty(R"("k": {"from": 1, "to": 2})"),
                R"(, "force_step_limit": {"times_reference": 2, "plus_N": 1}, "limits": {"force_jump_max_n": 1})"),
        "/force_step_limit: expected it or a limit");
    expect_place(refusal(penalty(R"("k": {"from": 1, "to": 2})"), R"(, "budget": {"local": 6})"), "/budget/local");
    expect_place(refusal(penalty(R"("k": {"from": 1, "to": 2})"), R"(, "budget": {"first": 4})"), "/budget");
}

TEST(TuneCommand, ASceneWithoutReferenceIsRefusedWhereTheLimitNeedsOne) {
    const test::TemporaryFolder folder;
    const std::filesystem::path scene = folder.path() / "poke.json";
    std::filesystem::copy_file(std::string(TROCAR_SOURCE_DIR) + "/bench/studies/scenes/training/press_sheet_1.json",
                               scene);
    const std::filesystem::path file = folder.path() / "tune.json";
    std::ofstream(file) << R"({"format": "trocar-tune-1", "name": "t", "detector": "ohc_clustered", "first_scenes": 1,
        "scenes": ["poke.json"], "force_step_limit": {"times_reference": 2, "plus_N": 0.05},
        "responses": [{"method": "penalty", "contacts": ["tracked_proximity"],
                       "ranges": {"k": {"from": 1e4, "to": 1e6, "log": true}}}]})";
    const auto out = folder.path() / "out";
    const test::ProgramResult result = test::run_program("tune " + file.string() + " --output " + out.string());
    EXPECT_EQ(result.status, 2);
    EXPECT_NE(result.err.find("poke.json: expected a stored reference"), std::string::npos) << result.err;
    EXPECT_FALSE(std::filesystem::exists(out)) << "nothing half-written";
}

TEST(TuneCommand, WritesTheSettingsAndGoesOnWhereItStopped) {
    const test::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "tune.json";
    std::ofstream(file) << R"({"format": "trocar-tune-1", "name": "t", "detector": "ohc_clustered", "first_scenes": 1,
        "scenes": ["i2t_poke"], "budget": {"first": 2, "second": 1, "local": 4},
        "responses": [{"method": "penalty", "contacts": ["tracked_proximity"],
                       "ranges": {"k": {"from": 1e4, "to": 1e6, "log": true}}}]})";
    const std::string command =
        "tune " + file.string() + " --jobs 2 --json --output " + (folder.path() / "out").string();
    const std::string first = test::run_successfully(command).out;
    const auto tuned = nlohmann::json::parse(first);
    const auto& row = tuned.at("responses").at(0);
    EXPECT_EQ(tuned.at("format"), "trocar-tuned-1");
    EXPECT_EQ(row.at("method"), "penalty");
    EXPECT_EQ(row.at("starts").size(), 2U);
    EXPECT_LT(row.at("score").at("objective").get<double>(), row.at("as_it_comes").at("objective").get<double>())
        << "a stiff penalty leaves less than that of the scene";
    EXPECT_EQ(test::read_file(folder.path() / "out/tuned.json"), first);
    const auto last = folder.path() / "out/stage_5/runs";
    std::filesystem::remove_all(last);
    EXPECT_EQ(test::run_successfully(command).out, first);
}

}  // namespace
}  // namespace trocar
