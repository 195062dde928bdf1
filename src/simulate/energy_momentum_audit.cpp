#include "simulate/energy_momentum_audit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

/// Velocity at mid-tick of the parabola from `first` to `last` with displacement `path` in the tick.
Vector3 middle_of(const Vector3& first, const Vector3& last, const Vector3& path, double dt) {
    return 0.25 * (6.0 / dt * path - first - last);
}

/// Displacement of that parabola in the first half of the tick.
Vector3 first_half(const Vector3& first, const Vector3& middle, const Vector3& last, double dt) {
    return dt / 24.0 * (5.0 * first + 8.0 * middle - last);
}

template <typename Value>
Value simpson(double dt, const Value& first, const Value& middle, const Value& last) {
    return dt / 6.0 * (first + 4.0 * middle + last);
}

}  // namespace

EnergyMomentumAudit::EnergyMomentumAudit(const Scene& scene) : scene_(&scene), has_tissue_(scene.has_tissue()) {
    operator_before_.reserve(scene.bodies.size());
    pose_before_ = scene.first.pose;
    if (!has_tissue_) return;
    const Index n = scene.topology.vertex_count;
    free_.assign(at(n), 0);
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            free_[at(v)] = scene.materials.is_free(v) ? 1 : 0;
        }
    }
    moves_ = free_;
    for (Matrix3X* buffer : {&start_, &start_velocity_, &middle_, &middle_velocity_, &force_}) buffer->setZero(3, n);
}

void EnergyMomentumAudit::Account::enter(double energy_remainder, double energy_moved,
                                         const Vector3& momentum_remainder, double impulses) {
    error += energy_remainder;
    worst = std::max(worst, std::abs(error));
    turnover += energy_moved;
    momentum_error += momentum_remainder;
    momentum_worst = std::max(momentum_worst, momentum_error.norm());
    impulse += impulses;
}

double EnergyMomentumAudit::tissue_energy(const Matrix3X& position, const Matrix3X& velocity) const {
    double energy = potential_energy(scene_->materials, position);
    for (std::size_t v = 0; v < free_.size(); ++v) {
        if (free_[v] == 0) continue;
        energy += 0.5 * scene_->materials.mass[v] * velocity.col(static_cast<Eigen::Index>(v)).squaredNorm();
    }
    return energy;
}

/// N, sum of spring, damper, drag and bias forces on the moving vertices.
Vector3 EnergyMomentumAudit::inner_force(const Matrix3X& position, const Matrix3X& velocity) {
    internal_force(scene_->materials, position, velocity, force_);
    Vector3 sum = Vector3::Zero();
    for (std::size_t v = 0; v < moves_.size(); ++v) {
        if (moves_[v] != 0) sum += force_.col(static_cast<Eigen::Index>(v));
    }
    return sum;
}

/// Applies the output's position corrections to the start of the tick. Returns the work of held position corrections,
/// J, which scripts do.
double EnergyMomentumAudit::place(const ResponseOutput& output) {
    if (output.position_corrections.empty()) return 0.0;
    double held_work = 0.0;
    for (const bool held : {true, false}) {
        bool any = false;
        for (const PositionCorrection& position_correction : output.position_corrections) {
            if (position_correction.held != held || free_[at(position_correction.vertex)] == 0) continue;
            any = true;
            start_.col(position_correction.vertex) = position_correction.position;
            start_velocity_.col(position_correction.vertex) = position_correction.velocity;
            if (held) moves_[at(position_correction.vertex)] = 0;
        }
        if (held && any) held_work = tissue_energy(start_, start_velocity_) - energy_;
    }
    return held_work;
}

void EnergyMomentumAudit::observe_tissue(const Frame& seen, const Frame& after, const ResponseOutput& output,
                                         std::span<const ContactForce> contact_forces, bool limited) {
    const Materials& materials = scene_->materials;
    const double dt = scene_->dt;
    if (!started_) {
        energy_ = first_energy_ = tissue_energy(seen.position, seen.velocity);
        started_ = true;
    }
    start_ = seen.position;
    start_velocity_ = seen.velocity;
    absolute_work_ += std::abs(place(output));
    const double placed = output.position_corrections.empty() ? energy_ : tissue_energy(start_, start_velocity_);
    const double position_correction_work = placed - energy_;

    middle_ = start_;
    middle_velocity_ = start_velocity_;
    Vector3 momentum = Vector3::Zero();
    for (std::size_t i = 0; i < moves_.size(); ++i) {
        if (moves_[i] == 0) continue;
        const auto v = static_cast<Eigen::Index>(i);
        const Vector3 first = start_velocity_.col(v);
        const Vector3 last = after.velocity.col(v);
        const Vector3 middle = middle_of(first, last, after.position.col(v) - start_.col(v), dt);
        middle_velocity_.col(v) = middle;
        middle_.col(v) += first_half(first, middle, last, dt);
        momentum += materials.mass[i] * (last - first);
    }
    const double taken = simpson(dt, dissipated_power(materials, start_, start_velocity_, moves_),
                                 dissipated_power(materials, middle_, middle_velocity_, moves_),
                                 dissipated_power(materials, after.position, after.velocity, moves_));
    const Vector3 inner_start = inner_force(start_, start_velocity_);
    const Vector3 inner_middle = inner_force(middle_, middle_velocity_);
    const Vector3 inner = simpson(dt, inner_start, inner_middle, inner_force(after.position, after.velocity));

    double work = 0.0;
    double moved = std::abs(position_correction_work) + std::abs(taken);
    Vector3 given = Vector3::Zero();
    double impulses = 0.0;
    // Adds the impulse of a force (N, mean over the tick) on weighted vertices to `given`. Returns its work, J.
    const auto push = [&](const Vector3& force, const std::array<Index, 3>& vertices,
                          const std::array<double, 3>& weights) {
        Vector3 path = Vector3::Zero();
        double share = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            const Index v = vertices[i];
            if (v < 0 || moves_[at(v)] == 0) continue;
            path += weights[i] * (after.position.col(v) - start_.col(v));
            share += weights[i];
        }
        given += dt * share * force;
        impulses += dt * std::abs(share) * force.norm();
        return force.dot(path);
    };
    for (std::size_t c = 0; c < std::min(contact_forces.size(), output.contacts.size()); ++c) {
        const ContactForceLaw& contact = output.contacts[c];
        const double by_mean = push(contact_forces[c].force, contact.vertices, contact.weights) +
                               push(-contact_forces[c].force, contact.reaction_vertices, contact.reaction_weights);
        const double done = std::isfinite(contact_forces[c].work) ? contact_forces[c].work : by_mean;
        work += done;
        moved += std::abs(done);
    }
    if (output.held_force.cols() == start_.cols()) {
        for (Index v = 0; v < scene_->topology.vertex_count; ++v) {
            const Vector3 force = output.held_force.col(v);
            if (force.isZero(0.0)) continue;
            const ContactPoint point = ContactPoint::at_vertex(v);
            const double done = push(force, point.vertices, point.weights);
            work += done;
            moved += std::abs(done);
        }
    }
    turned_ = moved - std::abs(taken);
    dissipated_ += taken;
    const double end = tissue_energy(after.position, after.velocity);
    double remainder = end - placed - work + taken;
    if (limited && remainder < 0.0) {
        limited_ -= remainder;
        moved -= remainder;
        remainder = 0.0;
    }
    tissue_.enter(remainder, moved, momentum - inner - given, impulses);
    energy_ = end;
    if (!output.position_corrections.empty()) moves_ = free_;
}

void EnergyMomentumAudit::observe_operator(std::size_t number, const DrivenOperator& coupling) {
    const double dt = scene_->dt;
    const OperatorModel& model = *coupling.model;
    const OperatorState before = operator_before_[number];
    const OperatorState& after = coupling.state;
    operator_before_[number] = after;
    const Vector3 path = after.position - before.position;
    const Vector3 middle_velocity = middle_of(before.velocity, after.velocity, path, dt);
    const Vector3 middle = before.position + first_half(before.velocity, middle_velocity, after.velocity, dt);
    const auto pull = [&](const Vector3& position, const Vector3& velocity) {
        return Vector3(model.coupling_stiffness * (coupling.target - position) +
                       model.coupling_damping * (coupling.target_velocity - velocity) - model.damping * velocity);
    };
    const Vector3 pull_start = pull(before.position, before.velocity);
    const Vector3 pull_middle = pull(middle, middle_velocity);
    const Vector3 pull_end = pull(after.position, after.velocity);
    const Vector3 impulse = simpson(dt, pull_start, pull_middle, pull_end);
    const double pulled =
        simpson(dt, pull_start.dot(before.velocity), pull_middle.dot(middle_velocity), pull_end.dot(after.velocity));
    const double pressed = coupling.work;
    const double gain = 0.5 * model.mass * (after.velocity.squaredNorm() - before.velocity.squaredNorm());
    couplings_.enter(gain - pulled - pressed, std::abs(pulled) + std::abs(pressed),
                     model.mass * (after.velocity - before.velocity) - impulse - dt * coupling.load.force,
                     impulse.norm() + dt * coupling.load.force.norm());
}

/// Adds the work of scripts and operators against the contact forces of their bodies. It is force · displacement of the
/// body-fixed point at the world origin + moment · rotation. Scripts move a body before detect, operators after it.
void EnergyMomentumAudit::observe_tools(const Frame& seen, const Frame& after, std::span<const Wrench> body_load) {
    const Topology& topology = scene_->topology;
    if (pose_before_.empty() || seen.pose.size() != pose_before_.size()) return;
    for (Index body = 0; body < topology.body_count() && at(body) < scene_->bodies.size(); ++body) {
        const std::optional<Motion>& motion = scene_->bodies[at(body)].motion;
        if (!motion) continue;
        const bool by_operator = motion->drive == Drive::simulated_operator;
        const Pose& first = by_operator ? seen.pose[at(body)] : pose_before_[at(body)];
        const Pose& last = by_operator ? after.pose[at(body)] : seen.pose[at(body)];
        const Quaternion turn = last.rotation * first.rotation.conjugate();
        const Vector3 path = last.translation - turn * first.translation;
        const Eigen::AngleAxisd angle(turn);
        const Wrench& load = body_load[at(body)];
        absolute_work_ += std::abs(load.force.dot(path) + angle.angle() * load.moment.dot(angle.axis()));
        if (!scene_->bodies[at(body)].jaws.empty() && pose_before_[at(body)].jaw != seen.pose[at(body)].jaw) {
            absolute_work_ += turned_;
        }
    }
    for (std::size_t body = 0; body < pose_before_.size(); ++body) pose_before_[body] = seen.pose[body];
}

void EnergyMomentumAudit::observe(const Frame& seen, const Frame& after, const ResponseOutput& output,
                                  std::span<const ContactForce> contact_forces, std::span<const Wrench> body_load,
                                  std::span<const DrivenOperator> operators, bool limited) {
    for (std::size_t i = operator_before_.size(); i < operators.size(); ++i) {
        const Motion& script = *scene_->bodies[at(operators[i].bodies.front())].motion;
        operator_before_.push_back({script.pose_at(0.0).translation, Vector3::Zero()});
    }
    if (has_tissue_) observe_tissue(seen, after, output, contact_forces, limited);
    for (std::size_t i = 0; i < operators.size(); ++i) observe_operator(i, operators[i]);
    observe_tools(seen, after, body_load);
}

Summary EnergyMomentumAudit::figures() const {
    const auto either = [&](double tissue, double operators) {
        const double worst = std::max(has_tissue_ ? tissue : 0.0, operators);
        return has_tissue_ || !operator_before_.empty() ? worst : not_known;
    };
    const auto share = [](double part, double whole) { return whole > 0.0 ? part / whole : 0.0; };
    return {{Metric::energy_residual_j, either(tissue_.worst, couplings_.worst)},
            {Metric::energy_residual_share,
             either(share(tissue_.worst, tissue_.turnover), share(couplings_.worst, couplings_.turnover))},
            {Metric::momentum_residual_n_s, either(tissue_.momentum_worst, couplings_.momentum_worst)},
            {Metric::momentum_residual_share, either(share(tissue_.momentum_worst, tissue_.impulse),
                                                     share(couplings_.momentum_worst, couplings_.impulse))},
            {Metric::dissipated_energy_j, has_tissue_ ? dissipated_ : not_known},
            {Metric::limiter_energy_j, has_tissue_ ? limited_ : not_known},
            {Metric::absolute_work_j, absolute_work_}};
}

}  // namespace trocar
