// Volume inside a closed triangle surface and its gradient, for volume constraints (METHODS §4).
#pragma once

#include "geometry/types.hpp"

namespace trocar {

/// Columns of three rows of any array whose columns are contiguous: a 3×N matrix, or the upper rows of a 4×N one.
using Points = Eigen::Ref<const Matrix3X, 0, Eigen::OuterStride<>>;
using PointsOut = Eigen::Ref<Matrix3X, 0, Eigen::OuterStride<>>;

/// Volume inside a closed surface with vertices `position` (m), m³; negative where it is turned inside out.
double enclosed_volume(const Triangles& triangles, const Points& position);

/// Adds factor × a third of the area normals around every vertex: factor × the volume gradient (m²) of a closed
/// surface. With a pressure (Pa, inside over outside) as the factor, these are the forces (N) on the vertices.
void add_volume_gradient(const Triangles& triangles, const Points& position, double factor, PointsOut sum);

/// Number of edges that triangles traverse more often in one direction than in the other: 0 for a closed surface.
Index open_edges(const Triangles& triangles);

}  // namespace trocar
