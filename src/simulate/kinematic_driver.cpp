#include "simulate/kinematic_driver.hpp"

#include <algorithm>
#include <cmath>

#include "tissue/stability.hpp"

namespace trocar {
namespace {

bool same(const Pose& a, const Pose& b) {
    return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs() && a.jaw == b.jaw;
}

}  // namespace

KinematicDriver::KinematicDriver(const Scene& scene)
    : scene_(&scene),
      operator_of_body_(operators_of_bodies(scene)),
      operator_motion_(scene.topology.bodies.size(), Vector3::Zero()),
      last_pose_(scene.first.pose),
      shown_body_(trocar::shown_body(scene)) {
    for (Index body = 0; body < scene.topology.body_count(); ++body) {
        const Index coupling = operator_of_body_[at(body)];
        if (coupling < 0) continue;
        if (at(coupling) == operators_.size()) {
            operators_.push_back({{}, {scene.bodies[at(body)].motion->pose_at(0.0).translation, Vector3::Zero()}});
        }
        operators_[at(coupling)].bodies.push_back(body);
    }
    find_what_changes();
}

void KinematicDriver::find_what_changes() {
    constexpr Index short_gap = 64;
    const Topology& topology = scene_->topology;
    for (Index body = 0; body < topology.body_count(); ++body) {
        const BodyRange& range = topology.bodies[at(body)];
        if (at(body) < scene_->bodies.size() && scene_->bodies[at(body)].motion) {
            driven_vertices_.push_back(range.vertices);
            continue;
        }
        if (range.kind != BodyKind::tissue) continue;
        if (scene_->materials.mass.empty()) {  // frames from outside: pinned vertices are unknown
            free_tissue_.push_back(range.vertices);
            continue;
        }
        const std::size_t others = free_tissue_.size();
        for (Index v = range.vertices.first; v < range.vertices.end(); ++v) {
            if (!scene_->materials.is_free(v)) continue;
            if (free_tissue_.size() > others && v - free_tissue_.back().end() < short_gap) {
                free_tissue_.back().count = v + 1 - free_tissue_.back().first;
            } else {
                free_tissue_.push_back({v, 1});
            }
        }
    }
}

void KinematicDriver::place(Index body, const Pose& pose, bool keep_previous, Frame& frame) const {
    const Range range = scene_->topology.bodies[at(body)].vertices;
    auto position = frame.position.middleCols(range.first, range.count);
    auto previous = frame.previous.middleCols(range.first, range.count);
    if (!keep_previous) previous = position;
    place_body(scene_->bodies[at(body)], range, pose, frame.position);
    frame.velocity.middleCols(range.first, range.count) = (position - previous) / scene_->dt;
    frame.pose[at(body)] = pose;
}

void KinematicDriver::move(double time, const std::vector<Range>* tissue_moved, Frame& frame) {
    const Topology& topology = scene_->topology;
    if (!frame.moved) frame.moved.emplace();
    frame.moved->clear();
    const std::vector<Range>& tissue = tissue_moved != nullptr ? *tissue_moved : free_tissue_;
    std::size_t next = 0;
    for (Index body = 0; body < topology.body_count(); ++body) {
        const BodyRange& range = topology.bodies[at(body)];
        const bool driven = at(body) < scene_->bodies.size() && scene_->bodies[at(body)].motion.has_value();
        if (!driven) {
            for (; next < tissue.size() && tissue[next].first < range.vertices.end(); ++next) {
                frame.moved->push_back(tissue[next]);
            }
            continue;
        }
        Pose pose = scene_->bodies[at(body)].motion->pose_at(time);
        const Index coupling = operator_of_body_[at(body)];
        if (coupling >= 0) {
            // The operator's step at the end of the last tick set `previous`; only rotation and jaw are new here.
            const Operator& holder = operators_[at(coupling)];
            const Vector3 target = scene_->bodies[at(holder.bodies.front())].motion->pose_at(time).translation;
            pose.translation += holder.state.position - target;
            frame.operator_motion.resize(topology.bodies.size(), Vector3::Zero());
            frame.operator_motion[at(body)] = operator_motion_[at(body)];
            place(body, pose, true, frame);
            frame.moved->push_back(range.vertices);
            last_pose_[at(body)] = pose;
            continue;
        }
        if (!same(pose, last_pose_[at(body)])) {
            place(body, pose, false, frame);
            frame.moved->push_back(range.vertices);
            last_pose_[at(body)] = pose;
            continue;
        }
        // At rest now; the body may have moved in the tick before.
        const Range v = range.vertices;
        frame.previous.middleCols(v.first, v.count) = frame.position.middleCols(v.first, v.count);
        frame.velocity.middleCols(v.first, v.count).setZero();
    }
}

Wrench KinematicDriver::shown_load(const std::vector<Wrench>& load) const {
    if (shown_body_ < 0) return {};
    if (operator_of_body_[at(shown_body_)] >= 0) return load[at(shown_body_)];  // already the operator's total
    const std::vector<BodyRange>& bodies = scene_->topology.bodies;
    const std::string& instrument = bodies[at(shown_body_)].instrument;
    Wrench sum;
    for (std::size_t body = 0; body < bodies.size(); ++body) {
        const bool same_one = static_cast<Index>(body) == shown_body_;
        if (!same_one && (instrument.empty() || bodies[body].instrument != instrument)) continue;
        sum.force += load[body].force;
        sum.moment += load[body].moment;
    }
    return sum;
}

/// Contacts without tissue on scripted bodies. Against an operator, the force is the mean over the operator's
/// sub-steps. Between two scripts nothing integrates the contact, so the force is that at the end of the tick.
void KinematicDriver::press_scripted(const ResponseOutput& output, const Frame& frame, std::vector<Wrench>& load,
                                     std::span<ContactForce> contact_forces) const {
    const Topology& topology = scene_->topology;
    const auto add = [&](Index body, const Vector3& point, const Vector3& force) {
        if (operator_of_body_[at(body)] >= 0 || topology.bodies[at(body)].kind != BodyKind::instrument) return;
        load[at(body)].force += force;
        load[at(body)].moment += point.cross(force);
    };
    for (std::size_t c = 0; c < output.contacts.size(); ++c) {
        const ContactForceLaw& contact = output.contacts[c];
        Index pushed = -1;
        double rate = -contact.face_velocity;
        Vector3 point = Vector3::Zero();
        for (std::size_t i = 0; i < 3; ++i) {
            const Index vertex = contact.vertices[i];
            if (vertex < 0) continue;
            pushed = topology.body_of_vertex(vertex);
            point += contact.weights[i] * frame.position.col(vertex);
            rate += contact.weights[i] * frame.velocity.col(vertex).dot(contact.normal);
        }
        if (pushed < 0 || topology.bodies[at(pushed)].kind == BodyKind::tissue) continue;
        const auto by_operator = [this](Index body) { return body >= 0 && operator_of_body_[at(body)] >= 0; };
        if (!by_operator(pushed) && !by_operator(contact.reaction_body)) {
            const double gap = contact.gap + rate * scene_->dt;
            const StepLaw law(contact.k, std::max(contact.mu, 0.0), -contact.gap, scene_->dt, contact.pulls());
            double force = law.force(rate) - std::min(contact.mu, 0.0) * rate;
            if (!contact.bilateral() && (gap > 0.0 || (!contact.pulls() && force < 0.0))) force = 0.0;
            force = std::clamp(force, -contact.limit, contact.limit);
            contact_forces[c] = {.normal = force, .at_limit = std::abs(force) >= contact.limit};
        }
        const Vector3 force = contact_forces[c].normal * contact.normal;
        contact_forces[c].force = force;
        add(pushed, point, force);
        if (contact.reaction_body >= 0) add(contact.reaction_body, contact.reaction_point, -force);
    }
}

void KinematicDriver::advance(double time, const ResponseOutput& output, const std::vector<Wrench>& reaction,
                              Frame& frame, std::vector<Wrench>& load, std::span<ContactForce> contact_forces) {
    const Topology& topology = scene_->topology;
    const double dt = scene_->dt;
    for (std::size_t body = 0; body < load.size(); ++body) {
        load[body] = {.force = reaction[body].force + output.wrench[body].force,
                      .moment = reaction[body].moment + output.wrench[body].moment};
    }
    driven_.clear();
    for (const Operator& coupling : operators_) {
        const Motion& script = *scene_->bodies[at(coupling.bodies.front())].motion;
        DrivenOperator driven{
            .model = &script.coupling, .bodies = coupling.bodies, .target = script.pose_at(time).translation};
        driven.target_velocity = (driven.target - script.pose_at(time - dt).translation) / dt;
        for (const Index body : coupling.bodies) {
            driven.external.force += load[at(body)].force;
            driven.external.moment += load[at(body)].moment;
        }
        driven.state = coupling.state;
        driven_.push_back(driven);
    }
    couplings_.advance(topology, frame, output, dt, scene_->materials.substeps, driven_, contact_forces);
    press_scripted(output, frame, load, contact_forces);
    for (std::size_t i = 0; i < operators_.size(); ++i) {
        operators_[i].state = driven_[i].state;
        for (const Index body : operators_[i].bodies) load[at(body)] = driven_[i].load;
    }
    for (Index body = 0; body < topology.body_count(); ++body) {
        if (operator_of_body_[at(body)] < 0) continue;
        const Operator& coupling = operators_[at(operator_of_body_[at(body)])];
        const Vector3 target = scene_->bodies[at(coupling.bodies.front())].motion->pose_at(time).translation;
        Pose pose = scene_->bodies[at(body)].motion->pose_at(time);
        pose.translation += coupling.state.position - target;
        operator_motion_[at(body)] = pose.translation - frame.pose[at(body)].translation;
        place(body, pose, false, frame);
    }
}

std::vector<std::uint8_t> KinematicDriver::yielding_pairs() const {
    std::vector<std::uint8_t> flags;
    for (const auto& [a, b] : scene_->topology.body_pairs) {
        bool yields = false;
        for (const Index body : {a, b}) {
            yields = yields || scene_->topology.bodies[at(body)].kind == BodyKind::tissue ||
                     operator_of_body_[at(body)] >= 0;
        }
        flags.push_back(yields ? 1 : 0);
    }
    return flags;
}

}  // namespace trocar
