// Exact decisions on triangle pairs whose corners are doubles: filtered orientation signs that detectors use, and
// the closed-triangle intersection verdict with its class. No construction is made, so no rounding decides anything.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "geometry/types.hpp"

namespace trocar {

/// Sign of the determinant |a-d, b-d, c-d|, exact: +1 when d lies below the plane of a, b, c (counter-clockwise seen
/// from above), -1 above, 0 in the plane. (Shewchuk 1997: filter (7 + 56 e) e · permanent with e = 2^-53, then
/// expansions.)
int orientation_sign(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// How two closed triangles meet; the words of the data's tritri files.
enum class PairClass : std::uint8_t { disjoint, touch_vertex, touch_edge, coplanar_overlap, transversal, degenerate };
/// "disjoint", "touch-vertex", "touch-edge", "coplanar-overlap", "transversal", "degenerate".
std::string_view name_of(PairClass pair_class);

/// Three corners of a triangle; m or any unit.
using Corners = std::array<Vector3, 3>;

/// True when the closed triangles share a point. Exact, degenerate triangles (segments, points) included. The test our
/// detectors decide with. Precondition: all coordinates finite.
bool triangles_intersect(const Corners& first, const Corners& second);

/// Same question with the answer's class; touch classes need exact arithmetic and are slower.
PairClass classify_pair(const Corners& first, const Corners& second);

/// A second, separate implementation for truth (rational arithmetic, no shared code with triangles_intersect).
PairClass oracle_class(const Corners& first, const Corners& second);
bool oracle_intersect(const Corners& first, const Corners& second);

}  // namespace trocar
