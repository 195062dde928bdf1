// Brute-force queries on the triangles of a World, as reference for trees.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "contact/contact_set.hpp"
#include "geometry/continuous.hpp"
#include "geometry/exact.hpp"
#include "geometry/triangle_distance.hpp"
#include "support/meshes.hpp"
#include "support/shapes.hpp"

namespace trocar::test {

inline Corners corners_of(const World& world, Index triangle) {
    return trocar::corners_of(world.topology.triangles, world.frame.position, triangle);
}

inline Box box_of(const World& world, Index triangle) { return trocar::box_of(corners_of(world, triangle)); }

/// Pairs of triangles of tested bodies that the rational oracle calls meeting, by a double loop.
inline std::vector<TrianglePair> pairs_of_oracle(const World& world) {
    std::vector<TrianglePair> pairs;
    for (const auto& [first, second] : world.topology.body_pairs) {
        const Range a_range = world.topology.bodies[static_cast<std::size_t>(first)].triangles;
        const Range b_range = world.topology.bodies[static_cast<std::size_t>(second)].triangles;
        for (Index a = a_range.first; a < a_range.end(); ++a) {
            const Box box = box_of(world, a);
            for (Index b = b_range.first; b < b_range.end(); ++b) {
                if (box.overlaps(box_of(world, b)) && oracle_intersect(corners_of(world, a), corners_of(world, b))) {
                    pairs.push_back({a, b});
                }
            }
        }
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

/// Where the triangle is at the frame before and at the frame.
inline MovingTriangle moving(const World& world, Index triangle) {
    MovingTriangle result;
    for (int k = 0; k < 3; ++k) {
        const Index v = world.topology.triangles(k, triangle);
        result[at(k)] = {world.frame.previous.col(v), world.frame.position.col(v)};
    }
    return result;
}

/// Pairs of triangles of tested bodies that are apart at the frame before and meet within the tick, by a double loop
/// and the integer oracle.
inline std::vector<SweptContact> beginnings_of_oracle(const World& world) {
    std::vector<SweptContact> result;
    for (const auto& [first, second] : world.topology.body_pairs) {
        const Range a_range = world.topology.bodies[at(first)].triangles;
        const Range b_range = world.topology.bodies[at(second)].triangles;
        for (Index a = a_range.first; a < a_range.end(); ++a) {
            const MovingTriangle one = moving(world, a);
            for (Index b = b_range.first; b < b_range.end(); ++b) {
                const MovingTriangle other = moving(world, b);
                if (oracle_intersect({one[0].start, one[1].start, one[2].start},
                                     {other[0].start, other[1].start, other[2].start})) {
                    continue;
                }
                const std::optional<double> time = oracle_first_contact(one, other);
                if (time) result.push_back({.a = a, .b = b, .body_a = first, .body_b = second, .time = *time});
            }
        }
    }
    std::sort(result.begin(), result.end(),
              [](const SweptContact& x, const SweptContact& y) { return std::pair(x.a, x.b) < std::pair(y.a, y.b); });
    return result;
}

inline Index nearest_of_all(const World& world, Range triangles, const Vector3& x) {
    Index nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (Index t = triangles.first; t < triangles.end(); ++t) {
        const Corners c = corners_of(world, t);
        const double distance = (point_at(c, closest_point_on_triangle(c, x)) - x).squaredNorm();
        if (distance >= least) continue;
        least = distance;
        nearest = t;
    }
    return nearest;
}

}  // namespace trocar::test
