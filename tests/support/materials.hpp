// Materials of bodies without mass, area, springs or drag, whose every vertex is free.
#pragma once

#include "scene/world.hpp"

namespace trocar::test {

inline Materials empty_materials(const Topology& topology) {
    Materials materials;
    const std::size_t vertices = at(topology.vertex_count);
    materials.rest_bias = Matrix3X::Zero(3, topology.vertex_count);
    materials.pinned.assign(vertices, 0);
    for (std::vector<double>* of_vertices :
         {&materials.mass, &materials.area, &materials.drag, &materials.mean_stiffness}) {
        of_vertices->assign(vertices, 0.0);
    }
    materials.triangle_stiffness.assign(at(topology.triangle_count()), 0.0);
    materials.contact_laws.assign(topology.body_pairs.size(), {});
    materials.trocar_point.assign(topology.bodies.size(), std::nullopt);
    materials.tip.assign(topology.bodies.size(), Vector3::Zero());
    return materials;
}

}  // namespace trocar::test
