// How deep the edges of one body pass through a closed other one. Vertices and points spread over an area miss what a
// rim or a fold has inside a thin tool between them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>

#include "geometry/types.hpp"
#include "measure/ray_tree.hpp"

namespace trocar {

struct EdgeDepth {
    double depth = 0.0;          ///< m, of the deepest point found on an edge; 0 when none is inside
    std::int64_t stretches = 0;  ///< parts of edges inside, each counted once
};

/// Cuts the edges (vertex numbers; of pairs that stand there both ways the rising one) where they pass through the
/// closed surface in `rays`, and looks along each part that is inside for its deepest point: at seven points, then
/// around the deepest of them by halved steps, 1/512 of the part at last. Whether a point is inside is decided exactly
/// (winding number); where the edge is cut only guides the search, so that rounding there loses no more than a part
/// shorter than rounding. `distance` says how far a point is from the surface, m.
EdgeDepth edge_depth(const Triangles& triangles, const Matrix3X& position, std::span<const std::array<Index, 2>> edges,
                     const RayTree& rays, const std::function<double(const Vector3&)>& distance);

}  // namespace trocar
