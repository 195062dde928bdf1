// Distance of a point to a triangle surface, for truth: exhaustive search, pruned by a box tree that no method uses.
#pragma once

#include "geometry/distance_tree.hpp"

namespace trocar {

/// Squared distance of p to the closed triangle a, b, c; degenerate triangles (segments, points) included; m².
double squared_distance_to_triangle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& p);

class SurfaceDistance : public DistanceTree {
public:
    /// Distance of p to the surface as last refitted, m; infinite for an empty surface. A search that finds a triangle
    /// within `enough` (m) ends there and returns that distance.
    [[nodiscard]] double distance(const Triangles& triangles, const Matrix3X& position, const Vector3& p,
                                  double enough = 0.0) const;

    /// Upper bound on the distance of every point of the segment from p to q to the surface, m. It is the least over
    /// the triangles of the distance to the farther end. The distance to a convex set is convex along a line, so that
    /// it is largest at an end. A search that finds a bound within `enough` ends there and returns that one.
    [[nodiscard]] double bound_along(const Triangles& triangles, const Matrix3X& position, const Vector3& p,
                                     const Vector3& q, double enough) const;
};

}  // namespace trocar
