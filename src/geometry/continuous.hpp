// Do two things touch at any time during a tick in which every corner moves on a straight line? Exact for corners given
// as doubles, so that "crossed within the tick" can be truth for detectors that only see the ends of ticks.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "geometry/types.hpp"

namespace trocar {

/// A point on its way from start (time 0) to end (time 1): x(t) = start + t (end - start), m or any unit.
struct MovingPoint {
    Vector3 start;
    Vector3 end;
};
/// The way of one point as seen from another.
inline MovingPoint operator-(const MovingPoint& a, const MovingPoint& b) { return {a.start - b.start, a.end - b.end}; }
using MovingEdge = std::array<MovingPoint, 2>;
using MovingTriangle = std::array<MovingPoint, 3>;

/// Earliest time in [0, 1] at which the two closed sets share a point, rounded down to a multiple of 2^-53; nothing
/// when they never do. Whether they do is decided without rounding, degenerate edges and faces, motion in one plane and
/// standing still included: floating point with error bounds decides the clear cases on the roots of the coplanarity
/// polynomial (a cubic in Bernstein form; Provot 1997), moments and most boundary cases are settled in double-double
/// and integers of fixed size, the rest goes the way of the oracle below. Precondition: finite coordinates. A pair of
/// triangles costs some 3 µs, one whose features meet at corners or in one plane some 30, a few of these (the only that
/// allocate) 0.3 ms.
std::optional<double> first_contact(const MovingPoint& vertex, const MovingTriangle& face);
std::optional<double> first_contact(const MovingEdge& first, const MovingEdge& second);
/// All six vertex-face and nine edge-edge contacts, and triangles that intersect at time 0.
std::optional<double> first_contact(const MovingTriangle& first, const MovingTriangle& second);

/// What meets first; a tie of the two kinds is vertex_face.
enum class Meeting : std::uint8_t { overlap_at_start, vertex_face, edge_edge };
struct FirstMeeting {
    double time = 0.0;  ///< as first_contact
    Meeting kind = Meeting::overlap_at_start;
};
/// first_contact with its kind.
std::optional<FirstMeeting> first_meeting(const MovingTriangle& first, const MovingTriangle& second);

/// The same answers by integers alone, for truth: candidates are excluded by bisecting (time, place) with bounds that
/// allow for rounding (inclusion; Snyder 1992), what is left is decided on the roots of the coplanarity polynomial,
/// isolated by Sturm sequences in integers. Shares no shortcut with first_contact.
std::optional<double> oracle_first_contact(const MovingPoint& vertex, const MovingTriangle& face);
std::optional<double> oracle_first_contact(const MovingEdge& first, const MovingEdge& second);
std::optional<double> oracle_first_contact(const MovingTriangle& first, const MovingTriangle& second);

}  // namespace trocar
