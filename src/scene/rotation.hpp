// Rotations from +, -, *, / and square root only, so that a scene has the same bits on every machine and compiler. Sine
// and cosine of C libraries may differ in the last bit.
#pragma once

#include "geometry/types.hpp"

namespace trocar {

struct SineCosine {
    double sine = 0.0;
    double cosine = 1.0;
};

/// Any finite angle, degrees. Error below 2e-16; exact at multiples of 90 degrees.
SineCosine sine_cosine_of_degrees(double degrees);

/// Rotation by |vector| degrees about `vector`, which must be finite; identity for a zero vector.
Quaternion rotation_from_degrees(const Vector3& vector);

/// Interpolates unit rotations on the shortest arc: `from` at u = 0, `to` at u = 1.
Quaternion shortest_arc(const Quaternion& from, const Quaternion& to, double u);

}  // namespace trocar
