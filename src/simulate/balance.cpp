#include "simulate/balance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tissue/mass_spring.hpp"
#include "tissue/shape_forces.hpp"

namespace trocar {
namespace {

/// How far the body went during the tick whose forces are told. A script's step lies before the frame that detect saw,
/// and its speed acted on through the tick; an operator's step lies after it.
Vector3 displacement(const Scene& scene, Index body, const Frame& seen, const Frame& after) {
    const Index v = scene.topology.bodies[at(body)].vertices.first;
    const bool led = scene.bodies[at(body)].motion && scene.bodies[at(body)].motion->drive == Drive::simulated_operator;
    return led ? Vector3(after.position.col(v) - seen.position.col(v))
               : Vector3(seen.position.col(v) - seen.previous.col(v));
}

}  // namespace

Balance::Balance(const Scene& scene) : scene_(&scene), has_tissue_(scene.has_tissue()) {
    const Topology& topology = scene.topology;
    for (Index body = 0; body < topology.body_count() && at(body) < scene.bodies.size(); ++body) {
        const BodyRange& range = topology.bodies[at(body)];
        has_rigid_ = has_rigid_ || range.kind == BodyKind::rigid;
        if (range.kind != BodyKind::instrument || range.vertices.count == 0) continue;
        const std::optional<Motion>& motion = scene.bodies[at(body)].motion;
        const bool led = motion && motion->drive == Drive::simulated_operator;
        // Bodies of one hand all show the hand's force.
        const bool counted =
            led && !range.instrument.empty() && std::any_of(tools_.begin(), tools_.end(), [&](Index other) {
                return topology.bodies[at(other)].instrument == range.instrument;
            });
        if (!counted) tools_.push_back(body);
        if (shown_ < 0 || (motion && !scene.bodies[at(shown_)].motion)) shown_ = body;
        if (!motion) continue;
        for (const MotionKey& key : motion->keys) {
            turns_ = turns_ || key.rotation_degrees != motion->keys.front().rotation_degrees ||
                     key.jaw != motion->keys.front().jaw;
        }
    }
}

Balance::TissueState Balance::state_of(const Frame& frame) {
    TissueState state;
    if (!has_tissue_) return state;
    const Materials& materials = scene_->materials;
    internal_force(materials, frame.position, frame.velocity, force_);
    for (Index v = 0; v < scene_->topology.vertex_count; ++v) {
        const double mass = materials.mass[at(v)];
        if (!(mass > 0.0) || materials.pinned[at(v)] != 0) continue;
        const Vector3 velocity = frame.velocity.col(v);
        state.force += force_.col(v);
        state.momentum += mass * velocity;
        state.energy += 0.5 * mass * velocity.squaredNorm() - materials.rest_bias.col(v).dot(frame.position.col(v));
    }
    for (const Spring& spring : materials.springs) {
        const double stretch = (frame.position.col(spring.j) - frame.position.col(spring.i)).norm() - spring.rest;
        state.energy += 0.5 * spring.k * stretch * stretch + spring.preload * stretch;
        state.energy += stiffening_energy(spring, spring.rest + stretch);
    }
    const ShapeElements shape{.stiffening = {}, .hinges = materials.hinges, .enclosures = materials.enclosures};
    state.energy += shape_energy(shape, frame.position);
    return state;
}

void Balance::end_contact() {
    if (!open_) return;
    open_ = false;
    contacts_ += 1.0;
    momentum_worst_ = std::max(momentum_worst_, momentum_.norm());
    energy_worst_ = std::max(energy_worst_, energy_most_);
    if (impulse_ > 0.0) momentum_share_worst_ = std::max(momentum_share_worst_, momentum_.norm() / impulse_);
    if (work_ > 0.0) energy_share_worst_ = std::max(energy_share_worst_, energy_most_ / work_);
}

void Balance::observe(bool in_contact, const Frame& seen, const Frame& after, std::span<const Wrench> body_load) {
    const double dt = scene_->dt;
    if (shown_ >= 0) {
        const Vector3 step = displacement(*scene_, shown_, seen, after);
        path_ += step;
        path_length_ += step.norm();
        given_ += body_load[at(shown_)].force.dot(step);
        given_worst_ = std::max(given_worst_, given_);
    }
    free_ticks_ = in_contact ? 0 : free_ticks_ + 1;
    if (free_ticks_ > bridged_ticks) {
        end_contact();
        before_is_known_ = false;
        return;
    }
    if (!open_) {
        if (!in_contact) return;
        open_ = true;
        momentum_.setZero();
        impulse_ = energy_ = energy_most_ = work_ = 0.0;
    }
    // Tissue does not move between two steps: the state after the last tick is the one that this tick started from.
    const TissueState before = before_is_known_ ? before_ : state_of(seen);
    before_ = state_of(after);
    before_is_known_ = true;
    Vector3 gained = before_.momentum - before.momentum - 0.5 * dt * (before.force + before_.force);
    double energy = before_.energy - before.energy;
    for (const Index tool : tools_) {
        const Vector3& force = body_load[at(tool)].force;
        gained += dt * force;
        const double work = force.dot(displacement(*scene_, tool, seen, after));
        energy += work;
        work_ += std::abs(work);
        impulse_ += dt * force.norm();
    }
    momentum_ += gained;
    energy_ += energy;
    energy_most_ = std::max(energy_most_, energy_);
}

std::map<std::string, double> Balance::figures() const {
    constexpr double not_kept = std::numeric_limits<double>::quiet_NaN();
    Balance end = *this;
    end.end_contact();
    const bool any = end.contacts_ > 0.0;
    const bool momentum = any && !has_rigid_ && !tools_.empty() && (has_tissue_ || tools_.size() > 1);
    const bool energy = any && !turns_ && !tools_.empty();
    constexpr double closed = 0.01;  // of the way gone
    const bool path_closes = shown_ >= 0 && path_length_ > 0.0 && path_.norm() <= closed * path_length_;
    return {{"contact_spells", end.contacts_},
            {"momentum_error_worst_n_s", momentum ? end.momentum_worst_ : not_kept},
            {"momentum_error_share_worst", momentum ? end.momentum_share_worst_ : not_kept},
            {"energy_created_worst_j", energy ? end.energy_worst_ : not_kept},
            {"energy_created_share_worst", energy ? end.energy_share_worst_ : not_kept},
            {"net_work_j", energy && path_closes ? given_ : not_kept},
            {"energy_given_worst_j", energy ? given_worst_ : not_kept}};
}

}  // namespace trocar
