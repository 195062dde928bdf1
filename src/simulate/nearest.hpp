// Where two bodies came nearest: what a run without any contact has to report, since most often a body is not where its
// author thinks it is.
#pragma once

#include <cstdint>
#include <limits>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

/// The nearest that two bodies that may meet have been to each other.
struct NearestApproach {
    double distance = std::numeric_limits<double>::infinity();  ///< m between their surfaces
    std::int64_t tick = -1;                                     ///< -1: no frame has been examined
    Index body_a = 0;
    Index body_b = 0;
    Box box_a;  ///< m, of body_a in that frame
    Box box_b;

    /// Takes the frame's nearest pair of triangles if it is nearer than all before. Precondition: none meet
    /// (triangle_distance.hpp). Non-finite vertices count as nowhere. Cost falls with what was near before.
    void observe(const Topology& topology, const Frame& frame);
};

}  // namespace trocar
