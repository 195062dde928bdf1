#include "respond/tissue_scale.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar {
std::vector<TissueScale> tissue_scales(const Topology& topology, const Materials& materials) {
    struct Sums {
        double length = 0.0;
        double springs = 0.0;
        double energy = 0.0;  // k L²
    };
    std::vector<Sums> sums(topology.bodies.size());
    for (const Spring& spring : materials.springs) {
        Sums& sum = sums[at(topology.body_of_vertex(spring.i))];
        sum.length += spring.rest;
        sum.springs += 1.0;
        sum.energy += spring.k * spring.rest * spring.rest;
    }
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
        if (sums[b].springs > 0.0) scales[b].edge = sums[b].length / sums[b].springs;
        scales[b].side = std::sqrt(area);
        scales[b].wave_speed = mass > 0.0 && sums[b].energy > 0.0 ? std::sqrt(sums[b].energy / (3.0 * mass))
                                                                  : std::numeric_limits<double>::infinity();
    }
    return scales;
}

}  // namespace trocar
