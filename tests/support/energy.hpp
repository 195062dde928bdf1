// Energy and momentum of tissue.
#pragma once

#include "geometry/types.hpp"
#include "scene/world.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar::test {

/// J, of motion, springs, preload, enclosures and rest bias, up to a constant.
inline double energy_of(const Materials& materials, const Frame& frame) {
    double energy = potential_energy(materials, frame.position);
    for (std::size_t v = 0; v < materials.mass.size(); ++v) {
        energy += 0.5 * materials.mass[v] * frame.velocity.col(static_cast<Eigen::Index>(v)).squaredNorm();
    }
    return energy;
}

/// N s.
inline Vector3 momentum_of(const Materials& materials, const Frame& frame) {
    Vector3 sum = Vector3::Zero();
    for (std::size_t v = 0; v < materials.mass.size(); ++v) {
        sum += materials.mass[v] * frame.velocity.col(static_cast<Eigen::Index>(v));
    }
    return sum;
}

}  // namespace trocar::test
