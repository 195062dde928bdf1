// What single adapters promise beyond the contract that all detectors share: that a baseline runs with the setting in
// which it answers best. Held against the exact oracles and closed forms; skipped where the library is absent.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "measure/pair_truth.hpp"
#include "measure/space_time.hpp"
#include "method/registry.hpp"
#include "support/methods.hpp"
#include "support/shapes.hpp"

namespace trocar::test {
namespace {

using Settings = std::map<std::string, std::string>;

bool is_here(const std::string& name) { return is_registered(registry().detectors(), name); }

ContactSet answer(const World& world, const std::string& name, const Settings& settings) {
    const auto detector = make_detector(name, settings);
    detector->prepare(world.topology, world.frame);
    ContactSet contacts;
    contacts.native_wanted = false;
    detector->update(world.frame, 0.0);
    detector->detect(world.frame, contacts);
    return contacts;
}

/// A body's frame before: turned by `angle` and moved by -`by` from where it ends.
void arriving(World& world, std::size_t body, const Vector3& by, double angle) {
    const Range range = world.topology.bodies[body].vertices;
    const Matrix3 back = Eigen::AngleAxisd(-angle, Vector3(0.3, 0.2, 1.0).normalized()).toRotationMatrix();
    for (Index v = range.first; v < range.end(); ++v) {
        world.frame.previous.col(v) = back * world.frame.position.col(v) - by;
    }
}

/// A ball that falls 0.08 m within the tick, its lowest corner from 0.02 m above a flat sheet.
World falling_ball() {
    Shape ball = sphere(0.01, 8).rotate({1.0, 2.0, 0.5}, 0.3);
    double lowest = 0.0;
    for (const Vector3& point : ball.vertices) lowest = std::min(lowest, point.z());
    World world = make_world("falling ball", {{BodyKind::instrument, ball.move({0.003, 0.001, 0.02 - lowest - 0.08})},
                                              {BodyKind::rigid, sheet(0.08, 8)}});
    arriving(world, 0, {0.0, 0.0, -0.08}, 0.0);
    return world;
}

TEST(FclContinuous, CubicTestsReportEveryPairThatBeginsOnDeformingMeshesToo) {
    if (!is_here("fcl_continuous")) GTEST_SKIP() << "FCL is absent";
    World world =
        make_world("ball through a sheet", {{BodyKind::instrument, sphere(0.01, 8).move({0.003, 0.001, -0.04})},
                                            {BodyKind::tissue, sheet(0.08, 8).shake(0.0004, 1)}});
    arriving(world, 0, {0.004, 0.001, -0.09}, 0.2);
    const Range tissue = world.topology.bodies[1].vertices;
    for (Index v = tissue.first; v < tissue.end(); ++v) world.frame.previous.col(v) *= 1.0 + 0.01 * (v % 7);
    SpaceTimeTruth truth(world.topology);
    ASSERT_TRUE(truth.measure(world.frame));
    const std::vector<SweptContact>& expected = truth.beginnings();
    ASSERT_GT(expected.size(), 50U);
    const ContactSet contacts = answer(world, "fcl_continuous", {});
    ASSERT_TRUE(contacts.outcome.ok()) << contacts.outcome.message;
    ASSERT_EQ(contacts.swept.size(), expected.size());
    for (std::size_t k = 0; k < expected.size(); ++k) {
        EXPECT_EQ(contacts.swept[k].a, expected[k].a);
        EXPECT_EQ(contacts.swept[k].b, expected[k].b);
        EXPECT_NEAR(contacts.swept[k].time, expected[k].time, 1e-6);
    }
}

TEST(FclContinuous, ABallMeetsASheetAtTheKnownTime) {
    if (!is_here("fcl_continuous")) GTEST_SKIP() << "FCL is absent";
    const World world = falling_ball();
    // Advancement stops at most 1e-4 of the tick early; ten poses are a ninth of the tick apart and never early.
    for (const auto& [solver, early, late] : {std::tuple<std::string, double, double>{"polynomial", 1e-6, 1e-6},
                                              {"advancement", 1e-4, 1e-6},
                                              {"naive", 0.0, 1.0 / 9.0}}) {
        const ContactSet contacts = answer(world, "fcl_continuous", {{"solver", solver}});
        ASSERT_TRUE(contacts.outcome.ok()) << contacts.outcome.message;
        ASSERT_FALSE(contacts.swept.empty()) << solver;
        double first = 1.0;
        for (const SweptContact& contact : contacts.swept) first = std::min(first, contact.time);
        EXPECT_GE(first, 0.25 - early) << solver;
        EXPECT_LE(first, 0.25 + late) << solver;
    }
}

TEST(FclContinuous, RigidSolversRefuseADeformingBodyAndSayWhich) {
    if (!is_here("fcl_continuous")) GTEST_SKIP() << "FCL is absent";
    World world = falling_ball();
    world.frame.previous(0, world.topology.bodies[1].vertices.first) += 0.001;
    const ContactSet contacts = answer(world, "fcl_continuous", {{"solver", "advancement"}});
    EXPECT_EQ(contacts.outcome.kind, OutcomeKind::unsupported);
    EXPECT_NE(contacts.outcome.message.find(world.topology.bodies[1].name), std::string::npos);
}

/// Meshes of unlike numbers of triangles that meet in many places, nowhere by touching alone.
std::vector<World> worlds_for_ode() {
    return {make_world("fine shaft in a slab",
                       {{BodyKind::instrument,
                         shaft(0.004, 0.12, 12, 40).rotate({0.3, 1.0, 0.1}, 0.7).move({-0.03, 0.002, -0.013})},
                        {BodyKind::tissue, slab(0.1, 0.01, 16).shake(0.0005, 2)}}),
            make_world("two spheres",
                       {{BodyKind::tissue, sphere(0.02, 16)},
                        {BodyKind::rigid, sphere(0.03, 12).rotate({1, 2, 3}, 0.4).move({0.031, 0.007, 0.009})}}),
            make_world("one triangle in a soup",
                       {{BodyKind::instrument, triangle({-0.02, 0.001, 0.0}, {0.02, 0.002, 0.001}, {0.0, 0.0, 0.03})},
                        {BodyKind::tissue, soup(220, 0.006, 0.05, 7)}})};
}

TEST(OdeTrimesh, WithoutMergingNoPairIsLost) {
    if (!is_here("ode_trimesh")) GTEST_SKIP() << "ODE is absent";
    for (const World& world : worlds_for_ode()) {
        std::vector<TrianglePair> expected;
        true_pairs(world.topology, world.frame, expected);
        ASSERT_FALSE(expected.empty()) << world.name;
        EXPECT_EQ(answer(world, "ode_trimesh", {{"merge", "none"}}).pairs, expected) << world.name;
    }
}

TEST(OdeTrimesh, WithMergingEveryPairReportedIsATrueOneAndMostAreReported) {
    if (!is_here("ode_trimesh")) GTEST_SKIP() << "ODE is absent";
    for (const World& world : worlds_for_ode()) {
        std::vector<TrianglePair> expected;
        true_pairs(world.topology, world.frame, expected);
        const std::vector<TrianglePair> reported = answer(world, "ode_trimesh", {}).pairs;
        EXPECT_TRUE(std::includes(expected.begin(), expected.end(), reported.begin(), reported.end())) << world.name;
        EXPECT_GT(2 * reported.size(), expected.size()) << world.name;
    }
}

TEST(SpatialTessellation, ADenseArrayHasTheCellsOfTheScenesBoxAndLargerOnesWhereTheseWereTooMany) {
    // A box of 2.5 x 1.5 x 3.5 m. The search visits every cell of the array and each triangle in each of its box's.
    const auto cells_visited = [](const char* cell, int more_triangles) {
        Shape tissue = triangle({0.5, 0.5, 0.0}, {0.5, 0.5, 3.5}, {0.5, 1.2, 3.5});
        for (int i = 0; i < more_triangles; ++i)
            tissue.add(triangle({0.1, 0.1, 3.1}, {0.2, 0.1, 3.1}, {0.1, 0.2, 3.1}));
        const World world =
            make_world("corner", {{BodyKind::instrument, triangle({0.0, 0.0, 0.0}, {2.5, 0.0, 0.0}, {0.0, 1.5, 0.0})},
                                  {BodyKind::tissue, tissue}});
        const ContactSet contacts = answer(world, "spatial_tessellation", {{"storage", "dense"}, {"cell", cell}});
        EXPECT_EQ(contacts.pairs, (std::vector<TrianglePair>{{0, 1}})) << cell;
        return contacts.work.cells_visited;
    };
    EXPECT_EQ(cells_visited("1", 0), 3 * 2 * 4 + 3 * 2 * 1 + 1 * 2 * 4) << "64 cells are never too many";
    EXPECT_EQ(cells_visited("0.73", 0), 4 * 3 * 5 + 4 * 3 * 1 + 1 * 2 * 5);
    // An edge of 0.69 m makes 4 * 3 * 6 = 72 cells: 8 for each of nine triangles.
    EXPECT_EQ(cells_visited("0.69", 7), 4 * 3 * 6 + 4 * 3 * 1 + 1 * 2 * 6 + 7);
    EXPECT_EQ(cells_visited("0.69", 6), 2 * 2 * 3 + 2 * 2 * 1 + 1 * 1 * 3 + 6) << "twice as long in all directions";
}

TEST(EmbreeCollide, SubnormalCoordinatesAreDecidedExactly) {
    if (!is_here("embree_collide")) GTEST_SKIP() << "Embree is absent";
    World world = make_world(
        "two soups", {{BodyKind::instrument, soup(40, 0.03, 0.05, 3)}, {BodyKind::tissue, soup(40, 0.03, 0.05, 4)}});
    world.frame.position *= 1e-308;
    world.frame.previous = world.frame.position;
    std::vector<TrianglePair> expected;
    true_pairs(world.topology, world.frame, expected);
    ASSERT_FALSE(expected.empty());
    for (const char* leaf : {"triangle", "cluster"}) {
        EXPECT_EQ(answer(world, "embree_collide", {{"leaf", leaf}}).pairs, expected) << leaf;
    }
}

TEST(EmbreeCollide, CoordinatesThatTheLibraryLeavesOutAreUnsupportedNotMissed) {
    if (!is_here("embree_collide")) GTEST_SKIP() << "Embree is absent";
    for (const double scale : {1e17, 1e30, 1e200}) {
        World world = make_world("two spheres",
                                 {{BodyKind::instrument, sphere(1.0, 6)},
                                  {BodyKind::tissue, sphere(1.0, 6).rotate({1, 2, 3}, 0.4).move({0.7, 0.3, 0.2})}});
        world.frame.position *= scale;
        world.frame.previous = world.frame.position;
        std::vector<TrianglePair> expected;
        true_pairs(world.topology, world.frame, expected);
        ASSERT_FALSE(expected.empty());
        const ContactSet contacts = answer(world, "embree_collide", {});
        if (scale < 1e18) {
            EXPECT_EQ(contacts.pairs, expected);
        } else {
            EXPECT_EQ(contacts.outcome.kind, OutcomeKind::unsupported) << scale;
        }
    }
}

}  // namespace
}  // namespace trocar::test
