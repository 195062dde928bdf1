// Size and wave speed of a tissue body, by which stiffnesses and speeds of the contact handling scale. The same scene
// in another size or material is then treated alike. The only absolute length is the user's tolerance most_clear_depth.
#pragma once

#include <vector>

#include "scene/world.hpp"

namespace trocar {

struct TissueScale {
    double edge = 0.0;        ///< m, mean rest length of its springs
    double side = 0.0;        ///< m, side of a square as large as its surface at rest
    double wave_speed = 0.0;  ///< m/s, sqrt(E / rho) of its springs and masses; infinite without either

    static constexpr double most_clear_depth = 1e-4;  ///< m, depth that counts as clear: a user's tolerance
};

/// One per body; all 0 for bodies that are no tissue. wave_speed² = Σ k L² / (3 Σ m), whatever the mesh. With k = E h
/// ΣA/L² (METHODS §4), Σ k L² = 3 E h A over a body's springs. Over its vertices, Σ m = rho h A.
std::vector<TissueScale> tissue_scales(const Topology& topology, const Materials& materials);

}  // namespace trocar
