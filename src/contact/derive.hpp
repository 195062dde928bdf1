// Stage 4 of a tick, the same for every detector: turns sorted pairs and a frame into intersection contacts, so that
// detectors that stop at pairs and libraries with rich native contacts become comparable.
#pragma once

#include "contact/contact_set.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Fills contacts.contacts, one per entry of contacts.pairs in the same order. Allocates only while the buffer grows.
///
/// | kind        | vertex_a, vertex_b            | normal (a to b)  | depth               | point            |
/// |-------------|-------------------------------|------------------|---------------------|------------------|
/// | a_enters_b  | deepest of a; nearest of b    | -normal of b     | of vertex_a below b | vertex_a         |
/// | b_enters_a  | nearest of a; deepest of b    | normal of a      | of vertex_b below a | vertex_b         |
/// | edges_cross | closest two corners           | n_ee (METHODS §6)| d_ee                | overlap's middle |
///
/// Depth is plane depth (METHODS §1), the lowest vertex number wins ties. n_ee is normal to the two edges that cross,
/// on the side of interval_direction; d_ee = interval_length · (n_ee · interval_direction) is how far b must move along
/// n_ee until the edges' lines touch; for nearly parallel edges (sine below 1e-3) n_ee is interval_direction itself.
/// touch: geometry of the case it would be, no response. coplanar and degenerate: only a, b and kind are set.
/// A pair of baselines' making whose triangles share no point keeps kind `unset`.
void derive(const Topology& topology, const Frame& frame, ContactSet& contacts);

/// The intersection contact of one pair; what derive does for each.
Contact derive_contact(const Topology& topology, const Frame& frame, TrianglePair pair);

}  // namespace trocar
