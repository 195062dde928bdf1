// Volume inside a closed triangle surface and how it changes with the vertices: what a volume constraint is made of
// (METHODS §4).
#pragma once

#include "geometry/types.hpp"

namespace trocar {

/// Columns of three rows of any array whose columns are contiguous: a 3×N matrix, the upper rows of a 4×N one.
using Points = Eigen::Ref<const Matrix3X, 0, Eigen::OuterStride<>>;
using PointsOut = Eigen::Ref<Matrix3X, 0, Eigen::OuterStride<>>;

/// Volume inside a closed surface with vertices `position` (m), m³; negative where it is turned inside out.
double enclosed_volume(const Triangles& triangles, const Points& position);

/// Adds factor × a third of the area normals around every vertex: of a closed surface that is factor × the gradient of
/// its volume (m²). With a pressure (Pa, inside over outside) as the factor these are the forces (N) on the vertices.
void add_volume_gradient(const Triangles& triangles, const Points& position, double factor, PointsOut sum);

/// Edges that the triangles run along more often one way than the other: 0 for a closed surface.
Index open_edges(const Triangles& triangles);

}  // namespace trocar
