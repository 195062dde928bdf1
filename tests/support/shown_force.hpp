// Force on an instrument that an ResponseOutput gives at the response's frame, without a stepper, for tests of single
// calls. A run reports the mean over the tick instead.
#pragma once

#include <algorithm>
#include <array>

#include "contact/contact.hpp"
#include "contact/response_output.hpp"
#include "respond/common.hpp"
#include "scene/world.hpp"

namespace trocar::test {

/// Sum of columns (3×N) that the vertices of a contact force law stand for.
inline Vector3 blend(const std::array<Index, 3>& vertices, const std::array<double, 3>& weights,
                     const Matrix3X& columns) {
    return ContactPoint{vertices, weights}.blend(columns);
}

/// Force of a contact along its normal at the frame, N: k d - mu (v_P·n - face velocity). It is at most the limit. It
/// is not negative unless adhesive or bilateral, and 0 without penetration unless bilateral.
inline double force_at_frame(const Topology& topology, const Frame& frame, double dt, const ContactForceLaw& contact) {
    const double gap = contact.gap + scripted_rate(topology, frame, dt, contact) * dt;
    if (!contact.bilateral() && gap > 0.0) return 0.0;
    const bool on_vertices = any_vertex(contact.reaction_vertices) >= 0;
    const double reaction_rate =
        on_vertices ? blend(contact.reaction_vertices, contact.reaction_weights, frame.velocity).dot(contact.normal)
                    : contact.face_velocity;
    const double rate = blend(contact.vertices, contact.weights, frame.velocity).dot(contact.normal) - reaction_rate;
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
