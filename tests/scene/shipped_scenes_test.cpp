// Every shipped scene, moved along its script with tissue at rest: does what its table row promises happen? Pairs come
// from brute force over all box-overlapping triangles with the rational oracle, not from any detector.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "contact/derive.hpp"
#include "measure/pair_truth.hpp"
#include "scene/scene.hpp"
#include "support/shipped_scenes.hpp"

namespace trocar {
namespace {

using test::data_folder;
using test::scene_folder;

/// The scripted frame at a time: instruments at their script, everything else at rest.
Frame scripted(const Scene& scene, double time) {
    Frame frame = scene.first;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        if (!scene.bodies[b].motion) continue;
        const Pose pose = scene.bodies[b].motion->pose_at(time);
        place_body(scene.bodies[b], scene.topology.bodies[b].vertices, pose, frame.position);
    }
    return frame;
}

std::vector<TrianglePair> pairs_at(const Scene& scene, double time) {
    std::vector<TrianglePair> pairs;
    true_pairs(scene.topology, scripted(scene, time), pairs);
    return pairs;
}

double end_of(const Scene& scene) { return scene.dt * static_cast<double>(scene.ticks); }

/// Scenes whose tool begins in the tissue, and those whose tool is left standing in it.
const std::set<std::string> begin_deep{"i2t_deep_start", "i2t_deep_sheet"};
/// Their passes may be shorter than a tick: tests/simulate/between_ticks_test.cpp holds each against the script.
const std::set<std::string> speed_sweeps{"i2r_speed_sweep", "i2t_speed_sweep"};
const std::set<std::string> end_pressed{"i2t_stab_drag", "indent_1x", "indent_4x", "indent_16x"};

class ShippedScene : public testing::TestWithParam<std::string> {};

TEST_P(ShippedScene, StartsFreeTouchesAsItsScriptSaysAndEndsFree) {
    const std::filesystem::path file = scene_folder / (GetParam() + ".json");
    if (lacks_data(file, data_folder())) GTEST_SKIP() << "no data: meshes of " << GetParam();
    const Scene scene = read_scene(file, data_folder());
    EXPECT_EQ(scene.name, GetParam());
    EXPECT_EQ(scene.dt, 0.001);
    EXPECT_GE(scene.ticks, 300);
    EXPECT_LE(scene.ticks, 2000);
    EXPECT_EQ(pairs_at(scene, 0.0).empty(), !begin_deep.contains(GetParam()));
    EXPECT_EQ(pairs_at(scene, end_of(scene)).empty(), !end_pressed.contains(GetParam()));
    int touched = 0;
    constexpr int samples = 40;
    for (int i = 0; i <= samples; ++i) touched += pairs_at(scene, end_of(scene) * i / samples).empty() ? 0 : 1;
    if (GetParam() == "hover") {
        EXPECT_EQ(touched, 0);
    } else if (!speed_sweeps.contains(GetParam())) {
        EXPECT_GE(touched, 4) << "of " << samples << " samples";
    }
}

TEST_P(ShippedScene, DefaultTissueHasAtMostTwoThousandTrianglesUnlessItIsRealDataOrRefined) {
    const std::filesystem::path file = scene_folder / (GetParam() + ".json");
    if (lacks_data(file, std::nullopt)) GTEST_SKIP() << "real meshes have the size they have";
    const Scene scene = read_scene(file, std::nullopt);
    Index tissue = 0;
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind == BodyKind::tissue) tissue += body.triangles.count;
    }
    EXPECT_LE(tissue, GetParam() == "indent_16x" ? 8000 : 2000);
    EXPECT_EQ(scene.has_tissue(), tissue > 0);
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        if (!scene.bodies[b].motion || tissue > 0 || speed_sweeps.contains(GetParam())) continue;
        EXPECT_EQ(scene.bodies[b].motion->drive, Drive::simulated_operator) << "scenes without tissue need an operator";
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, ShippedScene, testing::ValuesIn(test::scene_names()),
                         [](const auto& tested) { return tested.param; });

TEST(ShippedScenes, PokeDepthIsTheDocumentedOne) {
    const Scene scene = read_scene(scene_folder / "i2t_poke.json", std::nullopt);
    const Range tool = scene.topology.bodies[0].vertices;
    const auto depth = [&](double time) {
        return -scripted(scene, time).position.row(2).segment(tool.first, tool.count).minCoeff();
    };
    // 28 mm/s down from 10 mm: touch at 10/28 s.
    EXPECT_NEAR(depth(10.0 / 28.0), 0.0, 1e-12);
    EXPECT_TRUE(pairs_at(scene, 0.357).empty());
    EXPECT_FALSE(pairs_at(scene, 0.358).empty());
    EXPECT_NEAR(depth(0.45), 0.0026, 1e-12);
    EXPECT_NEAR(depth(0.65), 0.004, 1e-12);
    EXPECT_FALSE(pairs_at(scene, 0.892).empty());
    EXPECT_TRUE(pairs_at(scene, 0.893).empty());
}

TEST(ShippedScenes, DeepStartsBeginFiveMillimetresDeep) {
    // The flat sheet is z = 0; the organ's surface is crossed by the vertical line through the tip.
    const Scene sheet = read_scene(scene_folder / "i2t_deep_sheet.json", std::nullopt);
    const Range tool = sheet.topology.bodies[0].vertices;
    EXPECT_NEAR(sheet.first.position.row(2).segment(tool.first, tool.count).minCoeff(), -0.005, 1e-12);
    const Scene organ = read_scene(scene_folder / "i2t_deep_start.json", std::nullopt);
    const Range shaft = organ.topology.bodies[0].vertices;
    Eigen::Index lowest = -1;
    organ.first.position.row(2).segment(shaft.first, shaft.count).minCoeff(&lowest);
    const Vector3 tip = organ.first.position.col(shaft.first + static_cast<Index>(lowest));
    double above = std::nan("");
    const Range triangles = organ.topology.bodies[1].triangles;
    for (Index t = triangles.first; t < triangles.end(); ++t) {
        Matrix3 edges;
        const Vector3 a = organ.first.position.col(organ.topology.triangles(0, t));
        edges.col(0) = organ.first.position.col(organ.topology.triangles(1, t)) - a;
        edges.col(1) = organ.first.position.col(organ.topology.triangles(2, t)) - a;
        edges.col(2) = -Vector3::UnitZ();
        const Vector3 hit = edges.inverse() * (tip - a);  // tip + hit[2] z = a + hit[0] e0 + hit[1] e1
        if (hit[0] < 0.0 || hit[1] < 0.0 || hit[0] + hit[1] > 1.0 || hit[2] < 0.0) continue;
        EXPECT_TRUE(std::isnan(above)) << "the organ has one surface above the tip";
        above = hit[2];
    }
    EXPECT_NEAR(above, 0.005, 0.0005);
}

TEST(ShippedScenes, IndentedSheetsDifferInTheirMeshAlone) {
    Index before = 0;
    for (const char* name : {"indent_1x", "indent_4x", "indent_16x"}) {
        const Scene scene = read_scene(scene_folder / (std::string(name) + ".json"), std::nullopt);
        const Index count = scene.topology.bodies[1].triangles.count;
        if (before > 0) {
            EXPECT_NEAR(static_cast<double>(count) / before, 4.0, 0.3) << name;
        }
        before = count;
        const Range ball = scene.topology.bodies[0].vertices;
        EXPECT_NEAR(scripted(scene, 0.3).position.row(2).segment(ball.first, ball.count).minCoeff(), -0.004, 2e-4);
    }
}

TEST(ShippedScenes, LayingShaftMeetsTheFoldEdgeAgainstEdgeOnly) {
    const Scene scene = read_scene(scene_folder / "i2t_lay.json", std::nullopt);
    int seen = 0;
    for (double time = 0.005; time < 0.8; time += 0.01) {  // not the very instants of touch
        const Frame frame = scripted(scene, time);
        ContactSet contacts;
        true_pairs(scene.topology, frame, contacts.pairs);
        derive(scene.topology, frame, contacts);
        for (const Contact& contact : contacts.contacts) {
            EXPECT_EQ(contact.kind, ContactCase::edges_cross)
                << "at " << time << " pair " << contact.a << "," << contact.b;
            ++seen;
        }
    }
    EXPECT_GT(seen, 50);
}

std::set<std::size_t> jaws_that_meet(const Scene& scene, double time) {
    std::set<std::size_t> jaws;
    for (const TrianglePair& pair : pairs_at(scene, time)) {
        const Index vertex = scene.topology.triangles(0, pair.a);
        for (std::size_t j = 0; j < scene.bodies[0].jaws.size(); ++j) {
            if (scene.bodies[0].jaws[j].vertices.contains(vertex)) jaws.insert(j);
        }
    }
    return jaws;
}

TEST(ShippedScenes, BothJawsOfTheGrasperPressTheFold) {
    EXPECT_EQ(jaws_that_meet(read_scene(scene_folder / "i2t_grasp.json", std::nullopt), 0.6).size(), 2U);
}

TEST(ShippedScenes, JawsOfTheMarylandPressTheLiver) {
    const std::filesystem::path file = scene_folder / "liver_maryland.json";
    if (lacks_data(file, data_folder())) GTEST_SKIP() << "no data: meshes of liver_maryland";
    const Scene scene = read_scene(file, data_folder());
    std::set<std::size_t> jaws;
    for (double time = 0.0; time < end_of(scene); time += 0.1) jaws.merge(jaws_that_meet(scene, time));
    EXPECT_EQ(jaws.size(), 2U);
}

}  // namespace
}  // namespace trocar
