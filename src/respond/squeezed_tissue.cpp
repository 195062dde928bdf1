#include "respond/squeezed_tissue.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

constexpr Index bones = -1;
constexpr Index between_tissues = -2;
constexpr double reluctance = 0.5;  ///< ε: tissue does not slip aside far to escape two bodies that face each other

template <typename Act>
void for_each_vertex(const LinearContact& contact, const Act& act) {
    for (std::size_t i = 0; i < 3; ++i) {
        if (contact.vertices[i] >= 0 && contact.weights[i] != 0.0) act(contact.vertices[i], contact.weights[i]);
        if (contact.reaction_vertices[i] >= 0 && contact.reaction_weights[i] != 0.0) {
            act(contact.reaction_vertices[i], -contact.reaction_weights[i]);
        }
    }
}

}  // namespace

void SqueezedTissue::prepare(const Topology& topology) {
    overlaps_.assign(topology.bodies.size(), 0);
    squeezed_.assign(at(topology.vertex_count), 0);
    motion_.setZero(3, topology.vertex_count);
    rows_.clear();
    marked_.clear();
    groups_.clear();
}

/// Two bodies that neither deform nor yield to a hand cross in this frame.
bool SqueezedTissue::find_overlaps(const ThesisState& state, const ContactSet& contacts) {
    const Topology& topology = *state.topology;
    std::fill(overlaps_.begin(), overlaps_.end(), std::uint8_t{0});
    const auto yields = [&](Index body) { return state.kind(body) == BodyKind::tissue || state.device(body); };
    bool any = false;
    bone_ = -1;
    for (const Contact& contact : contacts.contacts) {
        if (contact.a < 0 || contact.b < 0) continue;
        const Index a = topology.body_of_triangle[at(contact.a)];
        const Index b = topology.body_of_triangle[at(contact.b)];
        if (yields(a) || yields(b) || !(contact.depth > 0.0)) continue;
        overlaps_[at(a)] = 1;
        overlaps_[at(b)] = 1;
        if (state.kind(a) == BodyKind::rigid) bone_ = a;
        if (state.kind(b) == BodyKind::rigid) bone_ = b;
        any = true;
    }
    return any;
}

void SqueezedTissue::collect(const ThesisState& state, const Effect& effect) {
    const Topology& topology = *state.topology;
    rows_.clear();
    groups_.clear();
    for (std::size_t c = 0; c < effect.contacts.size(); ++c) {
        const LinearContact& contact = effect.contacts[c];
        if (contact.role != ContactRole::constraint || contact.vertices[0] < 0) continue;
        if (state.kind(topology.body_of_vertex(contact.vertices[0])) != BodyKind::tissue) continue;
        Row row;
        row.contact = c;
        row.group = contact.reaction_body;
        if (contact.reaction_vertices[0] >= 0) row.group = between_tissues;
        if (row.group == bones && bone_ < 0) continue;
        if (row.group >= 0 && overlaps_[at(row.group)] == 0) continue;
        row.depth = -contact.gap;
        if (row.group != between_tissues) row.depth += contact.face_velocity * (state.dt + contact.mu / contact.k);
        for_each_vertex(contact, [&](Index vertex, double weight) {
            if (!state.fixed(vertex)) row.size += weight * weight;
        });
        if (row.size == 0.0) continue;
        rows_.push_back(row);
        if (row.group == between_tissues) continue;
        if (std::find(groups_.begin(), groups_.end(), row.group) == groups_.end()) groups_.push_back(row.group);
    }
}

double SqueezedTissue::along(const Effect& effect, const Row& row, const Matrix3X& motion) {
    const LinearContact& contact = effect.contacts[row.contact];
    double sum = 0.0;
    for_each_vertex(contact,
                    [&](Index vertex, double weight) { sum += weight * motion.col(vertex).dot(contact.normal); });
    return sum;
}

/// Gauss–Seidel on the dual of the least squares: u = Jᵀλ / ε and λ_i = (d_i − J_i u)₊.
void SqueezedTissue::relax(const ThesisState& state, const Effect& effect) {
    for (const Row& row : rows_) {
        for_each_vertex(effect.contacts[row.contact], [&](Index vertex, double) { motion_.col(vertex).setZero(); });
    }
    constexpr int most_sweeps = 200;
    constexpr double tolerance = 1e-4;  // of the largest change
    double first = 0.0;
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
        double largest = 0.0;
        for (Row& row : rows_) {
            double change = (row.depth - along(effect, row, motion_) - row.left) / (1.0 + row.size / reluctance);
            change = std::max(change, -row.left);
            if (change == 0.0) continue;
            row.left += change;
            largest = std::max(largest, std::abs(change));
            const LinearContact& contact = effect.contacts[row.contact];
            for_each_vertex(contact, [&](Index vertex, double weight) {
                if (!state.fixed(vertex)) motion_.col(vertex) += change / reluctance * weight * contact.normal;
            });
        }
        if (sweep == 0) first = largest;
        if (largest <= tolerance * first) break;
    }
}

void SqueezedTissue::share(const ThesisState& state, const ContactSet& contacts, Effect& effect) {
    for (const Index vertex : marked_) squeezed_[at(vertex)] = 0;
    marked_.clear();
    if (!find_overlaps(state, contacts)) return;
    collect(state, effect);
    if (groups_.size() < 2) return;
    relax(state, effect);
    // Both sides with the softer pair's k: else the stiffer one would press the tissue on the other.
    double stiffness = std::numeric_limits<double>::infinity();
    for (const Row& row : rows_) {
        if (row.group == between_tissues || !(row.left > 0.0)) continue;
        stiffness = std::min(stiffness, compliant_stiffness(state, row, effect.contacts[row.contact]));
    }
    for (const Row& row : rows_) {
        if (!(row.left > 0.0)) continue;
        LinearContact& contact = effect.contacts[row.contact];
        contact.gap += row.left;
        if (row.group != between_tissues) {
            const double force = std::min(stiffness * row.left, state.settings.f_max);
            contact.gap -= force / contact.k;
        }
        const double clear = state.clear_depth(state.topology->body_of_vertex(contact.vertices[0]));
        if (row.left <= std::max(clear, 0.75 * row.depth)) continue;
        for_each_vertex(contact, [&](Index vertex, double) {
            if (squeezed_[at(vertex)] == 0) marked_.push_back(vertex);
            squeezed_[at(vertex)] = 1;
        });
    }
    // The dampers along the surface steady what a pressing force does there; that force is gone.
    for (LinearContact& contact : effect.contacts) {
        if (contact.role != ContactRole::damper) continue;
        for_each_vertex(contact, [&](Index vertex, double) {
            if (squeezed_[at(vertex)] != 0) contact.mu = 0.0;
        });
    }
}

/// The pair's own stiffness, as a penalty contact would have it.
double SqueezedTissue::compliant_stiffness(const ThesisState& state, const Row& row,
                                           const LinearContact& contact) const {
    const auto heaviest = std::max_element(contact.weights.begin(), contact.weights.end()) - contact.weights.begin();
    const Index vertex = contact.vertices[static_cast<std::size_t>(heaviest)];
    return state.stiffness(row.group == bones ? bone_ : row.group, state.topology->body_of_vertex(vertex),
                           state.materials->mean_stiffness[at(vertex)], vertex);
}

}  // namespace trocar
