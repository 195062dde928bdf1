// How far apart two triangles are and where they are closest: the leaf that every detector decides its near pairs with,
// so that detectors differ only in the candidates they bring. Whether triangles meet is decided in exact.hpp, not here.
#pragma once

#include "geometry/exact.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// The point of a triangle with these barycentric weights.
inline Vector3 point_at(const Corners& triangle, const Vector3& weights) {
    return weights[0] * triangle[0] + weights[1] * triangle[1] + weights[2] * triangle[2];
}

/// Barycentric weights of the point of a closed triangle that is nearest to `point`; >= 0, sum 1, exactly 0 for the
/// corners that the point's edge or corner leaves out. Triangles that are segments or points included.
Vector3 closest_point_on_triangle(const Corners& triangle, const Vector3& point);
/// Barycentric weights of the orthogonal projection of `point` on the triangle's plane; sum 1, negative beyond an edge.
/// Not finite for a triangle without area.
Vector3 projection_on_plane(const Corners& triangle, const Vector3& point);

/// Places on two closed segments, in [0, 1] from their first end to their second, exactly 0 or 1 at an end.
struct SegmentPlaces {
    double first = 0.0;
    double second = 0.0;
};
/// Where the segments p0 p1 and q0 q1 are closest; of parallel ones, one of the choices. Segments that are points
/// included.
SegmentPlaces closest_points_of_segments(const Vector3& p0, const Vector3& p1, const Vector3& q0, const Vector3& q1);

/// Where two triangles are closest.
struct TriangleDistance {
    double squared_distance = 0.0;    ///< m²
    Vector3 first = Vector3::Zero();  ///< barycentric weights of the point of the first triangle
    Vector3 second = Vector3::Zero();
};
/// Of two closed triangles of any shape. Of triangles that cross this is the distance from a corner to the other
/// triangle, or of an edge from an edge, whichever is least, and not zero: ask triangles_intersect first.
TriangleDistance triangle_distance(const Corners& first, const Corners& second);

/// Whether the distance of two triangles is at most `query_distance` (m), decided as triangle_distance would, with as
/// little work as the answer needs. Precondition: the triangles do not meet.
bool is_within_query_distance(const Corners& first, const Corners& second, double query_distance);

}  // namespace trocar
