// Cuts one mesh into bodies: its connected components, or parts that its file names.
#pragma once

#include <string>
#include <vector>

#include "scene/world.hpp"

namespace trocar {

/// Connected component of every triangle, numbered in the order of their first triangles. Triangles are connected by
/// common vertex numbers. `vertices`: number of vertices.
std::vector<Index> component_of_triangle(const Triangles& triangles, Index vertices);

struct MeshBodies {
    std::vector<Body> bodies;              ///< without names; open
    std::vector<Index> body_of_vertex;     ///< per vertex of the mesh; -1: in no triangle
    std::vector<Index> vertex_in_world;    ///< number over all bodies; -1: in no triangle
    std::vector<Index> triangle_in_world;  ///< per triangle of the mesh
    Index vertex_count = 0;                ///< of all bodies

    /// Positions of the mesh (3×vertices) in the order of the bodies.
    [[nodiscard]] Matrix3X in_world_order(const Matrix3X& vertices) const;
};

/// One body per value of `part_of_triangle`, which ascends from 0. Vertices in no triangle are left out. Throws
/// InputError for more bodies than size_limits allows; `place`: of its message. A vertex of two parts is an InputError
/// too.
MeshBodies cut_into_bodies(const Triangles& triangles, Index vertices, const std::vector<Index>& part_of_triangle,
                           const std::string& place);

}  // namespace trocar
