// Permutes the vertices and triangles of a mesh once, before any method prepares. All methods get the same order.
#pragma once

#include <vector>

#include "geometry/random.hpp"
#include "geometry/types.hpp"
#include "scene/shapes.hpp"

namespace trocar {

/// Sorts vertices along the Morton curve of their positions, and triangles along that of their centres. Entry k of the
/// result is the old number of vertex k.
std::vector<Index> renumber_along_curve(Surface& surface);

/// Random permutation of both; result as above.
std::vector<Index> shuffle(Surface& surface, Random& random);

}  // namespace trocar
