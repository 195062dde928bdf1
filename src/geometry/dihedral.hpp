// The angle of two triangles at their common edge, and how it changes with their corners: what a hinge that resists
// bending is made of (METHODS §4).
#pragma once

#include <array>

#include "geometry/types.hpp"

namespace trocar {

/// Angle of the direction (x, y), rad, −π to π: std::atan2 to a few units of the last place, by operations whose answer
/// is the same on every machine, which that of the C library is not. (0, 0) has none: not a number.
double angle_of(double y, double x);

/// (-1)^k / (2k + 1): arctan v = v Σ series[k] v^2k, to the last place for |v| ≤ tan(π/16), to which angle_of halves.
inline constexpr std::array<double, 12> arctangent_series{1.0,        -1.0 / 3.0,  1.0 / 5.0,  -1.0 / 7.0,
                                                          1.0 / 9.0,  -1.0 / 11.0, 1.0 / 13.0, -1.0 / 15.0,
                                                          1.0 / 17.0, -1.0 / 19.0, 1.0 / 21.0, -1.0 / 23.0};

/// Corners of two triangles (c0, c1, c2) and (c1, c0, c3), counter-clockwise seen from the front; c0 c1 is the edge, m.
using HingeCorners = std::array<Vector3, 4>;

struct Dihedral {
    double angle = 0.0;               ///< rad, −π to π; 0 flat, > 0 where the edge stands out to the front
    std::array<Vector3, 4> gradient;  ///< rad/m, of the angle, per corner; they sum to 0 and have no moment
    bool has_angle = false;           ///< false: a triangle has no area; angle and gradient are 0 then
};

Dihedral dihedral(const HingeCorners& corner);

/// Change of the gradient when the corners move by `displacement`, to first order: the angle's second derivative
/// applied to it, rad/m per unit of displacement. 0 where there is no angle.
std::array<Vector3, 4> gradient_change(const HingeCorners& corner, const std::array<Vector3, 4>& displacement);

}  // namespace trocar
