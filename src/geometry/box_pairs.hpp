// Neutral candidates: all pairs of triangles whose closed bounding boxes overlap, by sweep along one axis. Truth and
// narrow-phase-only baselines use them, so that neither depends on a method under test.
#pragma once

#include <vector>

#include "geometry/types.hpp"

namespace trocar {

struct IndexPair {
    Index first = -1;
    Index second = -1;
    auto operator<=>(const IndexPair&) const = default;
};

/// Boxes of `triangles` (3×T, into position). Non-finite corners give an empty box.
void triangle_boxes(const Matrix3X& position, const Triangles& triangles, std::vector<Box>& boxes);

/// All (i, j), i in `first`, j in `second`, with overlapping boxes; sorted, each once.
void overlapping_boxes(const std::vector<Box>& boxes, Range first, Range second, std::vector<IndexPair>& pairs);

}  // namespace trocar
