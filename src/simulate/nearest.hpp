// Closest approach of two bodies. It is reported for runs without contact, where a body is often misplaced.
#pragma once

#include <cstdint>
#include <limits>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Smallest distance so far between two bodies that are tested against each other.
struct NearestApproach {
    double distance = std::numeric_limits<double>::infinity();  ///< m between their surfaces
    std::int64_t tick = -1;                                     ///< -1: no frame yet
    Index body_a = 0;
    Index body_b = 0;
    Box box_a;  ///< m, of body_a in that frame
    Box box_b;

    /// Takes the frame's closest pair of triangles if it is closer than all before. Precondition: no triangles
    /// intersect (triangle_distance.hpp). Triangles with a non-finite vertex are skipped. Cost falls with the distance
    /// found before.
    void observe(const Topology& topology, const Frame& frame);
};

}  // namespace trocar
