// Two meshes as the smallest world that a detector can be asked about: body `a` and body `b`, tested against each other
// whatever they are.
#pragma once

#include "geometry/mesh_file.hpp"
#include "scene/world.hpp"

namespace trocar {

struct MeshPair {
    Topology topology;
    Frame frame;
};

MeshPair make_mesh_pair(const Mesh& a, const Mesh& b);

}  // namespace trocar
