// A permuted world is the same world: corner by corner and spring by spring.
#include "measure/permutation.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "support/shapes.hpp"

namespace trocar {
namespace {

test::World three_bodies() {
    return test::make_world("three", {{BodyKind::instrument, test::sphere(0.01, 5).move({0.001, 0.0, 0.004})},
                                      {BodyKind::tissue, test::sheet(0.05, 6).shake(0.0005, 3)},
                                      {BodyKind::tissue, test::sphere(0.02, 6).move({0.0, 0.01, -0.015})}});
}

using Point = std::array<double, 3>;

/// The corners of a triangle wherever it starts.
std::multiset<Point> corners(const Topology& topology, const Frame& frame, Index triangle) {
    std::multiset<Point> result;
    for (int k = 0; k < 3; ++k) {
        const Vector3 x = frame.position.col(topology.triangles(k, triangle));
        result.insert({x[0], x[1], x[2]});
    }
    return result;
}

void expect_same_triangles(const test::World& world, const Permutation& permutation) {
    const Frame reported = permutation.permuted(world.frame);
    ASSERT_EQ(permutation.triangle.size(), static_cast<std::size_t>(permutation.topology.triangle_count()));
    for (Index t = 0; t < permutation.topology.triangle_count(); ++t) {
        const Index old = permutation.triangle[static_cast<std::size_t>(t)];
        EXPECT_EQ(corners(permutation.topology, reported, t), corners(world.topology, world.frame, old)) << t;
    }
}

TEST(Permutation, ShuffledTrianglesAreTheSameInAnotherOrder) {
    const test::World world = three_bodies();
    for (const Shuffle what : {Shuffle::triangles, Shuffle::triangles_and_vertices}) {
        const Permutation permutation = shuffled(world.topology, 2, what);
        expect_same_triangles(world, permutation);
        EXPECT_NE(permutation.topology.triangles, world.topology.triangles);
        EXPECT_EQ(permutation.permuted(world.frame).position == world.frame.position, what == Shuffle::triangles);
    }
}

TEST(Permutation, BodiesChangePlacesAndPairsFindThePathBack) {
    const test::World world = three_bodies();
    const Permutation all = with_bodies_in_order(world.topology, {2, 0, 1});
    expect_same_triangles(world, all);
    EXPECT_EQ(all.topology.bodies[0].name, world.topology.bodies[2].name);
    EXPECT_EQ(all.topology.body_pairs.size(), world.topology.body_pairs.size());
    const Index first_of_two = world.topology.bodies[2].triangles.first;
    const Index first_of_zero = all.topology.bodies[1].triangles.first;
    const std::vector<TrianglePair> back = all.original({{1, first_of_zero + 4}});
    EXPECT_EQ(back, (std::vector<TrianglePair>{{4, first_of_two + 1}}));
    const Permutation two = with_bodies_in_order(world.topology, {1, 0});
    expect_same_triangles(world, two);
    EXPECT_EQ(two.topology.body_pairs.size(), 1U);
}

TEST(Permutation, OnTheGridShiftAndFactorAreExact) {
    const test::World world = three_bodies();
    const Frame grid = on_grid(world.frame);
    EXPECT_LT((grid.position - world.frame.position).cwiseAbs().maxCoeff(), 0x1p-30);
    const Frame there = placed(grid, 1.0, {16.0, -8.0, 4.0});
    EXPECT_EQ(placed(there, 1.0, {-16.0, 8.0, -4.0}).position, grid.position);
    EXPECT_EQ(placed(grid, 1000.0, Vector3::Zero()).position / 1000.0, grid.position);
}

/// Jaws, a trocar, a tip, a script and tissue.
Scene grasp_scene() {
    return read_scene(std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / "i2t_grasp.json", std::nullopt);
}

TEST(Permutation, ThroughMillimetresEveryLengthIsTheSameButForRounding) {
    const Scene scene = grasp_scene();
    const Scene reported = through_millimetres(scene);
    const auto alike = [](const auto& is, const auto& was) { return (is - was).norm() <= 1e-15 * was.norm(); };
    EXPECT_NE(reported.first.position, scene.first.position) << "nothing was rounded";
    EXPECT_TRUE(alike(reported.first.position, scene.first.position));
    EXPECT_TRUE(alike(reported.first.previous, scene.first.previous));
    ASSERT_FALSE(scene.materials.springs.empty());
    for (std::size_t s = 0; s < scene.materials.springs.size(); ++s) {
        const Spring& was = scene.materials.springs[s];
        const Spring& is = reported.materials.springs[s];
        EXPECT_NEAR(is.rest, was.rest, 1e-15 * was.rest);
        EXPECT_EQ(is.k, was.k);
    }
    int scripts = 0;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        EXPECT_TRUE(alike(reported.first.pose[b].translation, scene.first.pose[b].translation));
        EXPECT_TRUE(alike(reported.bodies[b].local, scene.bodies[b].local));
        EXPECT_TRUE(alike(reported.materials.tip[b], scene.materials.tip[b]));
        for (std::size_t j = 0; j < scene.bodies[b].jaws.size(); ++j) {
            EXPECT_TRUE(alike(reported.bodies[b].jaws[j].hinge, scene.bodies[b].jaws[j].hinge));
        }
        if (!scene.bodies[b].motion) continue;
        ++scripts;
        EXPECT_TRUE(alike(reported.materials.trocar_point[b].value(), scene.materials.trocar_point[b].value()));
        const std::vector<MotionKey>& was = scene.bodies[b].motion->keys;
        const std::vector<MotionKey>& is = reported.bodies[b].motion.value().keys;
        ASSERT_EQ(is.size(), was.size());
        for (std::size_t k = 0; k < was.size(); ++k) {
            EXPECT_TRUE(alike(is[k].translation, was[k].translation));
            EXPECT_EQ(is[k].time, was[k].time);
        }
    }
    EXPECT_EQ(scripts, 1);
}

TEST(Permutation, AMovedSceneIsMovedAsAWholeAndSoAreItsScripts) {
    const Scene scene = grasp_scene();
    const Vector3 by(16.0, -8.0, 4.0);
    const Scene reported = moved(scene, by);
    EXPECT_EQ(reported.first.position, Matrix3X(scene.first.position.colwise() + by));
    EXPECT_EQ(reported.first.previous, Matrix3X(scene.first.previous.colwise() + by));
    Matrix3X was = scene.first.position;
    Matrix3X is = reported.first.position;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
        EXPECT_EQ(reported.first.pose[b].translation, Vector3(scene.first.pose[b].translation + by));
        EXPECT_EQ(reported.materials.tip[b], scene.materials.tip[b]) << "in the frame of its body";
        if (!scene.bodies[b].motion) continue;
        EXPECT_EQ(reported.materials.trocar_point[b].value(), Vector3(scene.materials.trocar_point[b].value() + by));
        const Range vertices = scene.topology.bodies[b].vertices;
        for (const double time : {0.1, 0.45, 2.0}) {
            place_body(scene.bodies[b], vertices, scene.bodies[b].motion->pose_at(time), was);
            place_body(reported.bodies[b], vertices, reported.bodies[b].motion.value().pose_at(time), is);
            EXPECT_LT((is - (was.colwise() + by)).cwiseAbs().maxCoeff(), 5e-14) << time;
        }
    }
}

TEST(Permutation, ASceneKeepsItsSpringsShapesLawsAndMasses) {
    Scene scene = read_scene(std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / "t2t_press.json", std::nullopt);
    scene.materials.enclosures = {{.triangles = scene.topology.triangles.rightCols(5)}};
    std::vector<Index> order;
    for (Index b = 0; b < scene.topology.body_count(); ++b) order.push_back(b);
    std::swap(order[order.size() - 1], order[order.size() - 2]);  // the two tissues
    ASSERT_EQ(scene.topology.bodies[static_cast<std::size_t>(order.back())].kind, BodyKind::tissue);
    const Scene reported = permuted(scene, with_bodies_in_order(scene.topology, order));
    const auto at = [](Index i) { return static_cast<std::size_t>(i); };
    ASSERT_EQ(reported.materials.springs.size(), scene.materials.springs.size());
    for (std::size_t s = 0; s < scene.materials.springs.size(); ++s) {
        const Spring& was = scene.materials.springs[s];
        const Spring& is = reported.materials.springs[s];
        EXPECT_EQ(reported.first.position.col(is.i), scene.first.position.col(was.i));
        EXPECT_EQ(reported.first.position.col(is.j), scene.first.position.col(was.j));
        EXPECT_EQ(reported.materials.mass[at(is.i)], scene.materials.mass[at(was.i)]);
        EXPECT_EQ(reported.materials.pinned[at(is.j)], scene.materials.pinned[at(was.j)]);
    }
    ASSERT_EQ(reported.materials.enclosures.size(), 1U);
    ASSERT_NE(reported.materials.enclosures[0].triangles, scene.materials.enclosures[0].triangles);
    for (Eigen::Index corner = 0; corner < 15; ++corner) {
        EXPECT_EQ(reported.first.position.col(reported.materials.enclosures[0].triangles(corner % 3, corner / 3)),
                  scene.first.position.col(scene.materials.enclosures[0].triangles(corner % 3, corner / 3)));
    }
    for (std::size_t p = 0; p < reported.topology.body_pairs.size(); ++p) {
        std::array<Index, 2> was{order[at(reported.topology.body_pairs[p][0])],
                                 order[at(reported.topology.body_pairs[p][1])]};
        std::sort(was.begin(), was.end());
        const auto old = at(scene.topology.body_pair(was[0], was[1]));
        const double k = reported.materials.contact_laws[p].k;
        const double old_k = scene.materials.contact_laws[old].k;
        EXPECT_TRUE(k == old_k || (std::isnan(k) && std::isnan(old_k)));
    }
}

}  // namespace
}  // namespace trocar
