#include "tissue/node_level.hpp"

#include <algorithm>

namespace trocar {

void NodeLevel::list_edges() {
    edges.fill(static_cast<Index>(size()), [this](const auto& act) {
        for (std::uint32_t e = 0; e < i.size(); ++e) {
            act(i[e], e);
            act(j[e], e);
        }
    });
}

void NodeLevel::set_active(bool is_active) {
    active.assign(size(), is_active ? 1 : 0);
    active_at.assign(size(), -1);
    active_nodes.clear();
    active_nodes.reserve(size());
    for (Index node = 0; is_active && at(node) < size(); ++node) {
        if (fixed[at(node)] == 0) active_nodes.push_back(node);
    }
}

Index NodeLevel::pieces() const {
    const auto last = std::max_element(piece.begin(), piece.end());
    return last == piece.end() ? 0 : *last + 1;
}

namespace {

/// Numbers the connected pieces without a fixed vertex.
void mark_pieces(NodeLevel& vertices) {
    constexpr Index unknown = -2;
    vertices.piece.assign(vertices.size(), unknown);
    std::vector<Index> connected;
    connected.reserve(vertices.size());
    Index pieces = 0;
    for (Index first = 0; at(first) < vertices.size(); ++first) {
        if (vertices.piece[at(first)] != unknown) continue;
        const Index piece = pieces++;
        bool held = false;
        connected.assign(1, first);
        vertices.piece[at(first)] = piece;
        for (std::size_t n = 0; n < connected.size(); ++n) {
            const Index node = connected[n];
            held = held || vertices.fixed[at(node)] != 0;
            for (const std::uint32_t edge : vertices.edges.of(node)) {
                const Index other = vertices.other_end(edge, node);
                if (vertices.piece[at(other)] != unknown) continue;
                vertices.piece[at(other)] = piece;
                connected.push_back(other);
            }
        }
        if (!held) continue;
        --pieces;
        for (const Index node : connected) vertices.piece[at(node)] = -1;
    }
}

}  // namespace

NodeLevel level_of_vertices(const MovingTissue& tissue) {
    NodeLevel vertices;
    const TissueState& state = tissue.state();
    vertices.i = tissue.spring_arrays().i;
    vertices.j = tissue.spring_arrays().j;
    vertices.mass.reserve(state.size());
    vertices.drag.reserve(state.size());
    vertices.fixed.reserve(state.size());
    for (std::size_t v = 0; v < state.size(); ++v) {
        const bool moves = state.inverse_mass[v] != 0.0;
        vertices.mass.push_back(moves ? 1.0 / state.inverse_mass[v] : 0.0);
        vertices.drag.push_back(moves ? state.drag[v] : 0.0);
        vertices.fixed.push_back(moves ? 0 : 1);
    }
    vertices.list_edges();
    mark_pieces(vertices);
    vertices.set_active(false);
    return vertices;
}

}  // namespace trocar
