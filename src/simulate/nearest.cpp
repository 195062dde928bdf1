#include "simulate/nearest.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/triangle_distance.hpp"

namespace trocar {
namespace {

Corners corners_of(const Topology& topology, const Frame& frame, Index triangle) {
    const auto corner = [&](int i) -> Vector3 { return frame.position.col(topology.triangles(i, triangle)); };
    return {corner(0), corner(1), corner(2)};
}

Box box_of(const Corners& corners) {
    Box box;
    for (const Vector3& corner : corners) {
        if (corner.allFinite()) box.add(corner);
    }
    return box;
}

/// m; infinite for an empty box.
double gap(const Box& a, const Box& b) {
    const Vector3 apart = (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(0.0);
    return apart.norm();
}

struct Piece {
    Corners corners;
    Box box;
};

/// The triangles of a body that may be within `reach` of `other`.
std::vector<Piece> pieces_near(const Topology& topology, const Frame& frame, Index body, const Box& other,
                               double reach) {
    std::vector<Piece> pieces;
    const Range triangles = topology.bodies[static_cast<std::size_t>(body)].triangles;
    for (Index t = triangles.first; t < triangles.end(); ++t) {
        const Corners corners = corners_of(topology, frame, t);
        const Box box = box_of(corners);
        if (gap(box, other) < reach) pieces.push_back({corners, box});
    }
    return pieces;
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
        const std::vector<Piece> of_a = pieces_near(topology, frame, a, around_b, distance);
        const std::vector<Piece> of_b = pieces_near(topology, frame, b, around_a, distance);
        double least = distance;
        for (const Piece& one : of_a) {
            for (const Piece& other : of_b) {
                if (!(gap(one.box, other.box) < least)) continue;
                least = std::min(least, std::sqrt(triangle_distance(one.corners, other.corners).squared_distance));
            }
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
