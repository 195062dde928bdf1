// The last step of our detectors: which of the candidate pairs really intersect. Kept apart from the cascades so that
// both decide with the same test and a study can swap it.
#pragma once

#include <span>
#include <vector>

#include "contact/contact.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Appends those of `candidates` that intersect to `pairs`, in the same order.
void test_pairs(const Topology& topology, const Frame& frame, std::span<const TrianglePair> candidates,
                std::vector<TrianglePair>& pairs);

}  // namespace trocar
