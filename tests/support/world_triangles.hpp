// Brute-force queries on the triangles of a World, as reference for trees.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "contact/contact_set.hpp"
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
