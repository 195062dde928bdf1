// `trocar respond` as others drive it: the data's cases, cases of the same families with other numbers (expected from
// closed forms), and files that are wrong.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "support/commands.hpp"
#include "support/data.hpp"

namespace trocar {
namespace {

using Json = nlohmann::ordered_json;

struct Answer {
    int status = -1;
    Json json;
    std::string err;
};

Answer respond_to_text(const std::string& text) {
    const test::TemporaryFolder folder;
    const test::ProgramResult result = test::run_program("respond --json " + folder.write("cases.json", text).string());
    Answer answer{result.status, nullptr, result.err};
    if (!result.out.empty()) answer.json = Json::parse(result.out);
    return answer;
}

Answer respond_to(const Json& cases) {
    return respond_to_text(Json{{"format", "response-cases-1"}, {"cases", cases}}.dump());
}

TEST(Respond, EveryCaseOfTheDataPasses) {
    TROCAR_DATA_OR_SKIP(file, "response/response_cases.json");
    const test::ProgramResult result = test::run_successfully("respond --json " + file.string());
    const Json json = Json::parse(result.out);
    const Json data = Json::parse(test::read_file(file));
    ASSERT_EQ(json["cases"].size(), data["cases"].size());
    EXPECT_EQ(json["passed"], data["cases"].size());
    for (std::size_t i = 0; i < data["cases"].size(); ++i) {
        const Json& got = json["cases"][i];
        EXPECT_EQ(got["result"], "pass") << got.dump();
        for (const auto& [key, value] : data["cases"][i]["expected"].items()) EXPECT_TRUE(got["got"].contains(key));
        EXPECT_EQ(got["got"].size(), data["cases"][i]["expected"].size());
    }
}

// What no case of RandomCases has: damping and a start off the plane, and an oscillator of many steps.
TEST(Respond, ClosedFormsOfRestAndOfManyStepsAreMet) {
    const double depth = 0.4 * 9.81 / 800.0;
    const Json cases{
        {{"id", "static-x"},
         {"input", {{"m", 0.4}, {"g", 9.81}, {"k_contact", 800.0}, {"plane_z", -0.5}, {"mu", 3.0}, {"z0", -0.48}}},
         {"expected", {{"depth", depth}, {"z", -0.5 - depth}, {"in_contact", true}}},
         {"tolerance", {{"rel", 1e-6}, {"abs", 1e-9}}}},
        {{"id", "osc-x"},
         {"input", {{"m", 1.0}, {"k", 25.0}, {"h", 0.1}, {"x0", 0.3}, {"v0", 0.0}, {"steps", 1000000}}},
         {"expected",
          {{"omega_h", 0.5},
           {"numerical_frequency_ratio", 2.0 * std::asin(0.25) / 0.5},
           {"drift_per_step", 0.0},
           {"energy_ratio_max", 1.0 / (1.0 - 0.25)},
           {"energy_ratio_min", 1.0 / (1.0 + 0.25)}}},
         {"tolerance", {{"rel", 1e-6}, {"abs", 0}}}}};
    const Answer answer = respond_to(cases);
    EXPECT_EQ(answer.status, 0) << answer.err;
    ASSERT_FALSE(answer.json.is_null());
    for (const Json& one : answer.json["cases"]) EXPECT_EQ(one["result"], "pass") << one.dump();
}

TEST(Respond, AStretchedChainWithAFreeEndIsHeldByItsLoad) {
    // Masses 1 to 4 behind a fixed one, springs a ninth longer than at rest: the load that holds the free end leaves
    // the chain its modes along itself, of which 2 sqrt(k/m) sin((2N-1)/(2N+1) pi/2) is the fastest. The integrator is
    // run from there, so that a load the wrong way throws the chain about whatever the step.
    const double omega = 2.0 * std::sqrt(150.0 / 0.003) * std::sin(7.0 / 9.0 * std::numbers::pi / 2.0);
    const Json input{{"N", 4}, {"k", 150.0}, {"m", 0.003}, {"ends", "fixed-free"}, {"rest_length_over_length", 0.9}};
    const Json expected{{"omega_max", omega}, {"dt_crit", 2.0 / omega}};
    const Json tolerance{{"rel", 1e-9}, {"abs", 0}};
    const Answer answer =
        respond_to({{{"id", "stab-z"}, {"input", input}, {"expected", expected}, {"tolerance", tolerance}}});
    EXPECT_EQ(answer.status, 0) << answer.err;
    EXPECT_EQ(answer.json["cases"][0]["result"], "pass") << answer.json.dump();
}

TEST(Respond, WithoutExpectedTheCaseIsComputed) {
    const Json input{{"m1", 1.0}, {"m2", 3.0}, {"V1", {1, 0, 0}}, {"V2", {-1, 0, 0}}};
    const Answer answer = respond_to({{{"id", "3.17-mine"}, {"input", input}}});
    EXPECT_EQ(answer.status, 0);
    EXPECT_EQ(answer.json["cases"][0]["result"], "computed");
    EXPECT_EQ(answer.json["cases"][0]["got"]["V1_after"], Json({-2.0, 0.0, 0.0}));
    EXPECT_EQ(answer.json["computed"], 1);
}

TEST(Respond, OneStepOfAnOscillatorTakesTheNewVelocityForTheNewPlace) {
    // v = -h k x / m = -0.75 and x = 0.3 - 0.075: of 1.125 J, 0.6328125 J and 0.28125 J are left.
    const Json input{{"m", 1.0}, {"k", 25.0}, {"h", 0.1}, {"x0", 0.3}, {"v0", 0.0}, {"steps", 1}};
    const Json got = respond_to({{{"id", "osc-one"}, {"input", input}}}).json["cases"][0]["got"];
    EXPECT_NEAR(got["energy_ratio_min"].get<double>(), 0.8125, 1e-12);
    EXPECT_EQ(got["energy_ratio_max"].get<double>(), 1.0);
}

TEST(Respond, StepSizesThatACaseAsksForAreRunUnlessTheyTakeNoStepOrTooMany) {
    // v = -h k x / m = -0.4 and x = 1 + h v = 0.96, where the closed form has cos(2 h).
    const auto run_of = [](double h, std::int64_t steps) { return Json{{"h", h}, {"steps", steps}}; };
    const Json input{{"m", 1.0}, {"k", 4.0}, {"x0", 1.0}, {"v0", 0.0}, {"times", Json::array({0.1})}};
    const Json expected{
        {"semi_implicit_euler", Json::array({run_of(1e-7, 2'000'001), run_of(0.1, 1), run_of(0.1, 0)})}};
    const Answer answer = respond_to({{{"id", "osc-steps"}, {"input", input}, {"expected", expected}}});
    const Json& runs = answer.json["cases"][0]["got"]["semi_implicit_euler"];
    ASSERT_EQ(runs.size(), 1U) << answer.json.dump();
    EXPECT_EQ(runs[0]["steps"], 1);
    EXPECT_NEAR(runs[0]["x"].get<double>(), 0.96, 1e-12);
    EXPECT_NEAR(runs[0]["v"].get<double>(), -0.4, 1e-12);
    EXPECT_NEAR(runs[0]["abs_error_x"].get<double>(), std::cos(0.2) - 0.96, 1e-12);
}

TEST(Respond, AnOscillatorIsRunToItsLastTimeInTheStepsOfTheCaseElseInFourFinenesses) {
    const auto got = [](const char* id, const Json& more) {
        Json input{{"m", 2.0}, {"k", 8.0}, {"x0", 0.3}, {"v0", -0.5}};
        input.update(more);
        return respond_to({{{"id", id}, {"input", input}}}).json["cases"][0]["got"];
    };
    const Json plain = got("osc-plain", {{"times", Json::array({0.25, 0.5})}});
    const Json& runs = plain.at("semi_implicit_euler");
    ASSERT_EQ(runs.size(), 4U) << plain;
    std::int64_t steps = 512;
    for (const Json& one : runs) {
        EXPECT_EQ(one.at("steps"), steps);
        EXPECT_NEAR(one.at("h").get<double>() * static_cast<double>(steps), 0.5, 1e-15);
        // x = 0.3 cos 2t - 0.25 sin 2t, from which a scheme of first order is off by some h.
        EXPECT_NEAR(one.at("x").get<double>(), 0.3 * std::cos(1.0) - 0.25 * std::sin(1.0),
                    1.0 / static_cast<double>(steps));
        steps *= 2;
    }
    ASSERT_EQ(plain.at("observed_orders").size(), 3U);
    for (const Json& order : plain.at("observed_orders")) EXPECT_NEAR(order.get<double>(), 1.0, 0.05);
    const Json chosen = got("osc-chosen", {{"times", Json::array({0.3})}, {"h", 0.1}});
    ASSERT_EQ(chosen.at("semi_implicit_euler").size(), 1U);
    EXPECT_EQ(chosen.at("semi_implicit_euler").at(0).at("steps"), 3);
    // At its start it is where it starts, and there is nothing to run.
    const Json start = got("osc-start", {{"times", Json::array({0.0})}});
    EXPECT_EQ(start.at("closed_form"), Json::array({Json{{"t", 0.0}, {"x", 0.3}, {"v", -0.5}}}));
    EXPECT_TRUE(start.at("semi_implicit_euler").empty()) << start;
    EXPECT_FALSE(start.contains("observed_orders"));
}

TEST(Respond, FastestModeOfASquareWithOneDiagonalIsThatOfItsSprings) {
    // The products of the springs' directions where they meet: 2 of each with itself, and sqrt(1/2) of the diagonal
    // with each of the four sides, which are perpendicular to each other. Largest eigenvalue: 2 + sqrt(4 / 2).
    const Json input{{"n", 2}, {"spacing", 0.01}, {"k", 5.0}, {"m", 0.002}};
    const Json got = respond_to({{{"id", "stab-square"}, {"input", input}}}).json["cases"][0]["got"];
    EXPECT_EQ(got["edge_count"], 5);
    EXPECT_NEAR(got["omega_max"].get<double>(), std::sqrt((2.0 + std::sqrt(2.0)) * 5.0 / 0.002), 1e-6);
}

TEST(Respond, ResultBeyondADoubleHasAName) {
    // 2e400 about the tip.
    const Json input{{"tip", {0, 0, 0}}, {"points", {{1e200, 1e200, 0}}}, {"forces", {{1e200, -1e200, 0}}}};
    const Json result = respond_to({{{"id", "wrench-mine"}, {"input", input}}}).json["cases"][0];
    EXPECT_TRUE(result["got"]["M_about_tip"][2].is_null());
    EXPECT_EQ(result["message"].get<std::string>().substr(0, 12), "not_finite: ");
}

TEST(Respond, MissedCasesFailAndAdvisoryOnesAreCountedApart) {
    const Json input{{"tip", {0, 0, 0}}, {"points", {{1, 0, 0}}}, {"forces", {{0, 1, 0}}}};
    const Json wrong{{"F", {0, 1, 0}}, {"M_about_tip", {0, 0, 2}}, {"no_such_quantity", 1.0}};
    Answer answer = respond_to({{{"id", "wrench-1"}, {"input", input}, {"expected", wrong}}});
    EXPECT_EQ(answer.status, 1);
    EXPECT_EQ(answer.json["failed"], 1);
    EXPECT_EQ(answer.json["cases"][0]["failed"], Json({"M_about_tip", "no_such_quantity"}));
    EXPECT_TRUE(answer.json["cases"][0]["got"]["no_such_quantity"].is_null());
    answer = respond_to({{{"id", "wrench-1"}, {"status", "advisory"}, {"input", input}, {"expected", wrong}}});
    EXPECT_EQ(answer.status, 0);
    EXPECT_EQ(answer.json["failed"], 0);
    EXPECT_EQ(answer.json["failed_advisory"], 1);
}

TEST(Respond, ToleranceIsTakenOverOneVector) {
    const Json input{{"tip", {0, 0, 0}}, {"points", {{1, 0, 0}}}, {"forces", {{1000.0, 1e-4, 0}}}};
    const Json want{{"F", {1000.0, 0.0, 0.0}}};
    const Json loose{{"rel", 1e-6}, {"abs", 0}};
    const Json tight{{"rel", 1e-8}, {"abs", 0}};
    const Answer answer =
        respond_to({{{"id", "wrench-1"}, {"input", input}, {"expected", want}, {"tolerance", loose}},
                    {{"id", "wrench-2"}, {"input", input}, {"expected", want}, {"tolerance", tight}}});
    EXPECT_EQ(answer.json["cases"][0]["result"], "pass");
    EXPECT_EQ(answer.json["cases"][1]["result"], "fail");
}

TEST(Respond, UnknownFamilyIsUnsupported) {
    const Answer answer = respond_to({{{"id", "9.9-a"}, {"input", Json::object()}, {"expected", {{"x", 1}}}}});
    EXPECT_EQ(answer.status, 0);
    EXPECT_EQ(answer.json["unsupported"], 1);
    EXPECT_EQ(answer.json["cases"][0]["result"], "unsupported");
}

TEST(Respond, BadFilesEndWithStatus2AndNameThePlace) {
    const auto bad = [](const std::string& text, const std::string& place) {
        const Answer answer = respond_to_text(text);
        EXPECT_EQ(answer.status, 2) << text;
        EXPECT_TRUE(answer.json.is_null()) << text;
        EXPECT_NE(answer.err.find(place), std::string::npos) << answer.err;
    };
    const auto one = [](const std::string& member) { return R"({"cases":[{"id":"wrench-1",)" + member + "}]}"; };
    bad("{\"cases\": [", "line 1, column 12");
    bad("[]", "/");
    bad("{}", "/cases");
    bad(R"({"format":"response-cases-9","cases":[]})", "/format");
    bad(R"({"cases":[{"input":{}}]})", "/cases/0/id");
    bad(R"({"cases":[{"id":"wrench-1"}]})", "/cases/0/input");
    bad(one(R"("input":{})"), "/cases/0/input/tip");
    bad(one(R"("input":{"tip":[0,0,0],"points":[[0,0]],"forces":[]})"), "/cases/0/input/points/0");
    bad(one(R"("input":{"tip":[0,0,0],"points":[[0,0,"x"]],"forces":[]})"), "/cases/0/input/points/0/2");
    bad(one(R"("input":{"tip":[0,0,0],"points":[[0,0,0]],"forces":[]})"), "/cases/0/input/forces");
    bad(one(R"("input":{"tip":[0,0,1e999],"points":[],"forces":[]})"), "cases.json");
    bad(one(R"("input":{"tip":[0,0,0],"points":[],"forces":[]},"expected":3)"), "/cases/0/expected");
    bad(one(R"("status":"maybe","input":{"tip":[0,0,0],"points":[],"forces":[]})"), "/cases/0/status");
    bad(one(R"("tolerance":{"rel":-1},"input":{"tip":[0,0,0],"points":[],"forces":[]})"), "/cases/0/tolerance/rel");
    bad(R"({"cases":[{"id":"3.17-a","input":{"m1":-1,"m2":1,"V1":[0,0,0],"V2":[0,0,0]}}]})", "/cases/0/input/m1");
    bad(R"({"cases":[{"id":"stab-a","input":{"N":2.5,"k":1,"m":1}}]})", "/cases/0/input/N");
    bad(R"({"cases":[{"id":"stab-a","input":{"N":2,"k":1,"m":1,"ends":"loose"}}]})", "/cases/0/input/ends");
    const test::ProgramResult missing = test::run_program("respond --json no_such_file.json");
    EXPECT_EQ(missing.status, 2);
    EXPECT_NE(missing.err.find("no_such_file.json"), std::string::npos);
}

// A stiff spring far from its rest length must not throw the mass through its anchor: z = anchor - rest - m g / k.
TEST(Respond, StifflyHungMassRestsBelowItsAnchor) {
    const double m = 0.035;
    const double k = 2000.0;
    const Answer answer = respond_to(Json::array({{{"id", "static-far"},
                                                   {"input",
                                                    {{"m", m},
                                                     {"g", 9.81},
                                                     {"k_contact", 154.7},
                                                     {"k_spring", k},
                                                     {"rest_length", 0.05},
                                                     {"anchor_z", 0.2},
                                                     {"plane_z", 0.0}}}}}));
    ASSERT_EQ(answer.status, 0) << answer.err;
    EXPECT_NEAR(answer.json["cases"][0]["got"]["z"].get<double>(), 0.2 - 0.05 - m * 9.81 / k, 1e-9);
}

// The weight that the spring leaves is the plane's: k_c d + k_s (anchor - rest + d) = m g.
TEST(Respond, AMassOnASoftSpringRestsOnAPlaneHoweverStiffThatIs) {
    for (const double stiffness : {8.0, 8e3, 8e6}) {
        const Json input{{"m", 0.2},         {"g", 9.81},       {"k_contact", stiffness},
                         {"k_spring", 10.0}, {"anchor_z", 0.2}, {"rest_length", 0.15}};
        const Json got = respond_to({{{"id", "static-soft"}, {"input", input}}}).json["cases"][0]["got"];
        const double depth = (0.2 * 9.81 - 10.0 * (0.2 - 0.15)) / (stiffness + 10.0);
        EXPECT_NEAR(got["depth"].get<double>(), depth, 1e-9) << stiffness;
        EXPECT_NEAR(got["contact_force"].get<double>(), stiffness * depth, 1e-6) << stiffness;
        EXPECT_NEAR(got["spring_force_up"].get<double>(), 10.0 * (0.05 + depth), 1e-8) << stiffness;
    }
}

}  // namespace
}  // namespace trocar
