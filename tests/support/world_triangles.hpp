// Brute-force queries on the triangles of a World, as reference for trees.
#pragma once

#include <limits>

#include "geometry/triangle_distance.hpp"
#include "support/shapes.hpp"

namespace trocar::test {

inline Corners corners_of(const World& world, Index triangle) {
    const auto c = world.topology.triangles.col(triangle);
    return {world.frame.position.col(c[0]), world.frame.position.col(c[1]), world.frame.position.col(c[2])};
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
