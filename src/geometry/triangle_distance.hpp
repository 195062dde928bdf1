// Distance and closest points of two triangles. Every detector decides its near pairs with it, so that detectors differ
// only in their candidates. The intersection test is in exact.hpp.
#pragma once

#include "geometry/exact.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// The point of a triangle with these barycentric weights.
inline Vector3 point_at(const Corners& triangle, const Vector3& weights) {
    return weights[0] * triangle[0] + weights[1] * triangle[1] + weights[2] * triangle[2];
}

/// Barycentric weights of the point of a closed triangle that is nearest to `point`: >= 0, sum 1. Weights are exactly 0
/// for corners outside the nearest edge or corner. Valid for triangles that are segments or points.
Vector3 closest_point_on_triangle(const Corners& triangle, const Vector3& point);
/// Barycentric weights of the orthogonal projection of `point` on the triangle's plane; sum 1, negative beyond an edge.
/// Not finite for a triangle without area.
Vector3 projection_on_plane(const Corners& triangle, const Vector3& point);

/// Closest points of two triangles.
struct TriangleDistance {
    double squared_distance = 0.0;    ///< m²
    Vector3 first = Vector3::Zero();  ///< barycentric weights of the point of the first triangle
    Vector3 second = Vector3::Zero();
};
/// Distance of two closed triangles of any shape. For intersecting triangles it is the least vertex-face or edge-edge
/// distance, not zero: test triangles_intersect first.
TriangleDistance triangle_distance(const Corners& first, const Corners& second);

/// Whether the distance of two triangles is at most `query_distance` (m): the verdict of triangle_distance, with early
/// exits. Precondition: the triangles do not meet.
bool is_within_query_distance(const Corners& first, const Corners& second, double query_distance);

}  // namespace trocar
