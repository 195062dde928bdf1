// Exact decisions on triangle pairs whose corners are doubles: filtered orientation signs, used by detectors, and the
// intersection verdict of closed triangles with its class. Nothing is constructed, so rounding decides nothing.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "geometry/types.hpp"

namespace trocar {

/// Sign of the determinant |a-d, b-d, c-d|, exact: +1 when d lies below the plane of a, b, c, -1 above, 0 in the plane.
/// Seen from above, a, b, c are counter-clockwise. (Shewchuk 1997: filter (7 + 56 e) e · permanent with e = 2^-53, then
/// expansions.)
int orientation_sign(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// Classes of two closed triangles, named as in the data's tritri files.
enum class PairClass : std::uint8_t { disjoint, touch_vertex, touch_edge, coplanar_overlap, transversal, degenerate };
/// "disjoint", "touch-vertex", "touch-edge", "coplanar-overlap", "transversal", "degenerate".
std::string_view name_of(PairClass pair_class);

/// Three corners of a triangle; m or any unit.
using Corners = std::array<Vector3, 3>;
/// Corners of one of the `triangles` (3×T, into `position`).
inline Corners corners_of(const Triangles& triangles, const Matrix3X& position, Index triangle) {
    const auto corner = triangles.col(triangle);
    return {position.col(corner[0]), position.col(corner[1]), position.col(corner[2])};
}
/// Normal by the right-hand rule, twice as long as the area.
inline Vector3 area_normal(const Corners& corners) { return (corners[1] - corners[0]).cross(corners[2] - corners[0]); }
inline Box box_of(const Corners& corners) {
    return {corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]), corners[0].cwiseMax(corners[1]).cwiseMax(corners[2])};
}

/// True when the closed triangles share a point. Exact, also for degenerate triangles (segments, points). The project's
/// detectors decide with it. Precondition: all coordinates finite.
bool triangles_intersect(const Corners& first, const Corners& second);

/// The same verdict with its class; touch classes need exact arithmetic and are slower.
PairClass classify_pair(const Corners& first, const Corners& second);

/// A second, separate implementation for truth (rational arithmetic, no shared code with triangles_intersect).
PairClass oracle_class(const Corners& first, const Corners& second);
bool oracle_intersect(const Corners& first, const Corners& second);

}  // namespace trocar
