// Continuous collision tests for corners that move on straight lines during a tick. Exact for corners given as doubles,
// so that "crossed within the tick" can be truth for detectors that see only the ends of ticks.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "geometry/types.hpp"

namespace trocar {

/// A point that moves from start (time 0) to end (time 1): x(t) = start + t (end - start), m or any unit.
struct MovingPoint {
    Vector3 start;
    Vector3 end;
};
/// Motion of `a` relative to `b`.
inline MovingPoint operator-(const MovingPoint& a, const MovingPoint& b) { return {a.start - b.start, a.end - b.end}; }
using MovingEdge = std::array<MovingPoint, 2>;
using MovingTriangle = std::array<MovingPoint, 3>;
/// One of the `triangles` (3×T, into both positions).
inline MovingTriangle moving_triangle(const Triangles& triangles, const Matrix3X& start, const Matrix3X& end,
                                      Index triangle) {
    MovingTriangle result;
    for (int k = 0; k < 3; ++k) result[at(k)] = {start.col(triangles(k, triangle)), end.col(triangles(k, triangle))};
    return result;
}

/// Earliest time in [0, 1] at which the two closed sets share a point, rounded down to a multiple of 2^-53; empty when
/// they never do. The yes/no answer is exact, also for degenerate edges and faces, motion in one plane and no motion.
/// Clear cases are decided by floating point with error bounds, on the roots of the coplanarity polynomial (a cubic in
/// Bernstein form; Provot 1997). Times and most boundary cases take double-double and integers of fixed size; the rest
/// takes the oracle's method. Precondition: finite coordinates. Cost per pair of triangles: about 3 µs; 30 µs where
/// features meet at corners or in one plane. A few of these need 0.3 ms, and only they allocate.
std::optional<double> first_contact(const MovingPoint& vertex, const MovingTriangle& face);
std::optional<double> first_contact(const MovingEdge& first, const MovingEdge& second);
/// Earliest of the six vertex-face and nine edge-edge contacts, or 0 for triangles that intersect at time 0.
std::optional<double> first_contact(const MovingTriangle& first, const MovingTriangle& second);

/// Kind of the first contact; a tie of the last two is vertex_face.
enum class Meeting : std::uint8_t { overlap_at_start, vertex_face, edge_edge };
struct FirstMeeting {
    double time = 0.0;  ///< as first_contact
    Meeting kind = Meeting::overlap_at_start;
};
/// first_contact with its kind.
std::optional<FirstMeeting> first_meeting(const MovingTriangle& first, const MovingTriangle& second);

/// The same answers by integers alone, for truth. Bisection of (time, place) with bounds that allow for rounding
/// excludes candidates (inclusion; Snyder 1992). The rest is decided on the roots of the coplanarity polynomial,
/// isolated by Sturm sequences in integers. Shares no shortcut with first_contact.
std::optional<double> oracle_first_contact(const MovingPoint& vertex, const MovingTriangle& face);
std::optional<double> oracle_first_contact(const MovingEdge& first, const MovingEdge& second);
std::optional<double> oracle_first_contact(const MovingTriangle& first, const MovingTriangle& second);

}  // namespace trocar
