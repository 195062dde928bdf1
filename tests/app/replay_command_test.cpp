#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "support/commands.hpp"
#include "support/recordings.hpp"
#include "support/text.hpp"

namespace trocar {
namespace {

using Json = nlohmann::json;

/// Apart in frame 0, crossing in frame 1, touching with one corner in frame 2.
test::RecordingText three_frames() { return test::standing_at({1.0, -0.5, 0.0}); }

class Replay : public testing::Test {
protected:
    test::ProgramResult run(const test::RecordingText& text, const std::string& options) {
        return test::run_program("replay " + folder.write("frames.trocrec", text.bytes()).string() + " " + options);
    }
    test::TemporaryFolder folder;
};

/// Heights of two level triangles, a large one and a small one over it, and the length of the small one's legs.
struct LevelTriangles {
    double a, b, leg = 0.1;
};

test::RecordingText level(const std::vector<LevelTriangles>& frames) {
    test::RecordingText text;
    text.header["frames"] = frames.size();
    text.positions.clear();
    for (const auto& [a, b, leg] : frames) {
        text.positions.insert(text.positions.end(), {0, 0, a, 1, 0, a, 0, 1, a});
        text.positions.insert(text.positions.end(), {0.2, 0.2, b, 0.2, 0.2 + leg, b, 0.2 + leg, 0.2, b});
    }
    return text;
}

test::RecordingText falling(const std::array<double, 3>& heights) {
    return level({{0.0, heights[0]}, {0.0, heights[1]}, {0.0, heights[2]}});
}

TEST_F(Replay, PrintsNullForAStepThatNoDoubleHolds) {
    const test::ProgramResult wild = run(falling({1e200, 1e199, -1e200}), "--detector brute_force --json");
    EXPECT_EQ(wild.status, 0) << wild.err;
    const Json document = Json::parse(wild.out);
    EXPECT_TRUE(document.at("long_steps").at("step_m").is_null());
    EXPECT_GT(document.at("long_steps").at("edge_m").get<double>(), 0.0);
}

TEST_F(Replay, SaysWhereAStepIsLongerThanAFeature) {
    const double edge = (2.0 + std::sqrt(2.0)) / 30.0;  // m, mean of the small triangle: 0.1138
    const test::ProgramResult through = run(falling({1.0, 0.9, -0.5}), "--detector brute_force --json --truth");
    EXPECT_EQ(through.status, 0);
    const Json document = Json::parse(through.out);
    EXPECT_EQ(document["truth"], Json({0, 0, 0})) << "no frame has what happened";
    const Json& steps = document["long_steps"];
    EXPECT_EQ(steps["frames"], 1);
    EXPECT_EQ(steps["tick"], 2);
    EXPECT_EQ(steps["body"], "b");
    EXPECT_NEAR(steps["step_m"].get<double>(), 1.4, 1e-12);
    EXPECT_NEAR(steps["edge_m"].get<double>(), edge, 1e-12);
    test::expect_holds(through.err, {"step longer than feature in 1 frames: up to frame 2 b goes 1.4 m, 12.3 times"});
    // Just longer; as far, but away from the other; and through it in a step that is short enough.
    EXPECT_TRUE(Json::parse(run(falling({0.2, 0.06, -0.06}), "--detector ohc --json").out).contains("long_steps"));
    for (const std::array<double, 3>& heights : {std::array{1.0, 0.9, 2.3}, std::array{0.15, 0.05, -0.06}}) {
        const test::ProgramResult beside = run(falling(heights), "--detector brute_force --json");
        EXPECT_EQ(beside.err, "");
        EXPECT_FALSE(Json::parse(beside.out).contains("long_steps")) << heights[2];
    }
}

TEST_F(Replay, OfSeveralLongStepsTheLongestInEdgesIsReportedWhicheverOfTheTwoMoves) {
    // Heights and legs of b: 0.3 m and 0.4 m by edges of 0.114 m; away from a and five times smaller; 0.3 m, which is
    // 13.2 of its edges now, and 0.25 m.
    constexpr std::array<std::array<double, 2>, 6> frames{
        {{0.2, 0.1}, {-0.1, 0.1}, {0.3, 0.1}, {0.25, 0.02}, {-0.05, 0.02}, {0.2, 0.02}}};
    for (const bool large_one_moves : {false, true}) {
        std::vector<LevelTriangles> moved;
        for (const auto& [height, leg] : frames) {
            moved.push_back(large_one_moves ? LevelTriangles{-height, 0.0, leg} : LevelTriangles{0.0, height, leg});
        }
        const Json reported = Json::parse(run(level(moved), "--detector brute_force --json").out);
        ASSERT_TRUE(reported.contains("long_steps")) << reported;
        const Json& steps = reported.at("long_steps");
        EXPECT_EQ(steps.at("frames"), 4);
        EXPECT_EQ(steps.at("tick"), 4);
        EXPECT_EQ(steps.at("body").get<std::string>(), large_one_moves ? "a" : "b");
        EXPECT_NEAR(steps.at("step_m").get<double>(), 0.3, 1e-12);
        EXPECT_NEAR(steps.at("edge_m").get<double>(), 0.02 * (2.0 + std::sqrt(2.0)) / 3.0, 1e-12);
    }
}

TEST_F(Replay, AStepIsThePathOfOneBodyAgainstTheOther) {
    // Heights of the large triangle a and of the small one b, whose mean edge is 0.114 m.
    const auto reported = [this](const std::vector<LevelTriangles>& frames) {
        return Json::parse(run(level(frames), "--detector brute_force --json").out);
    };
    const Json together = reported({{0.0, 0.05}, {1.0, 1.05}, {2.0, 2.05}});
    EXPECT_FALSE(together.contains("long_steps")) << together;
    // 0.08 m down and 0.09 m up, each shorter than an edge; then nobody moves.
    const Json against = reported({{0.0, 0.1}, {0.09, 0.02}, {0.09, 0.02}});
    ASSERT_TRUE(against.contains("long_steps")) << against;
    const Json& steps = against.at("long_steps");
    EXPECT_EQ(steps.at("frames"), 1);
    EXPECT_EQ(steps.at("tick"), 1);
    EXPECT_EQ(steps.at("body"), "a") << "it goes further";
    EXPECT_NEAR(steps.at("step_m").get<double>(), 0.17, 1e-12);
}

TEST_F(Replay, GivesPairsTouchesAndTruthPerFrame) {
    const test::ProgramResult result = run(three_frames(), "--detector brute_force --truth --json");
    ASSERT_EQ(result.status, 0) << result.err;
    const Json document = Json::parse(result.out);
    EXPECT_EQ(document["truth"], Json({0, 1, 1}));
    EXPECT_EQ(document["hash"].get<std::string>().size(), 16U);
    ASSERT_EQ(document["detectors"].size(), 1U);
    const Json& detector = document["detectors"][0];
    EXPECT_EQ(detector["name"], "brute_force");
    EXPECT_EQ(detector["outcome"], "ok");
    ASSERT_EQ(detector["frames"].size(), 3U);
    const std::vector<Json> pairs{Json::array(), Json::array({{0, 1}}), Json::array({{0, 1}})};
    const std::vector<Json> touch{Json::array(), Json::array(), Json::array({0})};
    for (std::size_t tick = 0; tick < 3; ++tick) {
        const Json& frame = detector["frames"][tick];
        EXPECT_EQ(frame["tick"], tick);
        EXPECT_EQ(frame["outcome"], "ok");
        EXPECT_EQ(frame["truncated"], false);
        EXPECT_EQ(frame["pairs"], pairs[tick]);
        EXPECT_EQ(frame["touch"], touch[tick]);
        EXPECT_EQ(frame["false_negatives"], 0);
        EXPECT_EQ(frame["false_positives"], 0);
        EXPECT_GE(frame["update_ns"], 0);
        EXPECT_GE(frame["detect_ns"], 0);
    }
}

TEST_F(Replay, ContactsThatTheRecordingCarriesAreARowOfTheirOwn) {
    test::RecordingText text = three_frames();
    text.header["format"] = "trocar-recording-2";
    const std::string pair = R"({"bodies":["a","b"],"triangles":[0,1]})";
    const std::string head =
        "{\"format\":\"trocar-contacts-1\",\"ticks\":2}\n{\"tick\":0,\"contacts\":[" + pair + "]}\n";
    text.tail = head + "{\"tick\":1,\"contacts\":[" + pair + "," + pair + "]}\n";
    const test::ProgramResult result = run(text, "--detector recorded --truth --json");
    EXPECT_EQ(result.status, 0) << "it promises nothing";
    const Json document = Json::parse(result.out);
    ASSERT_EQ(document["detectors"].size(), 1U);
    const Json& row = document["detectors"][0];
    EXPECT_EQ(row["name"], "recorded");
    EXPECT_EQ(row["frames"][0]["false_positives"], 1) << "they are apart in frame 0";
    EXPECT_EQ(row["frames"][1]["pairs"], Json::array({{0, 1}}));
    EXPECT_EQ(row["frames"][1]["false_negatives"], 0);
    EXPECT_TRUE(row["frames"][1]["update_ns"].is_null());
    EXPECT_EQ(row["frames"][2]["outcome"], "unsupported") << "the detector gets no contacts";
    const Json all = Json::parse(run(text, "--detector all --json").out)["detectors"];
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [](const Json& one) { return one["name"] == "recorded"; }));
    EXPECT_EQ(Json::parse(run(text, "--detector ohc --json").out)["detectors"].size(), 1U);
    text.tail = head + "{\"tick\":9,\"contacts\":[]}\n";
    EXPECT_EQ(run(text, "--detector ohc").status, 2) << "there is no frame 9";
    EXPECT_EQ(run(three_frames(), "--detector recorded").status, 2) << "it carries none";
}

TEST_F(Replay, AFrameThatIsNotFiniteCostsThatTickOnly) {
    test::RecordingText text = three_frames();
    text.positions[18 + 9] = std::numeric_limits<double>::quiet_NaN();  // frame 1, vertex 3
    const test::ProgramResult result = run(text, "--detector brute_force --truth --json");
    EXPECT_EQ(result.status, 3) << result.err;
    const Json frames = Json::parse(result.out)["detectors"][0]["frames"];
    EXPECT_EQ(frames[0]["outcome"], "ok");
    EXPECT_EQ(frames[1]["outcome"], "not_finite");
    EXPECT_EQ(frames[2]["outcome"], "ok");
    EXPECT_EQ(frames[2]["pairs"], Json::array({{0, 1}}));
    const Json truth = Json::parse(result.out)["truth"];
    EXPECT_TRUE(truth[1].is_null()) << "no truth is known about a frame that is not finite: " << truth;
    EXPECT_EQ(truth[2], 1);
}

TEST_F(Replay, TriangleNumbersAreThoseOfTheFileAndTheFirstIsFromTheBodyListedFirst) {
    test::RecordingText text = three_frames();
    std::swap(text.header["bodies"][0], text.header["bodies"][1]);
    const Json document = Json::parse(run(text, "--detector brute_force --json").out);
    const Json& frame = document["detectors"][0]["frames"][1];
    EXPECT_EQ(frame["pairs"], Json::array({{1, 0}}));
    const bool compared = !frame["false_negatives"].is_null() || !frame["false_positives"].is_null();
    EXPECT_TRUE(document["truth"].is_null() && !compared) << "nobody asked for truth";
}

TEST_F(Replay, ReportsWhatBeginsBetweenFramesWhereADetectorDoes) {
    // The corner falls from 1 to -0.5 between frames 0 and 1, through the face after two thirds of the way.
    const Json frames =
        Json::parse(run(three_frames(), "--detector ohc:swept=on --json").out)["detectors"][0]["frames"];
    EXPECT_FALSE(frames[0].contains("swept"));
    ASSERT_EQ(frames[1]["swept"].size(), 1U);
    EXPECT_EQ(frames[1]["swept"][0]["pair"], Json({0, 1}));
    EXPECT_EQ(frames[1]["swept"][0]["bodies"], Json({0, 1}));
    EXPECT_NEAR(frames[1]["swept"][0]["time"].get<double>(), 2.0 / 3.0, 1e-12);
    EXPECT_EQ(frames[1]["swept"][0]["kind"], "vertex_face");
    EXPECT_FALSE(frames[2].contains("swept"));
}

TEST_F(Replay, BadInputEndsWithStatusTwo) {
    test::RecordingText text = three_frames();
    text.tail = "x";
    const test::ProgramResult result = run(text, "--json");
    EXPECT_EQ(result.status, 2);
    EXPECT_TRUE(result.out.empty());
    EXPECT_EQ(run(three_frames(), "--detector no_such_method").status, 2);
    EXPECT_EQ(run(three_frames(), "--detector brute_force:no_such_key=1").status, 2);
    EXPECT_EQ(test::run_program("replay no_such_file").status, 2);
}

}  // namespace
}  // namespace trocar
