// The triangle-triangle interval test with data for a contact response: plane distances, overlap case, interval length
// and end points (METHODS §3; Möller 1997). Modes: moller (float reference behaviour), interval (double, relative
// tolerance). The exact verdict is in exact.hpp.
#pragma once

#include <array>
#include <cstdint>

#include "geometry/exact.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// degenerate: an altitude of either triangle is below 1 µm. coplanar: one triangle lies in the other's plane (within
/// the tolerance) and the two overlap there. touch: overlap and depth both at most 1 nm.
enum class CrossingKind : std::uint8_t { none, touch, crossing, coplanar, degenerate };
/// first_enters_second: first's interval lies inside second's (a vertex of first pierces face second). Inclusion has a
/// tolerance of 1 nm; equal intervals count as second_enters_first.
enum class CrossingCase : std::uint8_t { unset, first_enters_second, second_enters_first, edges_cross };

/// End of an interval, on edge `edge` (from corner edge to corner edge+1 mod 3) of triangle 0 or 1.
struct CrossingEnd {
    int triangle = -1;
    int edge = -1;
    Vector3 point = Vector3::Constant(not_known);  ///< m, world
};

/// All fields are set for kinds touch and crossing, depths and normals for all but degenerate; the others are NaN.
struct Crossing {
    CrossingKind kind = CrossingKind::none;
    CrossingCase overlap_case = CrossingCase::unset;
    std::array<double, 3> first_depth{not_known, not_known,
                                      not_known};  ///< of first's corners below second's plane, m, + inside
    std::array<double, 3> second_depth{not_known, not_known,
                                       not_known};        ///< of second's corners below first's plane, m, + inside
    Vector3 first_normal = Vector3::Constant(not_known);  ///< unit outer normal of first
    Vector3 second_normal = Vector3::Constant(not_known);
    /// Unit, along the common line of the planes, from the middle of first's interval to the middle of second's. A
    /// shift of second along it by `length` separates the two (thesis eq. 3.5 and 3.9; orientation METHODS §6).
    Vector3 direction = Vector3::Constant(not_known);
    double length = not_known;  ///< m, metric length of the overlap of the two intervals, >= 0
    std::array<double, 2> first_interval{not_known,
                                         not_known};  ///< m, along `direction` from first's corner 0, ascending
    std::array<double, 2> second_interval{not_known, not_known};
    /// Ends of the overlap along `direction`: both of the entering triangle, or one of each where edges cross.
    std::array<CrossingEnd, 2> ends{};
};

/// Computes in double, relative to first's corner 0. Plane distances up to 1e-12 m count as 0, interval ends up to
/// 1e-12 m apart as touching. Precondition: finite coordinates.
Crossing cross_triangles(const Corners& first, const Corners& second);

/// Verdict of the same test without the altitude rule: the result of `interval` for a bare pair. May err where the
/// margin is within 1e-12 m + 1e-15·size²/(altitude·sine): largest distance between corners, smallest altitude, angle
/// between the planes. Two segments or points never meet.
bool interval_intersect(const Corners& first, const Corners& second);

/// Möller's routine in float with its absolute 1e-6, the thesis' reference (METHODS §3.2). Coordinates are in metres,
/// scaled to millimetres inside. Fails on near-coplanar, touching and huge-offset pairs; kept to show these failures.
bool moller_intersect(const Corners& first, const Corners& second);

}  // namespace trocar
