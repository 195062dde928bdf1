// What is inside closed surfaces at the start of a run, against the solid angle that they fill; and the lists of edges
// and faces that generators read, against a search through all of them.
#include "contact_generation/crossed_sides.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "geometry/orientation.hpp"
#include "geometry/triangle_distance.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"
#include "support/world_triangles.hpp"

namespace trocar::test {
namespace {

TEST(CrossedSides, AtTheStartThatIsInsideAroundWhichAClosedSurfaceWinds) {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> uniform(-0.03, 0.03);
    int inside = 0;
    for (int k = 0; k < 24; ++k) {
        Shape tool = k % 2 == 0 ? shaft(0.01, 0.08, 9, 12) : slab(0.05, 0.02, 6);
        // The first ones stand as regular meshes do, in planes of each other's corners.
        if (k >= 4) {
            tool.rotate(random_vector(uniform, random), 40.0 * uniform(random));
            tool.move(random_vector(uniform, random));
        }
        const Shape organ = k % 4 < 2 ? slab(0.1, 0.04, 10) : sphere(0.05, 12);
        World world = make_world("start", {{BodyKind::instrument, tool}, {BodyKind::tissue, organ}});
        for (BodyRange& body : world.topology.bodies) body.closed = true;
        FeatureMesh mesh;
        mesh.prepare(world.topology);
        CrossedSides sides;
        sides.prepare(world.topology, mesh, world.frame);
        for (const auto& [body, other] : {std::array<Index, 2>{0, 1}, {1, 0}}) {
            const BodyRange& vertices = world.topology.bodies[static_cast<std::size_t>(body)];
            const Range faces = world.topology.bodies[static_cast<std::size_t>(other)].triangles;
            const Triangles surface = world.topology.triangles.middleCols(faces.first, faces.count);
            for (Index v = vertices.vertices.first; v < vertices.vertices.end(); ++v) {
                const Vector3 x = world.frame.position.col(v);
                const Index nearest = nearest_of_all(world, faces, x);
                const Corners c = corners_of(world, nearest);
                if ((point_at(c, closest_point_on_triangle(c, x)) - x).norm() < 1e-9) continue;  // on the surface
                const double winding = winding_number(world.frame.position, surface, x);
                ASSERT_NEAR(winding, std::round(winding), 1e-6);
                const CrossedLayer* const layer = sides.layer(v, other);
                ASSERT_EQ(layer != nullptr, std::lround(winding) != 0) << k << ": vertex " << v;
                if (layer == nullptr) continue;
                EXPECT_EQ(layer->sign, 1);
                EXPECT_EQ(layer->triangle, nearest);
                ++inside;
            }
        }
    }
    EXPECT_GT(inside, 500);
}

TEST(FeatureMesh, ListsEachEdgeOnceAndWhatIsAtEdgesAndVertices) {
    const World world =
        make_world("mesh", {{BodyKind::instrument, sheet(0.1, 3)}, {BodyKind::tissue, sphere(0.05, 5)}});
    const Triangles& triangles = world.topology.triangles;
    const Index count = world.topology.triangle_count();
    FeatureMesh mesh;
    mesh.prepare(world.topology);
    // Euler: vertices - edges + faces is 1 for a disc and 2 for a sphere.
    ASSERT_EQ(world.topology.vertex_count - mesh.edge_count() + count, 1 + 2);
    for (Index t = 0; t < count; ++t) {
        for (int i = 0; i < 3; ++i) {
            const Index u = triangles(i, t);
            const Index v = triangles((i + 1) % 3, t);
            const Index edge = mesh.edges_of(t)[static_cast<std::size_t>(i)];
            EXPECT_EQ(mesh.ends(edge), (std::array<Index, 2>{std::min(u, v), std::max(u, v)}));
            EXPECT_EQ(mesh.other_end(edge, u), v);
            EXPECT_EQ(mesh.other_end(edge, v), u);
            EXPECT_EQ(mesh.apex(t, edge), triangles((i + 2) % 3, t));
        }
    }
    const auto listed = [](std::span<const Index> list) { return std::vector<Index>(list.begin(), list.end()); };
    const auto faces_with = [&](Index u, Index v) {
        std::vector<Index> faces;
        for (Index t = 0; t < count; ++t) {
            const auto corner = triangles.col(t).array();
            if ((corner == u).any() && (corner == v).any()) faces.push_back(t);
        }
        return faces;
    };
    int rims = 0;
    for (Index edge = 0; edge < mesh.edge_count(); ++edge) {
        EXPECT_EQ(listed(mesh.faces_at_edge(edge)), faces_with(mesh.ends(edge)[0], mesh.ends(edge)[1])) << edge;
        rims += mesh.is_rim(edge) ? 1 : 0;
    }
    EXPECT_EQ(rims, 4 * 3);
    for (Index v = 0; v < world.topology.vertex_count; ++v) {
        EXPECT_EQ(listed(mesh.faces_at_vertex(v)), faces_with(v, v)) << v;
        std::vector<Index> edges;
        for (Index edge = 0; edge < mesh.edge_count(); ++edge) {
            if (mesh.ends(edge)[0] == v || mesh.ends(edge)[1] == v) edges.push_back(edge);
        }
        EXPECT_EQ(listed(mesh.edges_at_vertex(v)), edges) << v;
    }
}

}  // namespace
}  // namespace trocar::test
