#include "respond/approaching_tissue.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "respond/equations.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

void ApproachingTissue::prepare(const ThesisState& state) {
    const Topology& topology = *state.topology;
    const auto is_tissue = [&state](Index body) { return state.kind(body) == BodyKind::tissue; };
    pairs_.clear();
    tissues_.clear();
    for (const auto& [a, b] : topology.body_pairs) {
        if (!is_tissue(a) || !is_tissue(b)) continue;
        for (const auto& [body, tissue] : {std::array{a, b}, std::array{b, a}}) {
            pairs_.push_back({body, tissue, std::vector(at(topology.bodies[at(body)].vertices.count), 0.0)});
        }
        tissues_.insert(tissues_.end(), {a, b});
    }
    std::sort(tissues_.begin(), tissues_.end());
    tissues_.erase(std::unique(tissues_.begin(), tissues_.end()), tissues_.end());
    change_.assign(at(topology.vertex_count), 0.0);
    pushed_ = change_;
    fastest_.assign(topology.bodies.size(), 0.0);
}

/// A vertex may come to move like its neighbours, and what pushes it gives it its own speed and that at which it clears
/// the depth. A tick later so do its neighbours.
void ApproachingTissue::measure_changes(const ThesisState& state, const Frame& frame, const Effect& effect) {
    const Topology& topology = *state.topology;
    for (const Index body : tissues_) {
        const Range vertices = topology.bodies[at(body)].vertices;
        std::fill_n(pushed_.begin() + vertices.first, vertices.count, 0.0);
        std::fill_n(change_.begin() + vertices.first, vertices.count, 0.0);
    }
    for (const LinearContact& contact : effect.contacts) {
        if (contact.vertices[0] < 0 || contact.reaction_vertices[0] >= 0 || contact.bilateral) continue;
        double speed = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            if (contact.vertices[i] < 0) continue;
            speed += contact.weights[i] * frame.velocity.col(contact.vertices[i]).dot(contact.normal);
        }
        const double change = contact.face_velocity - speed + std::max(-contact.gap, 0.0) / state.settings.settle_time;
        for (const Index vertex : contact.vertices) {
            if (vertex >= 0) pushed_[at(vertex)] = std::max(pushed_[at(vertex)], change);
        }
    }
    for (const Index body : tissues_) {
        const Range triangles = topology.bodies[at(body)].triangles;
        for (Index t = triangles.first; t < triangles.end(); ++t) {
            const auto corner = topology.triangles.col(t);
            double square = 0.0;
            double most = 0.0;
            for (int i = 0; i < 3; ++i) {
                const Vector3 bend = frame.velocity.col(corner[i]) - frame.velocity.col(corner[(i + 1) % 3]);
                square = std::max(square, bend.squaredNorm());
                most = std::max(most, pushed_[at(corner[i])]);
            }
            most = std::max(most, std::sqrt(square));
            for (int i = 0; i < 3; ++i) change_[at(corner[i])] = std::max(change_[at(corner[i])], most);
        }
        const Range vertices = topology.bodies[at(body)].vertices;
        double& fastest = fastest_[at(body)] = 0.0;
        for (Index v = vertices.first; v < vertices.end(); ++v) {
            fastest = std::max(fastest, frame.velocity.col(v).norm() + change_[at(v)]);
        }
    }
}

void ApproachingTissue::find(const ThesisState& state, const Frame& frame, const Effect& effect, CrossingLedger& ledger,
                             std::vector<Penetration>& approaching) {
    approaching.clear();
    if (pairs_.empty()) return;
    measure_changes(state, frame, effect);
    layers_.look_at(*state.topology, state.surface, frame);
    for (Pair& pair : pairs_) find_in(state, frame, pair, ledger, approaching);
}

/// What is further off than all that moves can go in the ticks since it was looked at is not looked at again.
void ApproachingTissue::find_in(const ThesisState& state, const Frame& frame, Pair& pair, CrossingLedger& ledger,
                                std::vector<Penetration>& approaching) {
    const Topology& topology = *state.topology;
    constexpr double touching = 0.25;  // of a depth that counts as clear: from rest it does not get further in a tick
    constexpr double look_out = 0.2;   // of an edge
    const TissueScale& scale = state.scale_of(pair.tissue);
    const double near = touching * state.clear_depth(pair.tissue);
    const double most = (fastest_[at(pair.body)] + fastest_[at(pair.tissue)]) * state.dt;
    const double reach = std::min(near + most + look_out * scale.edge, scale.margin);
    const Range vertices = topology.bodies[at(pair.body)].vertices;
    for (Index v = vertices.first; v < vertices.end(); ++v) {
        double& clearance = pair.clearance[at(v - vertices.first)];
        clearance -= most;
        if (clearance > near || !ledger.is_free(v, pair.tissue)) continue;
        const Vector3 x = frame.position.col(v);
        Index nearest = -1;
        double least = std::numeric_limits<double>::infinity();
        clearance = reach;
        ledger.visit_near(pair.tissue, {.min = x.array() - reach, .max = x.array() + reach}, [&](Index t) {
            const equations::Corners corners = corners_of(topology, frame.position, t);
            const Vector3 weights = equations::nearest_weights(corners, x);
            const double distance = (equations::point_at(corners, weights) - x).norm();
            clearance = std::min(clearance, distance);
            if (distance >= least) return;
            Vector3 meeting = frame.velocity.col(v);
            double change = 0.0;
            for (int i = 0; i < 3; ++i) {
                const Index corner = topology.triangles(i, t);
                meeting -= weights[i] * frame.velocity.col(corner);
                change = std::max(change, change_[at(corner)]);
            }
            if (distance > near + (meeting.norm() + change_[at(v)] + change) * state.dt) return;
            least = distance;
            nearest = t;
        });
        clearance -= most;
        if (nearest < 0) continue;
        layers_.begin({.vertex = v, .body = pair.body, .key = v}, pair.tissue);
        layers_.cross(nearest, 0);
        layers_.append_to(approaching, scale.margin);
    }
}

}  // namespace trocar
