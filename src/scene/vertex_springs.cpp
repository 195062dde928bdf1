#include "scene/vertex_springs.hpp"

#include <algorithm>

namespace trocar {
void VertexSprings::prepare(const Topology& topology, const Materials& materials) {
    springs_.fill(topology.vertex_count, [&materials](const auto& act) {
        for (std::size_t s = 0; s < materials.springs.size(); ++s) {
            act(materials.springs[s].i, static_cast<Index>(s));
            act(materials.springs[s].j, static_cast<Index>(s));
        }
    });
}

double VertexSprings::largest_strain(const Materials& materials, const Matrix3X& position, Index vertex) const {
    double largest = 0.0;
    for (const Index s : of(vertex)) {
        const Spring& spring = materials.springs[at(s)];
        if (spring.rest <= 0.0) continue;
        largest = std::max(largest, (position.col(spring.i) - position.col(spring.j)).norm() / spring.rest - 1.0);
    }
    return largest;
}

double mean_spring_length(const Materials& materials) {
    double sum = 0.0;
    for (const Spring& spring : materials.springs) sum += spring.rest;
    return sum / static_cast<double>(materials.springs.size());
}

std::vector<double> mean_spring_lengths(const Topology& topology, const Materials& materials) {
    std::vector<double> length(topology.bodies.size(), 0.0);
    std::vector<double> count(topology.bodies.size(), 0.0);
    for (const Spring& spring : materials.springs) {
        const auto body = at(topology.body_of_vertex(spring.i));
        length[body] += spring.rest;
        count[body] += 1.0;
    }
    for (std::size_t b = 0; b < length.size(); ++b) {
        const bool is_tissue = topology.bodies[b].kind == BodyKind::tissue;
        length[b] = is_tissue && count[b] > 0.0 ? length[b] / count[b] : 0.0;
    }
    return length;
}

}  // namespace trocar
