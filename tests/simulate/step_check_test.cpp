#include "simulate/step_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "geometry/input_error.hpp"
#include "method/registry.hpp"
#include "simulate/runs.hpp"
#include "support/scene_samples.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;
using test::run_program;

Json poke() { return Json::parse(test::poke_text()); }

/// poke_text by one sub-step a tick, which no lattice of 6 mm bears.
Json poke_beyond() {
    Json scene = poke();
    scene["bodies"][0]["tissue"] = {{"substeps", 1}, {"pinned", "rim"}};
    return scene;
}

RunSpec spec_of(const std::string& mode) {
    RunSpec spec;
    spec.mode = mode;
    spec.detector = "ohc";
    spec.response = "penalty";
    spec.contacts = "intersection";
    spec.ticks = 40;
    return spec;
}

class StepCheckRun : public testing::Test {
protected:
    std::string write(const Json& scene) {
        const std::string file = (folder_.path() / "scene.json").string();
        std::ofstream(file) << scene.dump();
        return file;
    }
    test::TemporaryFolder folder_;
};

TEST(StepCheck, ASceneBeyondTheStepNamesVertexEdgeAndARemedyThatHelps) {
    const Scene scene = test::scene_from_text(poke_beyond().dump());
    const StepCheck check = check_step(scene, "");
    ASSERT_TRUE(check.unstable(scene.dt));
    const std::string why = why_unstable(scene, check);
    test::expect_holds(why, {"vertex ", " of sheet", "edge ", "N/m", "substeps "});
    Json mended = poke_beyond();
    mended["bodies"][0]["tissue"]["substeps"] = check.tissue.substeps_stable;
    const Scene stable = test::scene_from_text(mended.dump());
    EXPECT_TRUE(why_unstable(stable, check_step(stable, "")).empty());
    EXPECT_LE(stable.dt / stable.materials.substeps, check_step(stable, "").tissue.stable_step);
}

TEST(StepCheck, AStudysRunBeyondTheStepIsAnOutcomeAndAnAllowedOneIsMarked) {
    const Scene scene = test::scene_from_text(poke_beyond().dump());
    for (const char* mode : {"closed_loop", "work_precision", "paced"}) {
        const Record refused = make_run(scene, spec_of(mode));
        EXPECT_EQ(refused.outcome.kind, OutcomeKind::unstable) << mode;
        EXPECT_TRUE(refused.outcome.message.starts_with("not started: ")) << refused.outcome.message;
        EXPECT_TRUE(refused.rows.empty());
    }
    const Record allowed = make_run(scene, spec_of("closed_loop"), {.allow_unstable_step = true});
    EXPECT_FALSE(allowed.rows.empty());
    EXPECT_TRUE(allowed.environment.contains("run.unstable_step"));
    EXPECT_FALSE(make_run(scene, spec_of("hard_case")).rows.empty()) << "its point may be what becomes of it";
    const Scene plain = test::scene_from_text(poke().dump());
    EXPECT_FALSE(make_run(plain, spec_of("closed_loop")).environment.contains("run.unstable_step"));
}

TEST(StepCheck, AnUnstableTickNamesItsVertexAndTheStepThatItBearsWhichFitsTheSubStepsThatWouldDo) {
    const Scene scene = test::scene_from_text(poke_beyond().dump());
    const Outcome outcome = make_run(scene, spec_of("hard_case")).outcome;
    ASSERT_EQ(outcome.kind, OutcomeKind::unstable);
    const std::string message = outcome.message;
    test::expect_holds(message, {"tick ", "vertex ", "edge ", "substeps "});
    const std::string bears = " bears ";
    const std::size_t at = message.find(bears);
    ASSERT_NE(at, std::string::npos) << message;
    const std::string substeps = "ms: substeps ";
    const std::size_t remedy = message.find(substeps, at);
    ASSERT_NE(remedy, std::string::npos) << message;
    const double step = std::stod(message.substr(at + bears.size()));  // ms, of three digits
    const double fewest = std::stod(message.substr(remedy + substeps.size()));
    ASSERT_GE(fewest, 2.0) << message;
    // A tick of 1 ms in so many steps is borne, in one fewer it is not.
    EXPECT_LE(1.0 / fewest, 1.006 * step) << message;
    EXPECT_GE(1.0 / (fewest - 1.0), step / 1.006) << message;
}

TEST(StepCheck, PartsOfOneInstrumentHaveOneOperatorAndTwoInstrumentsTwo) {
    Json scene = Json::parse(test::press_text(0.0));
    scene["bodies"][1]["instrument"] = "left";
    Json other = scene["bodies"][1];
    other["name"] = "other";
    for (const char* instrument : {"left", "right"}) {
        other["instrument"] = instrument;
        scene["bodies"][2] = other;
        const StepCheck check = check_step(test::scene_from_text(scene.dump()), "");
        EXPECT_EQ(check.operators.size(), instrument == std::string("left") ? 1U : 2U);
    }
}

/// One mass and its virtual coupling by the scheme itself, a little below and above the limit.
TEST(StepCheck, AnOperatorsLimitIsThatOfItsScheme) {
    for (const auto& [mass, damping, coupling_damping] :
         {std::tuple{0.1, 1.0, 3.0}, {0.05, 0.0, 0.0}, {0.1, 20.0, 50.0}}) {
        Json scene = Json::parse(test::press_text(0.0));
        scene["bodies"][1]["motion"]["operator"] = {
            {"mass", mass}, {"damping", damping}, {"coupling_damping", coupling_damping}, {"coupling_stiffness", 1e9}};
        const Scene stiff = test::scene_from_text(scene.dump());
        const StepCheck check = check_step(stiff, "");
        ASSERT_EQ(check.operators.size(), 1U);
        const double h = stiff.dt / check.substeps;
        EXPECT_TRUE(check.operators[0].unstable);
        for (const double factor : {0.98, 1.02}) {
            const double k = factor * check.operators[0].most_stiffness;
            ASSERT_GT(k, 0.0);
            double x = 1e-6;
            double v = 0.0;
            for (int step = 0; step < 20000; ++step) {
                v += h / mass * (-k * x - (damping + coupling_damping) * v);
                x += h * v;
                if (std::abs(x) > 1.0) break;
            }
            EXPECT_EQ(std::abs(x) > 1e-3, factor > 1.0) << k << " N/m";
            scene["bodies"][1]["motion"]["operator"]["coupling_stiffness"] = k;
            const Scene near = test::scene_from_text(scene.dump());
            EXPECT_EQ(why_unstable(near, check_step(near, "")).empty(), factor < 1.0);
        }
    }
}

TEST_F(StepCheckRun, TheProgramRefusesWithOneLineAndTakesItByAnExplicitChoice) {
    const std::string file = write(poke_beyond());
    const test::ProgramResult refused = run_program("run " + file);
    EXPECT_EQ(refused.status, 2);
    EXPECT_EQ(refused.out, "");
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
    EXPECT_NE(refused.err.find("vertex "), std::string::npos) << refused.err;
    const test::ProgramResult allowed = run_program("run " + file + " --unstable-step allow --ticks 3 --json");
    EXPECT_TRUE(Json::parse(allowed.out).contains("unstable_step")) << allowed.err;
    EXPECT_EQ(run_program("run " + file + " --unstable-step perhaps").status, 2);
    const test::ProgramResult stepped = run_program("run " + file + " --unstable-step substep --ticks 20 --json");
    EXPECT_EQ(stepped.status, 0) << stepped.err;
    const Json run = Json::parse(stepped.out);
    EXPECT_EQ(run.at("outcome"), "ok");
    EXPECT_TRUE(run.contains("unstable_step"));
    const test::ProgramResult explained = run_program("run " + file + " --explain-step --json");
    EXPECT_EQ(explained.status, 0) << explained.err;
    const Json reported = Json::parse(explained.out);
    EXPECT_EQ(reported.at("verdict"), "unstable");
    EXPECT_LT(reported.at("tissue").at("stable_step").get<double>(),
              reported.at("tissue").at("unstable_step").get<double>());
    EXPECT_EQ(reported.at("tissue").at("spring_evaluations"), reported.at("tissue").at("springs"));
    // As few as are stable for certain.
    const double taken = run.at("summary").at("substeps").get<double>();
    const double dt = 0.001;
    EXPECT_LE(dt / taken, reported.at("tissue").at("stable_step").get<double>());
    EXPECT_GT(dt / (taken - 1.0), reported.at("tissue").at("stable_step").get<double>());
}

TEST_F(StepCheckRun, MoreThanFourSubStepsAreReportedBeforeTheRun) {
    EXPECT_EQ(run_program("run " + write(poke()) + " --ticks 2").err, "");
    Json scene = poke();
    scene["bodies"][0]["parts"][0]["edge"] = 0.002;
    const test::ProgramResult fine = run_program("run " + write(scene) + " --ticks 2");
    EXPECT_EQ(fine.status, 0) << fine.err;
    EXPECT_NE(fine.err.find("spring evaluations"), std::string::npos) << fine.err;
    EXPECT_EQ(std::count(fine.err.begin(), fine.err.end(), '\n'), 1) << fine.err;
}

TEST_F(StepCheckRun, ARimThatHoldsNothingIsReported) {
    Json scene = poke();
    scene["bodies"][0]["closed"] = true;
    scene["bodies"][0]["parts"][0] = {{"shape", "sphere"}, {"radius", 0.02}, {"edge", 0.005}};
    scene["bodies"][0]["pose"] = {0, 0, -0.05, 0, 0, 0};
    const auto lines_of = [&] {
        const test::ProgramResult result = run_program("run " + write(scene) + " --ticks 1");
        EXPECT_EQ(result.status, 0) << result.err;
        return result.err;
    };
    EXPECT_NE(lines_of().find("holds nothing"), std::string::npos);
    scene["bodies"][0]["tissue"]["pinned"] = "rim";
    EXPECT_NE(lines_of().find("holds nothing"), std::string::npos);
    scene["bodies"][0]["tissue"]["pinned"] = "none";
    EXPECT_EQ(lines_of().find("holds nothing"), std::string::npos);
}

}  // namespace
}  // namespace trocar
