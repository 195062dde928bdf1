#include "respond/tissue_contacts.hpp"

#include <vector>

#include "respond/equations.hpp"

namespace trocar {
namespace {

constexpr double tissue_restitution = 0.2;  ///< between tissues, of the profile `corrected`

/// Calls act(vertex, sign × weight) for each vertex of nonzero weight.
template <typename Act>
void visit(const ContactPoint& point, double sign, const Act& act) {
    for (std::size_t i = 0; i < 3; ++i) {
        if (point.vertices[i] >= 0 && point.weights[i] != 0.0) act(point.vertices[i], sign * point.weights[i]);
    }
}

}  // namespace

void exchange(ThesisState& state, const Frame& frame, const Contact& contact) {
    const Topology& topology = *state.topology;
    const equations::CornerPair pair =
        equations::closest_corners(corners_of(topology.triangles, frame.position, contact.a),
                                   corners_of(topology.triangles, frame.position, contact.b));
    const Index v1 = topology.triangles(pair.first, contact.a);
    const Index v2 = topology.triangles(pair.second, contact.b);
    if (state.fixed(v1) && state.fixed(v2)) return;
    constexpr double immovable = 1e12;  // kg
    const double m1 = state.fixed(v1) ? immovable : state.materials->mass[at(v1)];
    const double m2 = state.fixed(v2) ? immovable : state.materials->mass[at(v2)];
    const equations::Exchange result =
        equations::tissue_tissue(m1, m2, state.velocity(frame, v1), state.velocity(frame, v2));
    if (!result.direction_defined) return;
    if (!state.fixed(v1)) state.edit(frame, v1).velocity = result.velocity1_after;
    if (!state.fixed(v2)) state.edit(frame, v2).velocity = result.velocity2_after;
}

void bounce(ThesisState& state, const Frame& frame, const Vector3& normal, const ContactPoint& pushed,
            const ContactPoint& other, double depth, double k, ResponseOutput& output) {
    const std::vector<double>& mass = state.materials->mass;
    double speed = 0.0;
    double mobility = 0.0;
    const auto measure = [&](Index vertex, double weight) {
        speed += weight * state.velocity(frame, vertex).dot(normal);
        if (!state.fixed(vertex)) mobility += weight * weight / mass[at(vertex)];
    };
    visit(pushed, 1.0, measure);
    visit(other, -1.0, measure);
    if (mobility == 0.0) return;
    if (speed < 0.0 && depth >= 0.0) {
        const double impulse = -(1.0 + tissue_restitution) * speed / mobility;
        const auto push = [&](Index vertex, double weight) {
            if (!state.fixed(vertex)) {
                state.edit(frame, vertex).velocity += weight * impulse / mass[at(vertex)] * normal;
            }
        };
        visit(pushed, 1.0, push);
        visit(other, -1.0, push);
    }
    ContactForceLaw linear;
    linear.vertices = pushed.vertices;
    linear.weights = pushed.weights;
    linear.reaction_vertices = other.vertices;
    linear.reaction_weights = other.weights;
    linear.normal = normal;
    linear.gap = -depth;
    linear.k = k;
    state.finish(frame, linear, output);
}

}  // namespace trocar
