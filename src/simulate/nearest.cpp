#include "simulate/nearest.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/surface_tree.hpp"

namespace trocar {
namespace {

/// m; infinite for an empty box.
double gap(const Box& a, const Box& b) { return std::sqrt(a.squared_distance(b)); }

/// Triangles of a body that may be within `query_distance` of `other`. Triangles with a non-finite corner are left out.
std::vector<Index> triangles_near(const Topology& topology, const Frame& frame, Index body, const Box& other,
                                  double query_distance) {
    std::vector<Index> near;
    const Range triangles = topology.bodies[static_cast<std::size_t>(body)].triangles;
    for (Index t = triangles.first; t < triangles.end(); ++t) {
        const Corners corners = corners_of(topology.triangles, frame.position, t);
        const bool is_somewhere =
            std::all_of(corners.begin(), corners.end(), [](const Vector3& corner) { return corner.allFinite(); });
        if (is_somewhere && gap(box_of(corners), other) < query_distance) near.push_back(t);
    }
    return near;
}

Box box_of_body(const Topology& topology, const Frame& frame, Index body) {
    Box box;
    const Range vertices = topology.bodies[static_cast<std::size_t>(body)].vertices;
    for (Index v = vertices.first; v < vertices.end(); ++v) {
        if (frame.position.col(v).allFinite()) box.add(frame.position.col(v));
    }
    return box;
}

}  // namespace

void NearestApproach::observe(const Topology& topology, const Frame& frame) {
    for (const auto& [a, b] : topology.body_pairs) {
        const Box around_a = box_of_body(topology, frame, a);
        const Box around_b = box_of_body(topology, frame, b);
        if (!(gap(around_a, around_b) < distance)) continue;
        const SurfaceTree of_b(topology.triangles, triangles_near(topology, frame, b, around_a, distance),
                               frame.position);
        double least = distance;
        for (const Index one : triangles_near(topology, frame, a, around_b, distance)) {
            least = of_b.distance_to(corners_of(topology.triangles, frame.position, one), least);
        }
        if (!(least < distance)) continue;
        distance = least;
        tick = frame.tick;
        body_a = a;
        body_b = b;
        box_a = around_a;
        box_b = around_b;
    }
}

}  // namespace trocar
