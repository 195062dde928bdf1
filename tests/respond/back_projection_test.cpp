// Back-projection (METHODS §9.1) against the same rule without any search: every path with every triangle that meets
// the tool.
#include "respond/back_projection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "geometry/exact.hpp"
#include "respond/equations.hpp"
#include "support/materials.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"

namespace trocar {
namespace {

struct Attraction {
    Index tissue_vertex = -1;
    Index tool_vertex = -1;
    double depth = 0.0;  // m
};

std::vector<Attraction> by_brute_force(const ThesisState& state, const Frame& frame, const std::set<Index>& met) {
    std::vector<Attraction> list;
    const Topology& topology = *state.topology;
    const BodyRange& tool = topology.bodies.front();
    for (Index a = tool.vertices.first; a < tool.vertices.end(); ++a) {
        const Vector3 x = frame.position.col(a);
        const Vector3 v = frame.velocity.col(a);
        if (v.norm() == 0.0) continue;
        const double path = std::min(state.settings.n_back * state.dt * v.norm(), state.settings.l_max);
        std::vector<Index> attracted;
        for (const Index t : met) {
            const Corners corners = corners_of(topology.triangles, frame.position, t);
            const equations::PathHit hit = equations::path_hit(corners, x - path * v.normalized(), x);
            if (!hit.found) continue;
            const Index vertex = topology.triangles(equations::nearest_corner(corners, hit.point), t);
            if (std::find(attracted.begin(), attracted.end(), vertex) != attracted.end()) continue;
            attracted.push_back(vertex);
            list.push_back({vertex, a, (x - hit.point).norm()});
        }
    }
    return list;
}

/// A ball of some hundred vertices in a soup of triangles; a tenth of the ball's vertices rest, some are fast.
void expect_same(const test::Shape& ball, const test::Shape& soup, std::uint32_t seed) {
    const test::World world = test::make_world("back_projection", {{.kind = BodyKind::instrument, .shape = ball},
                                                                   {.kind = BodyKind::tissue, .shape = soup},
                                                                   {.kind = BodyKind::tissue, .shape = soup}});
    Frame frame = world.frame;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> even(-1.0, 1.0);
    const Range second = world.topology.bodies.back().vertices;
    for (Index v = second.first; v < second.end(); ++v) frame.position(0, v) += 0.004 + 0.001 * even(random);
    const Range tool = world.topology.bodies.front().vertices;
    for (Index v = tool.first; v < tool.end(); ++v) {
        const double speed = v % 10 == 0 ? 0.0 : (v % 7 == 0 ? 5.0 : 0.4);  // m/s; 5 m/s goes beyond l_max
        frame.velocity.col(v) = speed * test::random_vector(even, random);
    }
    Materials materials = test::empty_materials(world.topology);
    materials.mass.assign(materials.mass.size(), 1e-4);
    materials.area.assign(materials.mass.size(), 1e-5);
    materials.mean_stiffness.assign(materials.mass.size(), 100.0);
    ThesisSettings settings;
    ThesisState state(settings);
    state.prepare(world.topology, materials);
    state.begin(frame, 1e-3);
    // What meets the ball, pair by pair.
    ContactSet contacts;
    std::set<Index> met;
    const Range tool_faces = world.topology.bodies.front().triangles;
    for (Index a = tool_faces.first; a < tool_faces.end(); ++a) {
        for (Index b = tool_faces.end(); b < world.topology.triangle_count(); ++b) {
            if (!triangles_intersect(corners_of(world.topology.triangles, frame.position, a),
                                     corners_of(world.topology.triangles, frame.position, b)))
                continue;
            contacts.pairs.push_back({a, b});
            met.insert(b);
        }
    }
    BackProjection back_projection;
    ResponseOutput output;
    output.resize(world.topology.vertex_count, world.topology.body_count());
    back_projection.respond(state, frame, contacts, output);

    const std::vector<Attraction> expected = by_brute_force(state, frame, met);
    ASSERT_GT(expected.size(), 40U);
    ASSERT_EQ(output.contacts.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_EQ(output.contacts[i].vertices[0], expected[i].tissue_vertex) << i;
        EXPECT_EQ(output.contacts[i].reaction_point, Vector3(frame.position.col(expected[i].tool_vertex))) << i;
        // The gap is that at the start of the tick, before the tool's script has moved it.
        const double depth = output.contacts[i].face_velocity * state.dt - output.contacts[i].gap;
        EXPECT_NEAR(depth, expected[i].depth, 1e-15) << i;
    }
}

TEST(BackProjection, FindsWhatEveryPathFindsAmongAllTrianglesThatMeetTheTool) {
    for (const std::uint32_t seed : {1U, 2U, 3U}) {
        expect_same(test::sphere(0.01, 8), test::soup(400, 0.004, 0.012, seed), seed);   // fewer paths than 256
        expect_same(test::sphere(0.01, 24), test::soup(400, 0.004, 0.012, seed), seed);  // more, in several lots
        expect_same(test::sphere(0.03, 24), test::soup(300, 0.03, 0.005, seed), seed);   // few of them near
    }
}

}  // namespace
}  // namespace trocar
