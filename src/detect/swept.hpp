// What happens between two frames: which of the candidates begin to touch on the way, by the exact continuous test.
// Kept apart from the cascades so that all of our detectors answer alike; they only have to find candidates in the
// boxes of both frames united (METHODS §2.3).
#pragma once

#include <span>
#include <vector>

#include "contact/contact.hpp"
#include "scene/world.hpp"

namespace trocar {

/// True when a vertex of the two triangles moved since the frame before: standing still, nothing begins.
bool either_moved(const Topology& topology, const Frame& frame, const TrianglePair& pair);

/// False when the boxes of the two triangles, on their way from frame.previous to frame.position, never come within
/// `query_distance` (m) at the same time: then they do so neither on the way nor at its ends. Precondition: both frames
/// are finite.
bool may_meet_on_path(const Topology& topology, const Frame& frame, const TrianglePair& pair, double query_distance);

/// Appends those of `candidates` (a < b) that do not intersect at frame.previous and meet on the way to frame.position,
/// in the same order. Precondition: both are finite.
void test_swept(const Topology& topology, const Frame& frame, std::span<const TrianglePair> candidates,
                std::vector<SweptContact>& swept);

/// True when the frame before is known and finite; otherwise nothing can be reported about the way.
bool has_path(const Topology& topology, const Frame& frame);

/// Puts a list in the order that ContactSet::swept asks for.
void sort_swept(std::vector<SweptContact>& swept);

}  // namespace trocar
