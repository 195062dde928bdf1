#include "respond/torn_tissue.hpp"

#include <algorithm>

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// What a tick has found about a vertex.
constexpr std::uint8_t listed = 1;
constexpr std::uint8_t touched = 2;
constexpr std::uint8_t stuck = 4;

/// Lever at which a contact yields by half.
constexpr double half_lever = 0.03;

bool holds_tissue(const ThesisState& state, const LinearContact& contact) {
    return contact.role == ContactRole::constraint && contact.vertices[0] >= 0 &&
           state.kind(state.topology->body_of_vertex(contact.vertices[0])) == BodyKind::tissue;
}

Index heaviest(const LinearContact& contact) {
    const auto most = std::max_element(contact.weights.begin(), contact.weights.end()) - contact.weights.begin();
    return contact.vertices[static_cast<std::size_t>(most)];
}

}  // namespace

void TornTissue::prepare(const Topology& topology) {
    torn_.assign(at(topology.vertex_count), 0);
    stuck_.assign(at(topology.vertex_count), 0);
    seen_.assign(at(topology.vertex_count), 0);
    marked_.clear();
}

/// Way of the contact point per way of the vertices that can move, 0 (all are pinned) to 1 (none is).
double TornTissue::lever(const ThesisState& state, const LinearContact& contact) {
    double free = 0.0;
    double all = 0.0;
    const auto add = [&](Index vertex, double weight) {
        if (vertex < 0) return;
        all += weight * weight;
        if (!state.fixed(vertex)) free += weight * weight;
    };
    for (std::size_t i = 0; i < 3; ++i) {
        add(contact.vertices[i], contact.weights[i]);
        add(contact.reaction_vertices[i], contact.reaction_weights[i]);
    }
    return all > 0.0 ? free / all : 0.0;
}

void TornTissue::count(const ThesisState& state, const Frame& frame, const LinearContact& contact, double lever) {
    constexpr double at_limit = 0.999;
    const Index vertex = heaviest(contact);
    std::uint8_t& seen = seen_[at(vertex)];
    if (seen == 0) marked_.push_back(vertex);
    seen |= listed | touched;
    const double clear = state.clear_depth(state.topology->body_of_vertex(vertex));
    if (contact.face_velocity * state.dt - contact.gap <= clear) return;
    if (lever < half_lever || state.springs.largest_strain(*state.materials, frame.position, vertex) >
                                  at_limit * state.materials->strain_limit)
        seen |= stuck;
}

void TornTissue::tear(const ThesisState& state, Effect& effect) {
    std::size_t kept = 0;
    for (const Index vertex : marked_) {
        const std::size_t v = at(vertex);
        stuck_[v] = (seen_[v] & stuck) != 0 ? stuck_[v] + 1 : 0;
        if (torn_[v] == 0 &&
            static_cast<double>(stuck_[v]) * state.dt > state.tear_time(state.topology->body_of_vertex(vertex))) {
            torn_[v] = 1;
            ++effect.ruptures;
        }
        if ((seen_[v] & touched) != 0) {
            marked_[kept++] = vertex;
        } else {
            torn_[v] = seen_[v] = 0;
        }
    }
    marked_.resize(kept);
}

bool TornTissue::on_torn(const LinearContact& contact) const {
    for (std::size_t i = 0; i < 3; ++i) {
        if (contact.vertices[i] >= 0 && contact.weights[i] > 0.0 && torn_[at(contact.vertices[i])] != 0) return true;
    }
    return false;
}

void TornTissue::judge(const ThesisState& state, const Frame& frame, Effect& effect) {
    for (const Index vertex : marked_) seen_[at(vertex)] = listed;
    for (LinearContact& contact : effect.contacts) {
        if (!holds_tissue(state, contact)) continue;
        const double arm = lever(state, contact);
        count(state, frame, contact, arm);
        if (arm == 1.0) continue;
        // The point moves by `arm` of what the free vertices do: hard contact would throw them far beyond the pins, and
        // press with what its stiffness makes of the rest.
        const double yields = 1.0 - arm * (1.0 + half_lever) / (arm + half_lever);
        const double ahead = contact.face_velocity * (state.dt + contact.mu / contact.k);
        contact.gap += yields * std::max(0.0, ahead - contact.gap);
    }
    tear(state, effect);
    std::erase_if(effect.contacts, [this](const LinearContact& contact) { return on_torn(contact); });
}

}  // namespace trocar
