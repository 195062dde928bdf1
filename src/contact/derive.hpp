// Stage 4 of a tick, the same for every detector: turns sorted pairs and a frame into canonical contacts, so that
// detectors that stop at pairs and libraries with rich native contacts become comparable.
#pragma once

#include "contact/contact_set.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Fills contacts.contacts, one per entry of contacts.pairs in the same order (METHODS §3.1: case, point, normal from a
/// to b, plane depth, interval length and direction, nearest vertices). Allocates only while the buffer grows.
void derive(const Topology& topology, const Frame& frame, ContactSet& contacts);

}  // namespace trocar
