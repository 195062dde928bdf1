#include "respond/thesis_state.hpp"

#include <algorithm>
#include <cmath>

#include "respond/equations.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

void ThesisState::prepare(const Topology& the_topology, const Materials& the_materials) {
    topology = &the_topology;
    materials = &the_materials;
    laws.prepare(the_topology, the_materials, settings.k, settings.mu);
    springs.prepare(the_topology, the_materials);
    surface.prepare(the_topology);
    scale = tissue_scales(the_topology, the_materials);
    slot_.assign(at(the_topology.vertex_count), -1);
    edits_.clear();
    hand_velocity_.assign(the_topology.bodies.size(), Vector3::Zero());
    has_tissue = std::any_of(the_topology.bodies.begin(), the_topology.bodies.end(),
                             [](const BodyRange& body) { return body.kind == BodyKind::tissue; });
    // Far above the stiffest tissue, else the two would share the depth like springs in a row; and where edges are
    // long, a force that doubles one goes no deeper than a twentieth of what counts as clear.
    constexpr double above_tissue = 1000.0;
    constexpr double of_clear = 0.05;
    hard_stiffness = 0.0;
    for (const BodyRange& body : the_topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        const auto number = static_cast<Index>(&body - the_topology.bodies.data());
        const double above = std::max(above_tissue, scale_of(number).edge / (of_clear * TissueScale::most_clear_depth));
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            hard_stiffness = std::max(hard_stiffness, above * the_materials.mean_stiffness[at(v)]);
        }
    }
    if (has_tissue) grasp.prepare(the_topology, settings.grasping);
}

void ThesisState::begin(const Frame& frame, double the_dt) {
    dt = the_dt;
    for (const TissueEdit& edit : edits_) slot_[at(edit.vertex)] = -1;
    edits_.clear();
    surface.measure(*topology, frame.position);
    for (std::size_t body = 0; body < hand_velocity_.size(); ++body) {
        hand_velocity_[body] = trocar::hand_velocity(frame, dt, static_cast<Index>(body));
    }
}

TissueEdit& ThesisState::edit(const Frame& frame, Index vertex) {
    Index& slot = slot_[at(vertex)];
    if (slot < 0) {
        slot = static_cast<Index>(edits_.size());
        edits_.push_back(
            {.vertex = vertex, .position = frame.position.col(vertex), .velocity = frame.velocity.col(vertex)});
    }
    return edits_[at(slot)];
}

Vector3 ThesisState::internal_force_on(const Frame& frame, const TissueEdit& vertex) const {
    Vector3 sum = -materials->drag[at(vertex.vertex)] * vertex.velocity;
    if (materials->rest_bias.cols() == frame.position.cols()) sum += materials->rest_bias.col(vertex.vertex);
    for (const Index s : springs.of(vertex.vertex)) {
        const Spring& spring = materials->springs[at(s)];
        const Index other = spring.i == vertex.vertex ? spring.j : spring.i;
        const Index slot = slot_[at(other)];
        const equations::NeighbourSpring neighbour{
            .neighbour = slot < 0 ? Vector3(frame.position.col(other)) : edits_[at(slot)].position,
            .neighbour_velocity = velocity(frame, other),
            .rest = spring.rest,
            .k = spring.k,
            .preload = spring.preload,
            .damping = spring.damping};
        sum += equations::equilibrium_force(vertex.position, vertex.velocity, {&neighbour, 1}, Vector3::Zero());
    }
    return sum;
}

double ThesisState::stiffness(Index body_a, Index body_b, double on_tissue, Index vertex) const {
    const double given = laws.k(body_a, body_b);
    if (!std::isnan(given)) return given;
    const bool tissue = kind(body_a) == BodyKind::tissue || kind(body_b) == BodyKind::tissue;
    if (!tissue) return rigid_stiffness;
    return settings.area_stiffness ? settings.kappa * surface.area(vertex) : on_tissue;
}

LinearContact ThesisState::hard_contact(double depth) const {
    LinearContact linear;
    linear.role = ContactRole::constraint;
    linear.k = hard_stiffness;
    linear.mu = hard_stiffness * settings.settle_time;
    linear.gap = -depth;
    return linear;
}

void ThesisState::clear_slowly(LinearContact& linear) const {
    double speed = settings.clear_speed;
    if (std::isnan(speed)) {
        constexpr double of_waves = 1.0 / 12.0;
        speed = of_waves * scale_of(topology->body_of_vertex(linear.vertices[0])).wave_speed;
    }
    linear.gap = std::max(linear.gap, -speed * settings.settle_time);
}

void ThesisState::rub(Index key, const Vector3& surface_velocity, LinearContact& linear) const {
    if (settings.friction == 0.0) return;
    linear.friction = settings.friction;
    linear.tangent_k = settings.friction_k;
    linear.surface_velocity = surface_velocity;
    linear.slip_key = key;
}

void ThesisState::finish(const Frame& frame, LinearContact linear, Effect& effect) const {
    linear.adhesive = !settings.clamp;
    if (settings.clamp && linear.k * -linear.gap > settings.f_max) linear.gap = -settings.f_max / linear.k;
    tell_at_start(*topology, frame, dt, linear);
    effect.contacts.push_back(linear);
}

}  // namespace trocar
