// What one contact adds to potential, gradient and stiffness of the reference solver, whichever its law.
#pragma once

#include <array>

#include "geometry/types.hpp"

namespace trocar {

/// A contact's part in potential, gradient and stiffness: energy e(d) of a scalar d with ∂d/∂x_i = gradient_i.
struct ContactTerm {
    int count = 0;
    std::array<Index, 6> vertex{};
    std::array<Vector3, 6> gradient{};
    double slope = 0.0;      ///< e'(d), N
    double curvature = 0.0;  ///< e''(d), N/m
};

}  // namespace trocar
