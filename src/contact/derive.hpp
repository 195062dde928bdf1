// Derives intersection contacts from sorted pairs and a frame (stage 4 of a tick). The code is the same for every
// detector, so that detectors with and without native contacts are comparable.
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
/// Depth is plane depth (METHODS §1); ties go to the lowest vertex number. n_ee is the common normal of the crossing
/// edges, on the side of interval_direction; for nearly parallel edges (sine below 1e-3) it is interval_direction.
/// d_ee = interval_length · (n_ee · interval_direction) is the motion of b along n_ee at which the edges' lines touch.
/// touch: geometry of the underlying case, no response. coplanar and degenerate: only a, b and kind are set.
/// A reported pair whose triangles share no point keeps kind `unset`.
void derive(const Topology& topology, const Frame& frame, ContactSet& contacts);

Contact derive_contact(const Topology& topology, const Frame& frame, TrianglePair pair);

}  // namespace trocar
