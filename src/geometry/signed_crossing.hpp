// Signed crossings of points with triangle surfaces, by exact signs of volumes. No crossing is lost or counted twice
// where triangles meet, so their sum gives the side. The winding number of a closed surface (orientation.hpp) is an
// independent method for the same answer.
#pragma once

#include <array>

#include "geometry/exact.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// +1 when the segment goes from the front of the triangle to its back, -1 from back to front, 0 without crossing.
[[nodiscard]] int segment_crossing(const Vector3& from, const Vector3& to, const Vector3& a, const Vector3& b,
                                   const Vector3& c);

/// Crossing of a point at rest by a triangle whose corners move from `p` to `q`, one after the other in ascending order
/// of `number`. +1 when the triangle passes over the point along its normal.
[[nodiscard]] int sweep_crossing(const Vector3& x, const std::array<Index, 3>& number, const Corners& p,
                                 const Corners& q);

}  // namespace trocar
