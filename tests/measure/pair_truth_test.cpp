#include "measure/pair_truth.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "geometry/exact.hpp"
#include "geometry/triangle_distance.hpp"
#include "support/meshes.hpp"
#include "support/shapes.hpp"
#include "support/world_triangles.hpp"

namespace trocar {
namespace {

/// Three bodies of triangles with corners on a small lattice: many touches, coplanar and degenerate pairs.
struct LatticeScene {
    explicit LatticeScene(std::uint64_t seed) {
        std::mt19937_64 random(seed);
        std::uniform_int_distribution<int> coordinate(0, 3);
        std::vector<Body> bodies(3);
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            bodies[b].name = std::to_string(b);
            bodies[b].kind = BodyKind::tissue;
            bodies[b].vertex_count = 20;
            bodies[b].triangles.resize(3, 25);
            std::uniform_int_distribution<Index> vertex(0, 19);
            for (Eigen::Index i = 0; i < bodies[b].triangles.size(); ++i) bodies[b].triangles(i) = vertex(random);
        }
        topology = make_topology(bodies);
        frame.position.resize(3, topology.vertex_count);
        for (Eigen::Index i = 0; i < frame.position.size(); ++i) frame.position(i) = coordinate(random) * 0.1;
    }
    [[nodiscard]] Corners corners(Index t) const { return corners_of(topology.triangles, frame.position, t); }
    Topology topology;
    Frame frame;
};

TEST(TruePairs, AreAllPairsOfDifferentBodiesThatMeet) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
        const LatticeScene scene(seed);
        std::vector<TrianglePair> expected;
        for (Index a = 0; a < scene.topology.triangle_count(); ++a) {
            for (Index b = a + 1; b < scene.topology.triangle_count(); ++b) {
                if (a / 25 == b / 25) continue;
                if (triangles_intersect(scene.corners(a), scene.corners(b))) expected.push_back({a, b});
            }
        }
        std::vector<TrianglePair> truth{{1, 2}};
        true_pairs(scene.topology, scene.frame, truth);
        EXPECT_GT(truth.size(), 100U);
        EXPECT_EQ(truth, expected);
    }
}

TEST(TruePairs, LeaveOutBodiesThatAreNotTestedAndNumbersThatAreNone) {
    LatticeScene scene(7);
    std::vector<TrianglePair> truth;
    true_pairs(scene.topology, scene.frame, truth);
    const auto first_two = std::count_if(truth.begin(), truth.end(), [](TrianglePair p) { return p.b < 50; });
    scene.topology.body_pairs = {{0, 1}};
    true_pairs(scene.topology, scene.frame, truth);
    EXPECT_EQ(static_cast<std::ptrdiff_t>(truth.size()), first_two);
    scene.frame.position.col(scene.topology.triangles(0, 3)).setConstant(std::numeric_limits<double>::quiet_NaN());
    true_pairs(scene.topology, scene.frame, truth);
    EXPECT_LT(static_cast<std::ptrdiff_t>(truth.size()), first_two);
    for (const TrianglePair& pair : truth) EXPECT_NE(pair.a, 3);
}

TEST(TouchingPairs, AreThoseOfATouchClass) {
    const LatticeScene scene(9);
    std::vector<TrianglePair> truth;
    true_pairs(scene.topology, scene.frame, truth);
    std::vector<Index> expected;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const PairClass pair_class = classify_pair(scene.corners(truth[i].a), scene.corners(truth[i].b));
        if (pair_class == PairClass::touch_edge || pair_class == PairClass::touch_vertex) {
            expected.push_back(static_cast<Index>(i));
        }
    }
    EXPECT_GT(expected.size(), 10U);
    EXPECT_LT(expected.size(), truth.size());
    EXPECT_EQ(touching_pairs(scene.topology, scene.frame, truth), expected);
}

TEST(DeepestPairs, AreTheTenThatGoFurthestThroughAPlane) {
    // Twelve upright triangles, 20 mm above the plane of a large one, reach 1 to 12 mm below it in a shuffled order.
    const std::array<int, 12> depths{7, 1, 12, 3, 9, 2, 11, 4, 10, 6, 8, 5};
    std::vector<Body> bodies(2);
    bodies[0].name = "needles";
    bodies[1].name = "sheet";
    bodies[0].kind = BodyKind::instrument;
    bodies[0].vertex_count = 36;
    bodies[0].triangles.resize(3, 12);
    for (Index i = 0; i < 36; ++i) bodies[0].triangles(i) = i;
    bodies[1].kind = BodyKind::tissue;
    bodies[1].vertex_count = 3;
    bodies[1].triangles.resize(3, 1);
    bodies[1].triangles << 0, 1, 2;
    const Topology topology = make_topology(bodies);
    Frame frame;
    frame.position.resize(3, 39);
    for (Index i = 0; i < 12; ++i) {
        const double x = 0.001 * static_cast<double>(i);
        frame.position.middleCols(3 * i, 3) << x, x, x, 0.0, 0.002, 0.001, 0.02, 0.02,
            -0.001 * depths.at(static_cast<std::size_t>(i));
    }
    frame.position.middleCols(36, 3) << -1, 1, 0, -1, -1, 1, 0, 0, 0;
    std::vector<TrianglePair> truth;
    true_pairs(topology, frame, truth);
    ASSERT_EQ(truth.size(), 12U);
    std::vector<TrianglePair> expected;
    for (Index i = 0; i < 12; ++i) {
        if (depths.at(static_cast<std::size_t>(i)) > 2) expected.push_back({i, 12});
    }
    EXPECT_EQ(deepest_pairs(topology, frame, truth), expected);
    truth.resize(9);
    EXPECT_EQ(deepest_pairs(topology, frame, truth), truth) << "all where there are no more than ten";
}

TEST(ComparePairs, CountsMissingExtraAndMissingTouchesApart) {
    const std::vector<TrianglePair> truth{{0, 5}, {0, 7}, {1, 5}, {2, 9}};
    const std::vector<Index> touch{1, 3};
    const PairErrors same = compare_pairs({{2, 9}, {0, 5}, {1, 5}, {0, 7}}, truth, touch);
    EXPECT_EQ(same.false_negatives, 0);
    EXPECT_EQ(same.false_positives, 0);
    EXPECT_EQ(same.false_negatives_touch, 0);
    const PairErrors errors = compare_pairs({{0, 5}, {0, 5}, {3, 4}, {2, 9}, {9, 9}}, truth, touch);
    EXPECT_EQ(errors.false_negatives, 2);
    EXPECT_EQ(errors.false_negatives_touch, 1);
    EXPECT_EQ(errors.false_positives, 2);
    EXPECT_EQ(compare_pairs({}, truth, touch).false_negatives, 4);
    EXPECT_EQ(compare_pairs({}, truth, touch).false_negatives_touch, 2);
}

TEST(PairTruth, NearPairsAreThoseOfADoubleLoopThatDoNotMeet) {
    const test::World world = test::make_world(
        "sphere through a sheet", {{BodyKind::instrument, test::sphere(0.03, 8).move({0.003, 0.001, 0.011})},
                                   {BodyKind::tissue, test::sheet(0.1, 10).shake(0.0004, 1)}});
    const auto corners = [&world](Index t) { return test::corners_of(world, t); };
    const Range first = world.topology.bodies[0].triangles;
    const Range second = world.topology.bodies[1].triangles;
    for (const double query_distance : {0.0005, 0.01}) {
        std::vector<TrianglePair> expected;
        for (Index a = first.first; a < first.end(); ++a) {
            for (Index b = second.first; b < second.end(); ++b) {
                if (oracle_intersect(corners(a), corners(b))) continue;
                if (triangle_distance(corners(a), corners(b)).squared_distance <= query_distance * query_distance) {
                    expected.push_back({a, b});
                }
            }
        }
        ASSERT_GT(expected.size(), 10U);
        std::vector<TrianglePair> near;
        true_near_pairs(world.topology, world.frame, query_distance, near);
        EXPECT_EQ(near, expected);
    }
}

}  // namespace
}  // namespace trocar
