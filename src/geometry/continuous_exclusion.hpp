// Exclusion in floating point: bisects time and place until no part of the two features can touch, with bounds that
// allow for rounding (inclusion; Snyder 1992). The query and the oracle ask it before anything dearer, since most
// features that come this far are apart.
#pragma once

#include <array>

#include "geometry/continuous.hpp"

namespace trocar::continuous {

constexpr int many_cells = 300;
constexpr int few_cells = 32;  ///< where there are other ways to decide

/// True when the features are apart all the time, without doubt; false says nothing. Points in the order of
/// continuous_exact.hpp; examines `cell_limit` parts of time and place at most.
bool vertex_face_apart(const std::array<MovingPoint, 4>& points, int cell_limit);
bool edge_edge_apart(const std::array<MovingPoint, 4>& points, int cell_limit);

}  // namespace trocar::continuous
