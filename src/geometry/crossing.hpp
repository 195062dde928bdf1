// The triangle-triangle interval test with what a contact response needs beyond yes and no: plane distances, overlap
// case, interval length and end points (METHODS §3; Möller 1997). Modes: moller (float reference behaviour), interval
// (double, relative tolerance); the exact verdict is in exact.hpp.
#pragma once

#include <array>
#include <cstdint>

#include "geometry/exact.hpp"
#include "geometry/types.hpp"

namespace trocar {

enum class CrossingKind : std::uint8_t { none, touch, crossing, coplanar, degenerate };
/// first_enters_second: first's interval lies inside second's (a vertex of first pierces face second).
enum class CrossingCase : std::uint8_t { unset, first_enters_second, second_enters_first, edges_cross };

/// Where an end of an interval comes from: edge `edge` (from corner edge to corner edge+1 mod 3) of triangle 0 or 1.
struct CrossingEnd {
    int triangle = -1;
    int edge = -1;
    Vector3 point = Vector3::Constant(std::numeric_limits<double>::quiet_NaN());  ///< m, world
};

struct Crossing {
    CrossingKind kind = CrossingKind::none;
    CrossingCase overlap_case = CrossingCase::unset;
    std::array<double, 3> first_depth{};     ///< depth of first's corners below second's plane, m, positive inside
    std::array<double, 3> second_depth{};    ///< depth of second's corners below first's plane, m
    Vector3 first_normal = Vector3::Zero();  ///< unit outer normal of first
    Vector3 second_normal = Vector3::Zero();
    Vector3 direction = Vector3::Zero();  ///< unit; +L or -L such that moving second along it by `length` parts the two
    double length = 0.0;                  ///< m, metric length of the overlap of the two intervals
    std::array<double, 2> first_interval{};  ///< m, along `direction`
    std::array<double, 2> second_interval{};
    std::array<CrossingEnd, 2> ends{};  ///< ends of the overlap
};

/// Double precision, tolerance 1e-12 m × |N| on plane distances, translated to first's corner 0 before crossing.
Crossing cross_triangles(const Corners& first, const Corners& second);

/// The thesis' yardstick: Möller's routine in float with its absolute 1e-6, coordinates taken as metres and scaled to
/// millimetres inside (METHODS §3.2). Fails on near-coplanar, touching and huge-offset pairs; kept so it can be shown.
bool moller_intersect(const Corners& first, const Corners& second);

}  // namespace trocar
