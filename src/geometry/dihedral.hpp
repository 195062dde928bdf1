// The angle of two triangles at their common edge, and how it changes with their corners: what a hinge that resists
// bending is made of (METHODS §4).
#pragma once

#include <array>

#include "geometry/types.hpp"

namespace trocar {

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
