// Exclusion in floating point: bisects time and place until no part of the two features can touch, with bounds that
// allow for rounding (inclusion; Snyder 1992). The query and the oracle run it before costlier stages, since most
// features that come this far are apart.
#pragma once

#include <array>

#include "geometry/continuous.hpp"

namespace trocar::continuous {

constexpr int many_cells = 300;
constexpr int few_cells = 32;  ///< used where another stage can decide

/// True when the features are certainly apart all the time; false decides nothing. Points in the order of
/// continuous_exact.hpp. Examines at most `cell_limit` parts of time and place.
bool vertex_face_apart(const std::array<MovingPoint, 4>& points, int cell_limit);
bool edge_edge_apart(const std::array<MovingPoint, 4>& points, int cell_limit);

}  // namespace trocar::continuous
