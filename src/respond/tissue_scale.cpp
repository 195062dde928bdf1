#include "respond/tissue_scale.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/vertex_springs.hpp"

namespace trocar {
std::vector<TissueScale> tissue_scales(const Topology& topology, const Materials& materials) {
    std::vector<double> energy(topology.bodies.size(), 0.0);  // k L²
    for (const Spring& spring : materials.springs) {
        energy[at(topology.body_of_vertex(spring.i))] += spring.k * spring.rest * spring.rest;
    }
    const std::vector<double> edge = mean_spring_lengths(topology, materials);
    std::vector<TissueScale> scales(topology.bodies.size());
    for (std::size_t b = 0; b < scales.size(); ++b) {
        const BodyRange& body = topology.bodies[b];
        if (body.kind != BodyKind::tissue) continue;
        double mass = 0.0;
        double area = 0.0;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            mass += materials.mass[at(v)];
            area += materials.area[at(v)];
        }
        scales[b].edge = edge[b];
        scales[b].side = std::sqrt(area);
        scales[b].wave_speed = mass > 0.0 && energy[b] > 0.0 ? std::sqrt(energy[b] / (3.0 * mass))
                                                             : std::numeric_limits<double>::infinity();
    }
    return scales;
}

}  // namespace trocar
