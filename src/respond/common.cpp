#include "respond/common.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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

double scripted_rate(const Topology& topology, const Frame& frame, double dt, const ContactForceLaw& contact) {
    double rate = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Index vertex = contact.vertices[i];
        if (vertex < 0 || contact.weights[i] == 0.0) continue;
        const Index body = topology.body_of_vertex(vertex);
        if (topology.bodies[at(body)].kind == BodyKind::tissue) continue;
        const Vector3 velocity = frame.velocity.col(vertex) - frame.operator_velocity(body, dt);
        rate += contact.weights[i] * velocity.dot(contact.normal);
    }
    if (any_vertex(contact.reaction_vertices) >= 0) return rate;  // tissue
    rate -= contact.face_velocity;
    if (contact.reaction_body >= 0) rate += frame.operator_velocity(contact.reaction_body, dt).dot(contact.normal);
    return rate;
}

void report_at_start(const Topology& topology, const Frame& frame, double dt, ContactForceLaw& contact) {
    contact.gap -= scripted_rate(topology, frame, dt, contact) * dt;
}

void react_on_line(const Frame& frame, Index body, ContactForceLaw& contact) {
    contact.reaction_body = body;
    const ContactPoint pushed{contact.vertices, contact.weights};
    contact.reaction_point = pushed.blend(frame.position) - contact.gap * contact.normal;
}

Parameter stiffness_parameter(const std::string& auto_meaning) {
    return number_parameter("k", "N/m", "auto", 0.0, 1e9, "contact stiffness; auto: " + auto_meaning, {"auto"});
}

}  // namespace trocar
