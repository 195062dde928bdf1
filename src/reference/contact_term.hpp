// Contribution of one contact to potential, gradient and stiffness of the reference solver, for any contact law.
#pragma once

#include <array>

#include "geometry/types.hpp"

namespace trocar {

/// Energy e(d) of a scalar d with ∂d/∂x_i = gradient_i.
struct ContactTerm {
    int count = 0;
    std::array<Index, 6> vertex{};
    std::array<Vector3, 6> gradient{};
    double slope = 0.0;      ///< e'(d), N
    double curvature = 0.0;  ///< e''(d), N/m
};

}  // namespace trocar
