#include "respond/thesis_state.hpp"

#include <algorithm>
#include <cmath>

#include "respond/equations.hpp"

namespace trocar {
namespace {

// Constants of the profile `corrected`.
constexpr double kappa = 3e6;          ///< N/m³, elastic foundation
constexpr double f_max = 5.0;          ///< N, largest spring force of one contact
constexpr double release_time = 0.05;  ///< s, decay of the force on a vertex that slips or is released

}  // namespace

void ThesisState::prepare(const Topology& the_topology, const Materials& the_materials) {
    topology = &the_topology;
    materials = &the_materials;
    laws.prepare(the_topology, the_materials, settings.law);
    springs.prepare(the_topology, the_materials);
    surface.prepare(the_topology);
    slot_.assign(at(the_topology.vertex_count), -1);
    edits_.clear();
    has_tissue = std::any_of(the_topology.bodies.begin(), the_topology.bodies.end(),
                             [](const BodyRange& body) { return body.kind == BodyKind::tissue; });
    if (has_tissue) {
        grasp.prepare(the_topology, the_materials,
                      {.both_jaws = settings.corrected(), .release_time = settings.corrected() ? release_time : 0.0});
    }
}

void ThesisState::begin(const Frame& frame, double the_dt) {
    dt = the_dt;
    for (const TissueEdit& edit : edits_) slot_[at(edit.vertex)] = -1;
    edits_.clear();
    surface.measure(*topology, frame.position);
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
    return settings.corrected() ? kappa * surface.area(vertex) : on_tissue;
}

void ThesisState::finish(const Frame& frame, ContactForceLaw linear, ResponseOutput& output) const {
    linear.adhesive = !settings.corrected();
    if (settings.corrected() && linear.k * -linear.gap > f_max) linear.gap = -f_max / linear.k;
    report_at_start(*topology, frame, dt, linear);
    output.contacts.push_back(linear);
}

}  // namespace trocar
