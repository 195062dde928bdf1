// A run as a glTF 2.0 animation in one binary file, for browsers, Blender and slides.
#pragma once

#include "export/exporter.hpp"

namespace trocar {

/// NAME.glb: metres, seconds, +Y up (the world's z). What moves rigidly (the connected parts of instruments and rigid
/// bodies) is a node that moves; what deforms is a mesh with one morph target per frame after the first, and a colour
/// per kind of body. Between frames everything goes straight (rotations by the shorter arc). Numbers are 32-bit, as
/// offsets from the middle of the first frame. A static picture for one frame alone. Takes most_frames frames.
std::unique_ptr<Exporter> gltf_exporter(const Topology& topology, const std::string& name,
                                        const std::filesystem::path& folder);

}  // namespace trocar
