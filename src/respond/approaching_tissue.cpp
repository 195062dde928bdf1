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
    const auto is_tissue = [&state](Index body) { return state.kind(body) == BodyKind::tissue; };
    pairs_.clear();
    listed_ = false;
    for (const auto& [a, b] : state.topology->body_pairs) {
        for (const auto& [body, tissue] : {std::array{a, b}, std::array{b, a}}) {
            if (!is_tissue(tissue) || (!is_tissue(body) && !state.settings.meet_tools)) continue;
            pairs_.push_back({.body = body, .tissue = tissue, .sample = {}, .clearance = {}});
        }
    }
}

/// The ledger has all of its samples from its first update on.
void ApproachingTissue::list_samples(const CrossingLedger& ledger) {
    const std::span<const LedgerSample> samples = ledger.samples();
    for (Pair& pair : pairs_) {
        for (std::size_t s = 0; s < samples.size(); ++s) {
            if (samples[s].body == pair.body) pair.sample.push_back(static_cast<Index>(s));
        }
        pair.clearance.assign(pair.sample.size(), 0.0);
    }
    listed_ = true;
}

void ApproachingTissue::find(const ThesisState& state, const Frame& frame, const Effect& effect,
                             VelocityChanges& changes, CrossingLedger& ledger, std::vector<Penetration>& approaching) {
    approaching.clear();
    if (pairs_.empty()) return;
    changes.note(effect);
    if (!listed_) list_samples(ledger);
    layers_.look_at(*state.topology, state.surface, frame);
    for (Pair& pair : pairs_) find_in(state, frame, pair, changes, ledger, approaching);
}

/// What is further off than all that moves can go in the ticks since it was looked at is not looked at again.
void ApproachingTissue::find_in(const ThesisState& state, const Frame& frame, Pair& pair, VelocityChanges& changes,
                                CrossingLedger& ledger, std::vector<Penetration>& approaching) {
    const TissueScale& scale = state.scale_of(pair.tissue);
    const double near = state.touching_gap(pair.tissue);
    const double most = (changes.fastest(pair.body) + changes.fastest(pair.tissue)) * state.dt;
    pair.travelled += most;
    if (pair.travelled < pair.least - near) return;
    const double reach = std::min(near + most + state.look_out(pair.tissue), scale.margin);
    for (std::size_t i = 0; i < pair.sample.size(); ++i) {
        double& clearance = pair.clearance[i];
        clearance -= pair.travelled;
        if (clearance <= near && ledger.is_free(pair.sample[i], pair.tissue)) {
            look_at(state, frame, pair, i, reach, changes, ledger, approaching);
            clearance -= most;
        }
    }
    pair.travelled = 0.0;
    pair.least = std::numeric_limits<double>::infinity();
    for (const double clearance : pair.clearance) pair.least = std::min(pair.least, clearance);
}

void ApproachingTissue::look_at(const ThesisState& state, const Frame& frame, Pair& pair, std::size_t number,
                                double reach, VelocityChanges& changes, CrossingLedger& ledger,
                                std::vector<Penetration>& approaching) {
    const Topology& topology = *state.topology;
    const LedgerSample& sample = ledger.samples()[at(pair.sample[number])];
    const double near = state.touching_gap(pair.tissue);
    const bool by_tissue = state.kind(pair.body) == BodyKind::tissue;
    const Vector3 x = sample.of(frame.position);
    // A script's body is already where the tick takes it.
    const Vector3 velocity = by_tissue ? Vector3(frame.velocity.col(sample.vertex)) : state.hand_velocity(pair.body);
    const double own_change = by_tissue ? changes.at(sample.vertex) : 0.0;
    Index nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    double& clearance = pair.clearance[number];
    clearance = reach;
    ledger.visit_near(pair.tissue, {.min = x.array() - reach, .max = x.array() + reach}, [&](Index t) {
        const equations::Corners corners = corners_of(topology, frame.position, t);
        const Vector3 weights = closest_point_on_triangle(corners, x);
        const double distance = (equations::point_at(corners, weights) - x).norm();
        clearance = std::min(clearance, distance);
        if (distance >= least) return;
        Vector3 meeting = velocity;
        double change = own_change;
        double other = 0.0;
        for (int i = 0; i < 3; ++i) {
            const Index corner = topology.triangles(i, t);
            meeting -= weights[i] * frame.velocity.col(corner);
            other = std::max(other, by_tissue ? changes.at(corner) : changes.when_free(corner));
        }
        change += other;
        if (distance > near + (meeting.norm() + change) * state.dt) return;
        least = distance;
        nearest = t;
    });
    if (nearest < 0) return;
    layers_.begin(sample, pair.tissue);
    layers_.cross(nearest, 0);
    const std::size_t before = approaching.size();
    layers_.append_to(approaching, state.scale_of(pair.tissue).margin);
    if (by_tissue || approaching.size() == before) return;
    // Beside a free rim the nearest point is on it: the faces there stand in nobody's way.
    constexpr double mostly = 0.5;
    if (least > near && -approaching.back().depth < mostly * least) approaching.pop_back();
}

}  // namespace trocar
