// Depth of the edges of one body inside a closed one. Samples at vertices and over an area do not cover a rim or a fold
// inside a thin tool.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "geometry/types.hpp"
#include "measure/ray_tree.hpp"
#include "measure/surface_distance.hpp"

namespace trocar {

struct EdgeDepth {
    double depth = 0.0;          ///< m, of the deepest point found on an edge, or `at_least`
    std::int64_t stretches = 0;  ///< parts of edges inside, each counted once
};

/// Stands for a vertex that is not inside, in place of a bound on its depth.
inline constexpr double not_inside = -1.0;

/// Cuts the edges at the closed surface in `rays`. Branch and bound searches each inner part for its deepest point,
/// down to 1/512 of the part. The winding number decides exactly whether a point is inside. The cuts only guide the
/// search, so that their rounding loses at most a part of that length. An edge that comes near no triangle is on
/// the side of its ends. `edges`: vertex numbers; of both directions of an edge the ascending one counts. `surface`:
/// the same triangles as in `rays`. `vertex_bounds`: per vertex number, an upper bound on the depth of a vertex inside,
/// m, or `not_inside`. `at_least`: m; parts that are no deeper are not searched.
EdgeDepth edge_depth(const Triangles& triangles, const Matrix3X& position, std::span<const std::array<Index, 2>> edges,
                     const RayTree& rays, const SurfaceDistance& surface, std::span<const double> vertex_bounds,
                     double at_least = 0.0);

}  // namespace trocar
