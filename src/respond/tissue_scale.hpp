// How large a tissue body is and how fast it moves by itself: what the stiffnesses and speeds of the contact handling
// are reported in, so that the same scene in another size or of another material is handled alike. No bound is a length
// of its own; what a user asks of the result (0.1 mm counts as clear) is.
#pragma once

#include <vector>

#include "scene/world.hpp"

namespace trocar {

struct TissueScale {
    double edge = 0.0;  ///< m, mean rest length of its springs
    double side = 0.0;  ///< m, side of a square as large as its surface at rest
    double wave_speed =
        0.0;  ///< m/s, sqrt(E / rho) of what its springs and masses amount to; infinite without mass or springs

    static constexpr double most_clear_depth = 1e-4;  ///< m, that counts as none: what a user asks for
};

/// One per body; all 0 for bodies that are no tissue. With k = E h ΣA/L² (METHODS §4) Σ k L² = 3 E h A over the springs
/// of a body and Σ m = rho h A over its vertices, whatever its mesh: wave_speed² = Σ k L² / (3 Σ m).
std::vector<TissueScale> tissue_scales(const Topology& topology, const Materials& materials);

}  // namespace trocar
