// Random vectors that are the same with every compiler: the order in which a call's arguments are drawn is not laid
// down.
#pragma once

#include <random>

#include "geometry/types.hpp"

namespace trocar::test {

/// z, y and x, drawn in this order: GCC's, in which the families were first drawn and gaps became known.
template <typename Distribution, typename Random>
Vector3 random_vector(Distribution& distribution, Random& random) {
    Vector3 drawn;
    for (Eigen::Index i = 2; i >= 0; --i) drawn[i] = distribution(random);
    return drawn;
}

/// With the unit quaternion along z, y, x and w, drawn in this order: evenly spread where the distribution is normal.
template <typename Distribution, typename Random>
Eigen::Quaterniond random_turn(Distribution& distribution, Random& random) {
    const Vector3 axis = random_vector(distribution, random);
    const double w = distribution(random);
    return Eigen::Quaterniond(w, axis.x(), axis.y(), axis.z()).normalized();
}

}  // namespace trocar::test
