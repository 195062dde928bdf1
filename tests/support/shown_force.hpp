// Force on an instrument that an ResponseOutput gives at the response's frame, without a stepper, for tests of single
// calls. A run reports the mean over the tick instead.
#pragma once

#include <algorithm>

#include "contact/response_output.hpp"
#include "respond/common.hpp"
#include "scene/world.hpp"

namespace trocar::test {

/// Force of a contact along its normal at the frame, N: k d - mu (v_P·n - face velocity). It is at most the limit. It
/// is not negative unless adhesive or bilateral, and 0 without penetration unless bilateral.
inline double force_at_frame(const Topology& topology, const Frame& frame, double dt, const ContactForceLaw& contact) {
    const double gap = contact.gap + scripted_rate(topology, frame, dt, contact) * dt;
    if (!contact.bilateral() && gap > 0.0) return 0.0;
    double rate = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        if (contact.vertices[i] < 0) continue;
        rate += contact.weights[i] * frame.velocity.col(contact.vertices[i]).dot(contact.normal);
    }
    if (any_vertex(contact.reaction_vertices) >= 0) {
        for (std::size_t i = 0; i < 3; ++i) {
            if (contact.reaction_vertices[i] < 0) continue;
            rate -= contact.reaction_weights[i] * frame.velocity.col(contact.reaction_vertices[i]).dot(contact.normal);
        }
    } else {
        rate -= contact.face_velocity;
    }
    const double force = -contact.k * gap - contact.mu * rate;
    const double pressed = contact.pulls() ? force : std::max(force, 0.0);
    return std::clamp(pressed, -contact.limit, contact.limit);
}

/// N, sum over contacts and wrenches.
inline Vector3 shown_force(const Topology& topology, const Frame& frame, double dt, const ResponseOutput& output,
                           Index body) {
    Vector3 sum = output.wrench[static_cast<std::size_t>(body)].force;
    for (const ContactForceLaw& contact : output.contacts) {
        const Vector3 force = force_at_frame(topology, frame, dt, contact) * contact.normal;
        for (std::size_t i = 0; i < 3; ++i) {
            const Index vertex = contact.vertices[i];
            if (vertex >= 0 && topology.body_of_vertex(vertex) == body) sum += contact.weights[i] * force;
        }
        if (contact.reaction_body == body) sum -= force;
    }
    return sum;
}

}  // namespace trocar::test
