// Depth of the edges of one body inside a closed one. Samples at vertices and over an area do not cover a rim or a fold
// inside a thin tool.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>

#include "geometry/types.hpp"
#include "measure/ray_tree.hpp"

namespace trocar {

struct EdgeDepth {
    double depth = 0.0;          ///< m, of the deepest point found on an edge, or `at_least`
    std::int64_t stretches = 0;  ///< parts of edges inside, each counted once
};

/// Cuts the edges at the closed surface in `rays` and searches each inner part for its deepest point. The search
/// evaluates seven points, then halves its step around the deepest one down to 1/512 of the part. The winding number
/// decides exactly whether a point is inside. The cuts only guide the search, so that their rounding loses at most a
/// part of that length. `edges`: vertex numbers; of both directions of an edge the ascending one counts. `distance`:
/// distance of a point to the surface, m; within its second argument any distance to it. `at_least`: m; parts that are
/// no deeper are not searched.
EdgeDepth edge_depth(const Triangles& triangles, const Matrix3X& position, std::span<const std::array<Index, 2>> edges,
                     const RayTree& rays, const std::function<double(const Vector3&, double)>& distance,
                     double at_least = 0.0);

}  // namespace trocar
