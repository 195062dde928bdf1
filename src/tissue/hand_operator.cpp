#include "tissue/hand_operator.hpp"

#include <algorithm>

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// +1 when the contact pushes one of the bodies, -1 when it reacts on one of them without moving tissue, else 0.
int side_of(const LinearContact& contact, const Topology& topology, std::span<const Index> bodies) {
    bool pushes_tissue = false;
    for (std::size_t i = 0; i < 3; ++i) {
        if (contact.vertices[i] < 0 || contact.weights[i] == 0.0) continue;
        for (const Index body : bodies) {
            if (topology.bodies[at(body)].vertices.contains(contact.vertices[i])) return 1;
        }
        for (const BodyRange& body : topology.bodies) {
            pushes_tissue =
                pushes_tissue || (body.kind == BodyKind::tissue && body.vertices.contains(contact.vertices[i]));
        }
    }
    if (pushes_tissue) return 0;
    return std::find(bodies.begin(), bodies.end(), contact.reaction_body) != bodies.end() ? -1 : 0;
}

/// Where the contact loads the instrument, m.
Vector3 point_of(const LinearContact& contact, int side, const Frame& frame) {
    if (side < 0) return contact.reaction_point;
    Vector3 point = Vector3::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
        if (contact.vertices[i] >= 0) point += contact.weights[i] * frame.position.col(contact.vertices[i]);
    }
    return point;
}

}  // namespace

Wrench advance_operator(const OperatorModel& model, const Topology& topology, const Frame& frame,
                        std::span<const Index> bodies, const Vector3& target, const Vector3& target_velocity,
                        const Effect& effect, const Wrench& external, double dt, int substeps, OperatorState& state) {
    const int steps = std::max(1, substeps);
    const double h = dt / steps;
    const Vector3 first_position = state.position;
    const Vector3 first_velocity = state.velocity;
    Wrench mean = external;
    for (int step = 0; step < steps; ++step) {
        const Vector3 hand = model.hand_stiffness * (target - state.position) +
                             model.hand_damping * (target_velocity - state.velocity) - model.damping * state.velocity;
        const Vector3 free_velocity = state.velocity + h / model.mass * (hand + external.force);
        // All contacts together: (m + h Σ c n nᵀ) v' = m v + h Σ (k d - c offset) n with c = mu + h k, where a
        // contact's rate is offset + v'·n. Those that would pull leave the sum, which is then solved again.
        Vector3 velocity = free_velocity;
        Vector3 moment = Vector3::Zero();
        constexpr int most_changes = 8;
        for (int change = 0; change < most_changes; ++change) {
            Matrix3 matrix = model.mass * Matrix3::Identity();
            Vector3 right_side = model.mass * free_velocity;
            moment.setZero();
            for (const LinearContact& contact : effect.contacts) {
                const int side = side_of(contact, topology, bodies);
                if (side == 0) continue;
                double first_rate = -contact.face_velocity;
                for (std::size_t i = 0; i < 3; ++i) {
                    if (contact.vertices[i] < 0) continue;
                    first_rate += contact.weights[i] * frame.velocity.col(contact.vertices[i]).dot(contact.normal);
                }
                const Vector3 n = side * contact.normal;
                const double offset = first_rate - first_velocity.dot(n);
                const double depth = -contact.gap - step * h * offset - (state.position - first_position).dot(n);
                const double c = std::max(contact.mu, 0.0) + h * contact.k;
                const double pressure =
                    contact.k * depth - c * offset - std::min(contact.mu, 0.0) * (offset + state.velocity.dot(n));
                const bool presses = change == 0 || pressure - c * velocity.dot(n) > 0.0;
                if (!contact.bilateral && (depth < 0.0 || !(contact.adhesive || presses))) continue;
                matrix += h * c * n * n.transpose();
                right_side += h * pressure * n;
                // Of the solution so far: exact once the rounds have settled.
                moment += point_of(contact, side, frame).cross((pressure - c * velocity.dot(n)) * n);
            }
            const Vector3 solved = matrix.inverse() * right_side;
            const bool settled = change > 0 && (solved - velocity).norm() <= 1e-12 * solved.norm();
            velocity = solved;
            if (settled) break;
        }
        mean.force += model.mass / (h * steps) * (velocity - free_velocity);
        mean.moment += moment / steps;
        state.velocity = velocity;
        state.position += h * velocity;
    }
    return mean;
}

}  // namespace trocar
