// Contacts that begin between two frames, by the exact continuous test. All of the project's detectors share it; they
// only find candidates in the united boxes of both frames (METHODS §2.3).
#pragma once

#include <span>
#include <vector>

#include "contact/contact.hpp"
#include "scene/world.hpp"

namespace trocar {

/// True when a vertex of the two triangles moved since the frame before; without motion no contact begins.
bool either_moved(const Topology& topology, const Frame& frame, const TrianglePair& pair);

/// False when the moving boxes of the two triangles, from frame.previous to frame.position, are never within
/// `query_distance` (m) at the same time, ends included. Precondition: both frames are finite.
bool may_meet_on_path(const Topology& topology, const Frame& frame, const TrianglePair& pair, double query_distance);

/// Appends those of `candidates` (a < b) that do not intersect at frame.previous and meet before frame.position, in the
/// same order. Precondition: both frames are finite.
void test_swept(const Topology& topology, const Frame& frame, std::span<const TrianglePair> candidates,
                std::vector<SweptContact>& swept);

/// True when the frame before is given and finite, as the swept test needs.
bool has_path(const Topology& topology, const Frame& frame);

/// Sorts in the order that ContactSet::swept requires.
void sort_swept(std::vector<SweptContact>& swept);

}  // namespace trocar
