#include "measure/force_without_touch.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/triangle_distance.hpp"
#include "measure/pair_truth.hpp"

namespace trocar {
ForceWithoutTouch::ForceWithoutTouch(const Topology& topology, const Frame& first,
                                     std::span<const std::uint8_t> counted)
    : topology_(&topology), counted_(counted.begin(), counted.end()), pairs_(topology.body_pairs.size()) {
    counted_.resize(pairs_.size(), 0);
    before_.position = first.position;
}

/// -1: not known. A contact with a body at rest does not name it: it is the one that the pushed body has a pair with.
Index ForceWithoutTouch::pair_of(const ContactForceLaw& contact) const {
    const Topology& topology = *topology_;
    const Index pushed = topology.body_of_vertex(any_vertex(contact.vertices));
    if (pushed < 0) return -1;
    Index other = topology.body_of_vertex(any_vertex(contact.reaction_vertices));
    if (other < 0) other = contact.reaction_body;
    if (other >= 0) return topology.body_pair(pushed, other);
    Index found = -1;
    for (Index pair = 0; pair < static_cast<Index>(topology.body_pairs.size()); ++pair) {
        const auto [a, b] = topology.body_pairs[at(pair)];
        if (a != pushed && b != pushed) continue;
        if (topology.bodies[at(a == pushed ? b : a)].kind != BodyKind::rigid) continue;
        if (found >= 0) return -1;
        found = pair;
    }
    return found;
}

double ForceWithoutTouch::clearance(const Frame& frame, Index pair, double bound) {
    const std::array<Index, 2>& bodies = topology_->body_pairs[at(pair)];
    if (!(bound > 0.0)) return 0.0;
    const auto of_pair = [&](const TrianglePair& one) {
        return topology_->body_of_triangle[at(one.a)] == bodies[0] &&
               topology_->body_of_triangle[at(one.b)] == bodies[1];
    };
    true_pairs(*topology_, frame, near_);
    if (std::any_of(near_.begin(), near_.end(), of_pair)) return 0.0;
    true_near_pairs(*topology_, frame, bound, near_);
    double square = bound * bound;
    const auto corners = [&](Index triangle) { return corners_of(topology_->triangles, frame.position, triangle); };
    for (const TrianglePair& near : near_) {
        if (!of_pair(near)) continue;
        square = std::min(square, triangle_distance(corners(near.a), corners(near.b)).squared_distance);
    }
    return std::sqrt(square);
}

void ForceWithoutTouch::keep(Pair& pair, double force, double clearance) {
    std::erase_if(pair.samples, [&](const Sample& one) { return one.force <= force && one.clearance <= clearance; });
    pair.samples.push_back({force, clearance});
}

void ForceWithoutTouch::observe(const Frame& after, const ResponseOutput& output,
                                std::span<const ContactForce> contact_forces, const Bound& bound) {
    if (pairs_.empty()) return;
    for (Pair& pair : pairs_) pair.force = 0.0;
    bool unreported = false;
    for (std::size_t c = 0; c < std::min(output.contacts.size(), contact_forces.size()); ++c) {
        const double force = contact_forces[c].force.norm();
        if (output.contacts[c].bilateral() || force == 0.0) continue;
        const Index pair = pair_of(output.contacts[c]);
        if (pair < 0) {
            unreported = true;
        } else {
            pairs_[at(pair)].force += force;
        }
    }
    const bool placed = std::any_of(output.position_corrections.begin(), output.position_corrections.end(),
                                    [](const PositionCorrection& one) { return !one.held; });
    const bool wrenches = std::any_of(output.wrench.begin(), output.wrench.end(),
                                      [](const Wrench& one) { return !one.force.isZero(0.0); });
    if (unreported || placed || wrenches || !output.held_force.isZero(0.0)) {
        pairs_.clear();
        return;
    }
    for (std::size_t number = 0; number < pairs_.size(); ++number) {
        Pair& pair = pairs_[number];
        if (counted_[number] == 0) continue;
        const auto [a, b] = topology_->body_pairs[number];
        const double start = pair.start;
        pair.start = bound(a, b);
        if (pair.force == 0.0) continue;
        pair.peak = std::max(pair.peak, pair.force);
        const double most = std::min(start, pair.start);
        // What no sample with more force could fall below is not worth the distance.
        const bool known = std::any_of(pair.samples.begin(), pair.samples.end(), [&](const Sample& one) {
            return one.force >= pair.force && one.clearance >= most;
        });
        if (known) continue;
        const double end = clearance(after, static_cast<Index>(number), pair.start);
        // The bounds are of samples: where edges cross, the start may be nearer than its bound says.
        keep(pair, pair.force, std::min(end, clearance(before_, static_cast<Index>(number), std::min(start, end))));
    }
    before_.position = after.position;
}

double ForceWithoutTouch::largest() const {
    constexpr double of_peak = 0.01;
    double largest = not_known;
    for (const Pair& pair : pairs_) {
        for (const Sample& one : pair.samples) {
            if (one.force > of_peak * pair.peak) largest = std::fmax(largest, one.clearance);
        }
    }
    return largest;
}

}  // namespace trocar
