// A run as a glTF 2.0 animation in one binary file, for browsers, Blender and slides.
#pragma once

#include "export/exporter.hpp"

namespace trocar {

/// NAME.glb: metres, seconds, +Y up (the world's z). Rigid parts (connected parts of instruments and rigid bodies) are
/// moving nodes. Deformable bodies are meshes with one morph target per frame after the first. Each kind of body has a
/// colour. Interpolation between frames is linear (rotations by the shorter arc). Numbers are 32-bit, as offsets from
/// the middle of the first frame. One frame alone gives a static picture. Takes most_frames frames.
std::unique_ptr<Exporter> gltf_exporter(const Topology& topology, const std::string& name,
                                        const std::filesystem::path& folder);

}  // namespace trocar
