// Springs, masses and rest bias of a tissue body from its triangles (METHODS §4), in the flat arrays of Materials.
#pragma once

#include "geometry/enclosed_volume.hpp"
#include "scene/scene_settings.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Sizes the arrays of `materials` for a world with tissue; no vertex is tissue yet.
void prepare_tissue_arrays(const Topology& topology, Materials& materials);

/// Adds springs and vertex data of one body at rest in `position` (3×N, m). Springs: one per edge of non-zero length, k
/// = E h_t Σ A/L² over the edge's triangles (Van Gelder); mass: ρ h_t Σ A / 3; rest bias: −Σ T u on free vertices. With
/// several bodies, the largest number of sub-steps and the smallest strain limit hold for all. A bulk modulus adds an
/// enclosure of the body's triangles, which must form a closed surface with outward normals.
void add_tissue_body(const TissueSettings& settings, const Topology& topology, const BodyRange& body,
                     const Matrix3X& position, double dt, Materials& materials);

}  // namespace trocar
