// Bodies driven through each other by scripts alone, so that every answer follows from the script: no response, no
// detector.
#include "measure/passage.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "support/scene_samples.hpp"

namespace trocar {
namespace {

/// Passages over the whole script of a scene whose bodies follow their keys, a frame per tick; -1: nothing to ask.
std::int64_t passages_of(const Scene& scene) {
    PassageTruth truth(scene, scene.first);
    Frame frame = scene.first;
    std::int64_t sum = -1;
    for (std::int64_t tick = 1; tick <= scene.ticks; ++tick) {
        for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
            if (!scene.bodies[b].motion) continue;
            frame.pose[b] = scene.bodies[b].motion->pose_at(static_cast<double>(tick) * scene.dt);
            place_body(scene.bodies[b], scene.topology.bodies[b].vertices, frame.pose[b], frame.position);
        }
        const std::int64_t now = truth.follow(frame);
        if (now >= 0) sum = std::max<std::int64_t>(sum, 0) + now;
    }
    return sum;
}

struct Key {
    double time;  // s
    double x;     // m
    double z;     // m, lowest point of the tool above the other body's upper side
};

/// A body that rests, and an instrument of this shape that follows the keys; its lowest point is `z0` below its origin.
Scene driven(const std::string& resting, const std::string& shape, const std::vector<Key>& keys, double z0 = 0.0) {
    const auto ticks = static_cast<int>(std::lround(keys.back().time * 1000.0)) + 5;
    std::string text;
    for (const Key& key : keys) {
        text += fmt::format("{}{{\"time\":{},\"pose\":[{},0.0013,{},0,0,0]}}", text.empty() ? "" : ",", key.time, key.x,
                            key.z + z0);
    }
    return test::scene_from_text(fmt::format(
        R"({{"format":"trocar-scene-2","name":"driven","unit":"m","dt":0.001,"ticks":{},"seed":1,"bodies":[
      {},
      {{"name":"tool","kind":"instrument","closed":true,"parts":[{}],
        "motion":{{"drive":"prescribed","keys":[{}]}}}}]}})",
        ticks, resting, shape, text));
}

/// A shaft of 5 mm over a plate of 60 x 60 x 6 mm whose upper side is z = 0.
Scene shaft_and_plate(const std::vector<Key>& keys, const std::string& tip = "round", double edge = 0.02) {
    return driven(fmt::format(R"({{"name":"plate","kind":"rigid","closed":true,"pose":[0,0,-0.003,0,0,0],
                                  "parts":[{{"shape":"box","size":[0.06,0.06,0.006],"edge":{}}}]}})",
                              edge),
                  fmt::format(R"({{"shape":"shaft","radius":0.0025,"length":0.08,"edge":0.002,"tip":"{}"}})", tip),
                  keys);
}

TEST(PassageTruth, AShaftDrivenThroughAPlateCountsOnceAndStandsThere) {
    EXPECT_EQ(passages_of(shaft_and_plate({{0, 0, 0.003}, {0.2, 0, -0.012}, {0.3, 0, -0.012}})), 1);
    // Coarser and finer faces, a path through their very vertices, a slanted one.
    EXPECT_EQ(passages_of(shaft_and_plate({{0, 0, 0.003}, {0.2, 0, -0.012}}, "flat", 0.003)), 1);
    EXPECT_EQ(passages_of(shaft_and_plate({{0, -0.01, 0.003}, {0.2, 0.012, -0.012}})), 1);
}

TEST(PassageTruth, AShaftThatJumpsThroughAPlateInOneTickCounts) {
    EXPECT_EQ(passages_of(shaft_and_plate({{0, 0, 0.003}, {0.001, 0, -0.2}})), 1);
}

TEST(PassageTruth, ThroughAndBackIsOneAndAnotherOnlyAfterItHasBeenOut) {
    EXPECT_EQ(passages_of(shaft_and_plate({{0, 0, 0.003}, {0.1, 0, -0.012}, {0.2, 0, 0.003}, {0.3, 0, -0.012}})), 2);
    // Back and forth in the plate is one.
    EXPECT_EQ(passages_of(shaft_and_plate({{0, 0, 0.003}, {0.1, 0, -0.012}, {0.2, 0, -0.001}, {0.3, 0, -0.012}})), 1);
}

TEST(PassageTruth, PressingAndWithdrawingDoesNotCount) {
    for (const char* tip : {"round", "flat"}) {
        for (const double depth : {0.0, 0.0001, 0.001, 0.003, 0.0059}) {
            EXPECT_EQ(
                passages_of(shaft_and_plate({{0, 0, 0.003}, {0.1, 0, -depth}, {0.2, 0, -depth}, {0.3, 0, 0.003}}, tip)),
                0)
                << tip << " " << depth;
        }
    }
}

TEST(PassageTruth, SlidingAlongDoesNotCount) {
    for (const char* tip : {"round", "flat"}) {
        for (const double depth : {0.0, 0.0001, 0.001}) {
            EXPECT_EQ(passages_of(shaft_and_plate(
                          {{0, -0.01, 0.003}, {0.1, -0.01, -depth}, {0.3, 0.01, -depth}, {0.4, 0.01, 0.003}}, tip)),
                      0)
                << tip << " " << depth;
        }
    }
}

/// Two shafts of 8 mm across each other; key z: gap between them.
Scene two_shafts(const std::vector<Key>& keys, double edge) {
    const auto shaft = [edge](const char* pose) {
        return fmt::format(R"({{"shape":"shaft","radius":0.004,"length":0.1,"edge":{},"pose":[{}]}})", edge, pose);
    };
    return driven(
        fmt::format(R"({{"name":"lower","kind":"instrument","closed":true,"parts":[{}]}})", shaft("-0.05,0,0,0,90,0")),
        shaft("0,-0.05,0,-90,0,0"), keys, 0.008);
}

TEST(PassageTruth, TwoShaftsThatChangeSidesCountHoweverLongTheirEdges) {
    for (const double edge : {0.003, 0.02}) {
        EXPECT_EQ(passages_of(two_shafts({{0, 0, 0.002}, {0.2, 0.003, -0.018}}, edge)), 1) << edge;
        EXPECT_EQ(passages_of(two_shafts({{0, 0, 0.002}, {0.1, 0, -0.003}, {0.2, 0, 0.002}}, edge)), 0) << edge;
        EXPECT_EQ(
            passages_of(two_shafts({{0, 0, 0.002}, {0.1, 0, -0.0005}, {0.2, 0.03, -0.0005}, {0.3, 0.03, 0.002}}, edge)),
            0)
            << edge;
    }
}

TEST(PassageTruth, TheRimOfASheetThroughABarCountsBetweenTwoOfItsVertices) {
    // The sheet stands on edge with one rim or the other at z = 0, the rim's vertices at 10 and 30 mm to both sides; a
    // flat bar of 6 x 2 mm comes down over the middle of the rim, 4 mm deep at last, and meets nothing else of it.
    for (const int turn : {90, -90}) {
        const std::string sheet =
            fmt::format(R"({{"name":"sheet","kind":"rigid","closed":false,"pose":[0,0,-0.015,{},0,0],
                            "parts":[{{"shape":"sheet","size":[0.06,0.03],"edge":0.02}}]}})",
                        turn);
        const std::string bar = R"({"shape":"box","size":[0.006,0.06,0.002],"edge":0.02})";
        EXPECT_EQ(passages_of(driven(sheet, bar, {{0, 0, 0.003}, {0.1, 0, -0.004}}, 0.001)), 1) << turn;
    }
}

TEST(PassageTruth, AStripOfLongEdgesThroughASmallSheetCountsWhereverTheSheetHasItsOrigin) {
    // The strip of 2 mm passes between the vertices of the sheet, whose edges of 5 mm say how close samples of the
    // strip's edges of 60 mm have to be.
    for (const double away : {0.0, 0.9}) {
        const Scene scene = test::scene_from_text(fmt::format(
            R"({{"format":"trocar-scene-2","name":"strip","unit":"m","dt":0.001,"ticks":205,"seed":1,"bodies":[
          {{"name":"sheet","kind":"rigid","closed":false,"pose":[{0},0,0,0,0,0],
            "parts":[{{"shape":"sheet","size":[0.02,0.02],"edge":0.005,"pose":[-{0},0,0,0,0,0]}}]}},
          {{"name":"tool","kind":"instrument","closed":false,
            "parts":[{{"shape":"sheet","size":[0.06,0.002],"edge":0.06}}],
            "motion":{{"drive":"prescribed","keys":[{{"time":0,"pose":[0.0003,0.0026,0.003,0,0,0]}},
                                                {{"time":0.2,"pose":[0.0003,0.0026,-0.003,0,0,0]}}]}}}}]}})",
            away));
        EXPECT_EQ(passages_of(scene), 1) << away;
    }
}

TEST(PassageTruth, AJawThatClosesThroughANeedleAndOpensAgainCountsTwice) {
    // The jaws turn about the x axis, and close onto half cylinders of 2 mm along z. A needle of 0.4 mm along x is
    // between them when they are open, 2.3 mm beside their axis, and outside when they are closed.
    const auto scene = [](double y, double closed, double time) {
        const auto key = [](double at, double jaw) {
            return fmt::format(R"({{"time":{},"pose":[0,0,0,0,0,0],"jaw":{}}})", at, jaw);
        };
        const std::string keys =
            key(0, 1) + "," + key(time, closed) + "," + key(time + 0.1, closed) + "," + key(2.0 * time + 0.1, 1);
        return test::scene_from_text(fmt::format(
            R"({{"format":"trocar-scene-2","name":"jaws","unit":"m","dt":0.001,"ticks":{},"seed":1,"bodies":[
          {{"name":"needle","kind":"rigid","closed":true,"pose":[0.0003,{},0.0104,0,0,0],
            "parts":[{{"shape":"box","size":[0.02,0.0004,0.0004],"edge":0.002}}]}},
          {{"name":"tool","kind":"instrument","closed":true,"hinge":{{"point":[0,0,0],"axis":[1,0,0],"angle":36}},
            "parts":[{{"shape":"jaw","radius":0.002,"length":0.014,"edge":0.002,"jaw":"right"}},
                     {{"shape":"jaw","radius":0.002,"length":0.014,"edge":0.002,"pose":[0,0,0,0,0,180],"jaw":"left"}}],
            "motion":{{"drive":"prescribed","keys":[{}]}}}}]}})",
            std::lround(1000.0 * (2.0 * time + 0.1)) + 5, y, keys));
    };
    for (const double side : {-1.0, 1.0}) {
        for (const double time : {0.001, 0.15}) {
            EXPECT_EQ(passages_of(scene(side * 0.0023, 0.0, time)), 2) << side << " " << time;
            EXPECT_EQ(passages_of(scene(side * 0.0023, 0.95, time)), 0) << "hardly moved";
            EXPECT_EQ(passages_of(scene(side * 0.03, 0.0, time)), 0) << "far away";
        }
    }
}

TEST(PassageTruth, AnOpenSheetIsPassedOnlyWhenTheToolIsWhollyBehindIt) {
    const auto scene = [](double lowest) {
        return driven(R"({"name":"sheet","kind":"rigid","closed":false,
                          "parts":[{"shape":"sheet","size":[0.06,0.06],"edge":0.01}]})",
                      R"({"shape":"sphere","radius":0.004,"edge":0.002})",
                      {{0, 0, 0.006}, {0.1, 0, lowest}, {0.2, 0, lowest < -0.004 ? lowest : 0.006}});
    };
    EXPECT_EQ(passages_of(scene(-0.003)), 0);
    EXPECT_EQ(passages_of(scene(-0.006)), 1);
}

TEST(PassageTruth, WhereABodyHasItsOriginMakesNoDifference) {
    // shaft_and_plate with a flat tip, both bodies' shapes away from their bodies' own origins: through the plate, and
    // along it 1 mm deep, where the plate's edges pass from the shaft's front to its back.
    const auto scene = [](std::vector<Key> keys) {
        for (Key& key : keys) key.x -= 0.05;
        return driven(
            R"({"name":"plate","kind":"rigid","closed":true,"pose":[-0.03,0.02,-0.073,0,0,0],
                "parts":[{"shape":"box","size":[0.06,0.06,0.006],"edge":0.02,"pose":[0.03,-0.02,0.07,0,0,0]}]})",
            R"({"shape":"shaft","radius":0.0025,"length":0.08,"edge":0.002,"tip":"flat","pose":[0.05,0,0.04,0,0,0]})",
            keys, -0.04);
    };
    EXPECT_EQ(passages_of(scene({{0, 0, 0.003}, {0.2, 0, -0.012}})), 1);
    EXPECT_EQ(passages_of(scene({{0, -0.01, 0.003}, {0.1, -0.01, -0.001}, {0.3, 0.01, -0.001}, {0.4, 0.01, 0.003}})),
              0);
}

TEST(PassageTruth, ABodyIsAsDeepAsOneOfItsWallsIsThick) {
    // A slanted path through a plate, far from the plate's edges, is 10.7 mm long and nowhere more than 3 mm deep. That
    // makes a passage because the plate is no deeper anywhere; a second plate far below, of the same body, changes
    // nothing.
    const std::string second = R"(,{"shape":"box","size":[0.06,0.06,0.006],"edge":0.06,"pose":[0,0,-0.1,0,0,0]})";
    for (const std::string& more : {std::string(), second}) {
        const std::string plates =
            fmt::format(R"({{"name":"plates","kind":"rigid","closed":true,"pose":[0,0.0213,-0.003,0,0,0],
                            "parts":[{{"shape":"box","size":[0.06,0.06,0.006],"edge":0.06}}{}]}})",
                        more);
        const std::string shaft = R"({"shape":"shaft","radius":0.0025,"length":0.08,"edge":0.002})";
        EXPECT_EQ(passages_of(driven(plates, shaft, {{0, 0, 0.003}, {0.2, 0.022, -0.012}})), 1) << more;
    }
}

TEST(PassageTruth, EveryPassOfTheSpeedSweepThroughTheSlabCounts) {
    const Scene scene =
        read_scene(std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes/i2r_speed_sweep.json", std::nullopt);
    std::int64_t driven = 0;
    for (const SceneBody& body : scene.bodies) {
        if (!body.motion) continue;
        for (std::size_t k = 1; k < body.motion->keys.size(); ++k) {
            driven += body.motion->keys[k].translation.z() * body.motion->keys[k - 1].translation.z() < 0.0 ? 1 : 0;
        }
    }
    ASSERT_EQ(driven, 92);
    EXPECT_EQ(passages_of(scene), driven);
}

TEST(PassageTruth, TissueHasNone) { EXPECT_EQ(passages_of(test::scene_from_text(test::poke_text())), -1); }

}  // namespace
}  // namespace trocar
