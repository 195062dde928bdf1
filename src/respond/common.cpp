#include "respond/common.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
CollisionClass collision_class(BodyKind a, BodyKind b) {
    if (b < a) std::swap(a, b);
    if (a == BodyKind::instrument) {
        if (b == BodyKind::instrument) return CollisionClass::instrument_instrument;
        return b == BodyKind::rigid ? CollisionClass::instrument_rigid : CollisionClass::instrument_tissue;
    }
    if (b != BodyKind::tissue) return CollisionClass::none;
    return a == BodyKind::rigid ? CollisionClass::rigid_tissue : CollisionClass::tissue_tissue;
}

equations::Corners corners_of(const Topology& topology, const Matrix3X& position, Index triangle) {
    const auto corner = topology.triangles.col(triangle);
    return {position.col(corner[0]), position.col(corner[1]), position.col(corner[2])};
}

void PairLaws::prepare(const Topology& topology, const Materials& materials, double k, double mu) {
    constexpr double default_mu = 2.0;
    bodies_ = topology.body_count();
    table_.assign(at(bodies_ * bodies_), {});
    for (Index a = 0; a < bodies_; ++a) {
        for (Index b = 0; b < bodies_; ++b) {
            Law& law = table_[at(a * bodies_ + b)];
            law.kind = collision_class(topology.bodies[at(a)].kind, topology.bodies[at(b)].kind);
            const Index pair = topology.body_pair(a, b);
            if (pair >= 0 && at(pair) < materials.contact_laws.size()) {
                law.k = materials.contact_laws[at(pair)].k;
                law.mu = materials.contact_laws[at(pair)].mu;
            }
            if (!std::isnan(k)) law.k = k;
            if (!std::isnan(mu)) law.mu = mu;
            if (std::isnan(law.mu)) law.mu = default_mu;
        }
    }
}

ContactPoint point_in_triangle(const Topology& topology, Index triangle, const Vector3& weights) {
    ContactPoint point;
    for (int i = 0; i < 3; ++i) {
        point.vertices[at(i)] = topology.triangles(i, triangle);
        point.weights[at(i)] = weights[i];
    }
    return point;
}

Vector3 hand_velocity(const Frame& frame, double dt, Index body) {
    return at(body) < frame.hand_motion.size() ? Vector3(frame.hand_motion[at(body)] / dt) : Vector3::Zero();
}

double scripted_rate(const Topology& topology, const Frame& frame, double dt, const LinearContact& contact) {
    double rate = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Index vertex = contact.vertices[i];
        if (vertex < 0 || contact.weights[i] == 0.0) continue;
        const Index body = topology.body_of_vertex(vertex);
        if (topology.bodies[at(body)].kind == BodyKind::tissue) continue;
        const Vector3 velocity = frame.velocity.col(vertex) - hand_velocity(frame, dt, body);
        rate += contact.weights[i] * velocity.dot(contact.normal);
    }
    if (contact.reaction_vertices[0] >= 0) return rate;  // tissue
    rate -= contact.face_velocity;
    if (contact.reaction_body >= 0) rate += hand_velocity(frame, dt, contact.reaction_body).dot(contact.normal);
    return rate;
}

void tell_at_start(const Topology& topology, const Frame& frame, double dt, LinearContact& contact) {
    contact.gap -= scripted_rate(topology, frame, dt, contact) * dt;
}

Parameter stiffness_parameter(const std::string& default_meaning) {
    return {.name = "k",
            .unit = "N/m",
            .default_value = "auto",
            .minimum = 0.0,
            .maximum = 1e9,
            .meaning = "contact stiffness; auto: the scene's, else " + default_meaning,
            .words = {"auto"}};
}

Parameter damping_parameter() {
    return {.name = "mu",
            .unit = "N s/m",
            .default_value = "auto",
            .minimum = 0.0,
            .maximum = 1e6,
            .meaning = "contact damping; auto: the scene's, else 2",
            .words = {"auto"}};
}

}  // namespace trocar
