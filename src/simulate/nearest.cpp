#include "simulate/nearest.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/surface_tree.hpp"

namespace trocar {
namespace {

Corners corners_of(const Topology& topology, const Frame& frame, Index triangle) {
    const auto corner = [&](int i) -> Vector3 { return frame.position.col(topology.triangles(i, triangle)); };
    return {corner(0), corner(1), corner(2)};
}

/// m; infinite for an empty box.
double gap(const Box& a, const Box& b) {
    const Vector3 apart = (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(0.0);
    return apart.norm();
}

/// The triangles of a body, those with corners that are nowhere left out, that may be within `reach` of `other`.
std::vector<Index> triangles_near(const Topology& topology, const Frame& frame, Index body, const Box& other,
                                  double reach) {
    std::vector<Index> near;
    const Range triangles = topology.bodies[static_cast<std::size_t>(body)].triangles;
    for (Index t = triangles.first; t < triangles.end(); ++t) {
        Box box;
        bool is_somewhere = true;
        for (const Vector3& corner : corners_of(topology, frame, t)) {
            is_somewhere = is_somewhere && corner.allFinite();
            box.add(corner);
        }
        if (is_somewhere && gap(box, other) < reach) near.push_back(t);
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

void NearestApproach::look(const Topology& topology, const Frame& frame) {
    for (const auto& [a, b] : topology.body_pairs) {
        const Box around_a = box_of_body(topology, frame, a);
        const Box around_b = box_of_body(topology, frame, b);
        if (!(gap(around_a, around_b) < distance)) continue;
        const SurfaceTree of_b(topology.triangles, triangles_near(topology, frame, b, around_a, distance),
                               frame.position);
        double least = distance;
        for (const Index one : triangles_near(topology, frame, a, around_b, distance)) {
            least = of_b.distance_to(corners_of(topology, frame, one), least);
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
