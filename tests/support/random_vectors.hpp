// Random vectors in a fixed draw order, since C++ leaves the evaluation order of arguments unspecified.
#pragma once

#include <random>

#include "geometry/types.hpp"

namespace trocar::test {

/// Draws z, y, x: GCC's argument order, on which stored expectations depend.
template <typename Distribution, typename Random>
Vector3 random_vector(Distribution& distribution, Random& random) {
    Vector3 drawn;
    for (Eigen::Index i = 2; i >= 0; --i) drawn[i] = distribution(random);
    return drawn;
}

/// Draws z, y, x, w of a unit quaternion: uniform over rotations for a normal distribution.
template <typename Distribution, typename Random>
Eigen::Quaterniond random_turn(Distribution& distribution, Random& random) {
    const Vector3 axis = random_vector(distribution, random);
    const double w = distribution(random);
    return Eigen::Quaterniond(w, axis.x(), axis.y(), axis.z()).normalized();
}

}  // namespace trocar::test
