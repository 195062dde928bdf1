#include "measure/ray_tree.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "geometry/exact.hpp"
#include "measure/vertical_crossings.hpp"
#include "support/meshes.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"

namespace trocar {
namespace {

using test::Faces;
using test::TriangleMesh;

/// Closed rings of `sides` around z, from z = 0 to 1.
TriangleMesh shaft(Index rings, Index sides, double radius) {
    const test::Shape shape = test::shaft(radius, 1.0, sides, rings - 1);
    return {shape.vertices, shape.triangles};
}

/// Closed flat prisms above each other, all as wide as the whole.
TriangleMesh discs(Index count, Index sides) {
    test::Shape stack;
    for (Index k = 0; k < count; ++k) stack.add(test::shaft(1.0, 0.004, sides, 1).move({0.0, 0.0, 0.01 * k}));
    return {stack.vertices, stack.triangles};
}

/// A polygon with many corners as readers split it.
TriangleMesh polygon(Index corners) {
    std::vector<Vector3> points;
    Faces faces;
    for (Index s = 0; s < corners; ++s) {
        const double angle = 2.0 * std::numbers::pi * s / corners;
        points.emplace_back(std::cos(angle), std::sin(angle), 0.0);
        if (s >= 2) faces.push_back({0, s - 1, s});
    }
    return {points, faces};
}

/// Triangles between points of a coarse lattice: degenerate, coplanar and repeated ones among them, edges shared.
TriangleMesh lattice_triangles(std::mt19937_64& random, Index count) {
    std::uniform_int_distribution<int> place(0, 3);
    std::uniform_int_distribution<Index> vertex(0, 39);
    std::vector<Vector3> points;
    for (Index i = 0; i < 40; ++i) points.push_back(test::random_vector(place, random));
    Faces faces;
    for (Index i = 0; i < count; ++i) {
        faces.push_back({vertex(random), vertex(random), vertex(random)});
        if (i % 5 == 0) faces.push_back(faces.back());
    }
    return {points, faces};
}

void turn(TriangleMesh& surface, const Vector3& axis, double angle) {
    surface.position = (Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix() * surface.position).eval();
}

std::vector<TriangleMesh> all_kinds(std::mt19937_64& random) {
    std::vector<TriangleMesh> kinds{shaft(40, 5, 0.1),
                                    shaft(2, 60, 0.1),
                                    discs(20, 7),
                                    polygon(200),
                                    test::needles_and_faces(random, 150),
                                    lattice_triangles(random, 30),
                                    lattice_triangles(random, 200),
                                    lattice_triangles(random, 3)};
    for (std::size_t kind = 0; kind < 4; ++kind) {
        kinds.push_back(kinds[kind]);
        turn(kinds.back(), Vector3(1.0, 2.0, 0.5), 0.9);
    }
    return kinds;
}

int crossings_one_by_one(const TriangleMesh& surface, const Vector3& p) {
    int sum = 0;
    for (Index t = 0; t < surface.count(); ++t) {
        const Corners c = surface.corners(t);
        sum += upward_crossing(c[0], c[1], c[2], p);
    }
    return sum;
}

/// Points everywhere about the surface, at its vertices, under and beside them, and on its triangles.
std::vector<Vector3> asked_points(const TriangleMesh& surface, std::mt19937_64& random) {
    std::uniform_real_distribution<double> share(-0.1, 1.1);
    std::uniform_int_distribution<Index> vertex(0, static_cast<Index>(surface.position.cols()) - 1);
    Box box;
    for (Eigen::Index v = 0; v < surface.position.cols(); ++v) box.add(surface.position.col(v));
    const Vector3 size = box.max - box.min;
    std::vector<Vector3> points;
    for (int i = 0; i < 60; ++i) {
        const Vector3 anywhere = box.min + test::random_vector(share, random).cwiseProduct(size);
        const Vector3 at_vertex = surface.position.col(vertex(random));
        const Vector3 between = 0.5 * (at_vertex + Vector3(surface.position.col(vertex(random))));
        points.insert(points.end(), {anywhere, at_vertex, between, Vector3(at_vertex.x(), at_vertex.y(), anywhere.z()),
                                     Vector3(between.x(), at_vertex.y(), box.min.z() - 1.0)});
    }
    return points;
}

TEST(RayTree, CountsTheCrossingsOfEveryTriangle) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 6; ++round) {
        for (TriangleMesh& surface : all_kinds(random)) {
            RayTree tree;
            tree.prepare(surface.triangles, {0, surface.count()}, surface.position);
            // As prepared, turned, and with all vertices somewhere else.
            for (int state = 0; state < 3; ++state) {
                if (state == 1) turn(surface, Vector3(0.3, -1.0, 2.0), 0.3 + round);
                if (state == 2) surface.position += 0.2 * Matrix3X::Random(3, surface.position.cols());
                if (state > 0) tree.refit(surface.triangles, surface.position);
                RayWork work;
                int not_none = 0;
                for (const Vector3& p : asked_points(surface, random)) {
                    const int expected = crossings_one_by_one(surface, p);
                    ASSERT_EQ(tree.crossings(surface.triangles, surface.position, p, &work), expected);
                    not_none += expected != 0 ? 1 : 0;
                }
                if (surface.count() > 20) {
                    EXPECT_GT(not_none, 0);
                }
            }
        }
    }
}

TEST(RayTree, VisitsEveryTriangleThatASegmentMeetsOnce) {
    std::mt19937_64 random(2);
    std::int64_t met = 0;
    std::int64_t visited_in_all = 0;
    for (int round = 0; round < 3; ++round) {
        for (TriangleMesh& surface : all_kinds(random)) {
            RayTree tree;
            tree.prepare(surface.triangles, {0, surface.count()}, surface.position, round == 0);
            if (round == 2) {
                turn(surface, Vector3(1.0, 1.0, -0.3), 1.1);
                tree.refit(surface.triangles, surface.position);
            }
            const std::vector<Vector3> points = asked_points(surface, random);
            for (std::size_t i = 0; i + 1 < points.size(); i += 6) {
                std::map<Index, int> relaxations;
                std::set<Index> above;
                tree.visit_along(points[i], points[i + 1], [&](Index t) { ++relaxations[t]; });
                tree.visit_along_from_above(points[i], points[i + 1], [&](Index t) { above.insert(t); });
                for (const auto& [triangle, times] : relaxations) {
                    ASSERT_EQ(times, 1);
                    ASSERT_TRUE(above.contains(triangle));
                }
                visited_in_all += static_cast<std::int64_t>(relaxations.size());
                const auto flat = [](Corners corners) {
                    for (Vector3& p : corners) p.z() = 0.0;
                    return corners;
                };
                const Corners segment{points[i], points[i + 1], points[i + 1]};
                for (Index t = 0; t < surface.count(); ++t) {
                    if (triangles_intersect(segment, surface.corners(t))) {
                        ++met;
                        ASSERT_TRUE(relaxations.contains(t));
                    }
                    if (triangles_intersect(flat(segment), flat(surface.corners(t)))) {
                        ASSERT_TRUE(above.contains(t));
                    }
                }
            }
        }
    }
    EXPECT_GT(met, 1000);
    EXPECT_LT(visited_in_all, 40 * met);
}

TEST(RayTree, OfTrianglesThatStandBehindOthersItIsTheSame) {
    std::mt19937_64 random(4);
    TriangleMesh surface = shaft(60, 12, 0.1);
    const Index count = surface.count();
    // In no order: neighbours on the list are none in space.
    for (Index t = count - 1; t > 0; --t) {
        const auto other = static_cast<Index>(random() % static_cast<std::uint64_t>(t + 1));
        surface.triangles.col(t).swap(surface.triangles.col(other));
    }
    const Index before = count / 2;
    Triangles all(3, before + count);
    all << surface.triangles.leftCols(before), surface.triangles;
    RayTree alone;
    RayTree behind;
    alone.prepare(surface.triangles, {0, count}, surface.position);
    behind.prepare(all, {before, count}, surface.position);
    RayWork of_alone;
    RayWork of_behind;
    for (const Vector3& p : asked_points(surface, random)) {
        const int expected = crossings_one_by_one(surface, p);
        EXPECT_EQ(alone.crossings(surface.triangles, surface.position, p, &of_alone), expected);
        EXPECT_EQ(behind.crossings(all, surface.position, p, &of_behind), expected);
    }
    EXPECT_EQ(of_behind.nodes, of_alone.nodes);
    EXPECT_EQ(of_behind.triangles, of_alone.triangles);
    EXPECT_EQ(of_behind.rim_edges, of_alone.rim_edges);
    EXPECT_EQ(behind.rim_edge_count(), alone.rim_edge_count());
}

/// Work of one question on average, and what is held per triangle.
struct Cost {
    double asked = 0.0;
    double held = 0.0;
};

Cost cost_of(const TriangleMesh& surface) {
    std::mt19937_64 random(3);
    RayTree tree;
    tree.prepare(surface.triangles, {0, surface.count()}, surface.position);
    RayWork work;
    const std::vector<Vector3> points = asked_points(surface, random);
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        static_cast<void>(tree.crossings(surface.triangles, surface.position, points[i], &work));
        const Vector3 near = points[i] + 0.02 * (points[i + 1] - points[i]);
        tree.visit_along(
            points[i], near, [](Index) {}, &work);
    }
    return {static_cast<double>(work.nodes + work.triangles + work.rim_edges) / static_cast<double>(points.size()),
            static_cast<double>(tree.node_count() + tree.rim_edge_count()) / static_cast<double>(surface.count())};
}

/// A grid over these had cells for every triangle of a shaft that stands upright, or for all of a disc.
TEST(RayTree, CostsLittleMoreOnSixteenTimesTheTriangles) {
    struct Kind {
        const char* name;
        TriangleMesh small;
        TriangleMesh large;
    };
    std::vector<Kind> kinds{{"shaft", shaft(300, 12, 0.01), shaft(4800, 12, 0.01)},
                            {"sheath of slivers", shaft(2, 2000, 0.01), shaft(2, 32000, 0.01)},
                            {"stack of discs", discs(60, 18), discs(960, 18)},
                            {"polygon", polygon(3000), polygon(48000)}};
    for (std::size_t kind = 0; kind < 4; ++kind) {
        kinds.push_back(kinds[kind]);
        turn(kinds.back().small, Vector3(1.0, -1.0, 0.1), 0.95);
        turn(kinds.back().large, Vector3(1.0, -1.0, 0.1), 0.95);
    }
    for (const Kind& kind : kinds) {
        const Cost small = cost_of(kind.small);
        const Cost large = cost_of(kind.large);
        EXPECT_LT(large.asked, 6.0 * small.asked) << kind.name << ' ' << small.asked << ' ' << large.asked;
        EXPECT_LT(large.held, 4.0) << kind.name;
    }
}

}  // namespace
}  // namespace trocar
