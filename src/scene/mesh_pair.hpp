// World of two meshes, body `a` and body `b`, that are tested against each other whatever their kinds.
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
