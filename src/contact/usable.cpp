#include "contact/usable.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar {
namespace {

bool has_geometry(ContactCase kind) {
    return kind == ContactCase::a_enters_b || kind == ContactCase::b_enters_a || kind == ContactCase::edges_cross ||
           kind == ContactCase::point_face || kind == ContactCase::edge_edge;
}

/// -1 stands for none.
bool exists(Index number, Index count) { return number >= -1 && number < count; }

bool vertices_exist(const std::array<Index, 3>& vertices, const Topology& topology) {
    return std::all_of(vertices.begin(), vertices.end(),
                       [&topology](Index vertex) { return exists(vertex, topology.vertex_count); });
}

bool all_finite(const std::array<double, 3>& numbers) { return std::isfinite(numbers[0] + numbers[1] + numbers[2]); }

/// Largest deviation of a unit vector's squared length from 1.
constexpr double most_off_unit = 1e-6;
bool is_unit(const Vector3& normal) { return std::abs(normal.squaredNorm() - 1.0) <= most_off_unit; }

/// Sum of the weights of set vertices; 1 if none is set.
double weight_sum(const std::array<Index, 3>& vertices, const std::array<double, 3>& weights) {
    double sum = 0.0;
    bool any = false;
    for (std::size_t corner = 0; corner < 3; ++corner) {
        if (vertices.at(corner) < 0) continue;
        any = true;
        sum += weights.at(corner);
    }
    return any ? sum : 1.0;
}
constexpr double most_off_one = 1e-6;

/// Fault of a contact with finite numbers and existing vertices; null if there is none.
const char* fault_of(const ContactForceLaw& one) {
    if (!is_unit(one.normal)) return "a normal that is not a unit, of contact";
    if (std::abs(weight_sum(one.vertices, one.weights) - 1.0) > most_off_one ||
        std::abs(weight_sum(one.reaction_vertices, one.reaction_weights) - 1.0) > most_off_one)
        return "weights whose sum is not 1, of contact";
    // A negative stiffness creates energy; contacts that intend it are marked `adhesive`. Negative damping passes: the
    // thesis prints it, and blow_up.hpp searches for its effect.
    if ((one.k < 0.0 && !one.adhesive) || one.limit < 0.0 || one.friction < 0.0 || one.tangent_k < 0.0)
        return "a stiffness, friction or limit below 0, of contact";
    return nullptr;
}

}  // namespace

Outcome check_contacts(const Topology& topology, const ContactSet& contacts) {
    const auto failed = [](OutcomeKind kind, std::size_t number, const char* what) {
        return Outcome{kind, fmt::format("contacts: {} of contact {}", what, number)};
    };
    for (std::size_t i = 0; i < contacts.contacts.size(); ++i) {
        const Contact& one = contacts.contacts[i];
        if (!exists(one.a, topology.triangle_count()) || !exists(one.b, topology.triangle_count()))
            return failed(OutcomeKind::threw, i, "a triangle that there is not");
        // A contact of triangles or features must name its bodies: responses find force laws by body pair.
        const bool of_bodies =
            (one.a >= 0 && one.b >= 0) || one.kind == ContactCase::point_face || one.kind == ContactCase::edge_edge;
        if (!exists(one.body_a, topology.body_count()) || !exists(one.body_b, topology.body_count()) ||
            (of_bodies && (one.body_a < 0 || one.body_b < 0)))
            return failed(OutcomeKind::threw, i, "a body that there is not");
        if (!exists(one.vertex_a, topology.vertex_count) || !exists(one.vertex_b, topology.vertex_count) ||
            !vertices_exist(one.on_a.vertices, topology) || !vertices_exist(one.on_b.vertices, topology))
            return failed(OutcomeKind::threw, i, "a vertex that there is not");
        if (!has_geometry(one.kind)) continue;
        if (!one.point.allFinite() || !one.normal.allFinite() || !std::isfinite(one.depth))
            return failed(OutcomeKind::not_finite, i, "a point, normal or depth that is not finite");
        if (!std::isfinite(one.gap) || !std::isfinite(one.approach) || !all_finite(one.on_a.weights) ||
            !all_finite(one.on_b.weights))
            return failed(OutcomeKind::not_finite, i, "a gap, approach or weight that is not finite");
        if (!is_unit(one.normal)) return failed(OutcomeKind::threw, i, "a normal that is not a unit");
    }
    return {};
}

Outcome check_output(const Topology& topology, const ResponseOutput& output) {
    const auto failed = [](OutcomeKind kind, const char* what, std::size_t number) {
        return Outcome{kind, fmt::format("respond: {} {}", what, number)};
    };
    for (std::size_t i = 0; i < output.contacts.size(); ++i) {
        const ContactForceLaw& one = output.contacts[i];
        if (!vertices_exist(one.vertices, topology) || !vertices_exist(one.reaction_vertices, topology))
            return failed(OutcomeKind::threw, "a vertex that there is not, of contact", i);
        if (!exists(one.reaction_body, topology.body_count()))
            return failed(OutcomeKind::threw, "a body that there is not, of contact", i);
        // The sum is not finite if a term is not.
        const double sum = one.gap + one.k + one.mu + one.face_velocity + one.friction + one.tangent_k +
                           one.normal.sum() + one.reaction_point.sum() + one.other_point.sum() +
                           one.surface_velocity.sum() + one.other_edge.sum();
        if (!std::isfinite(sum) || std::isnan(one.limit) || !all_finite(one.weights) ||
            !all_finite(one.reaction_weights))
            return failed(OutcomeKind::not_finite, "a number that is not finite, of contact", i);
        if (one.role == ContactRole::solved && output.solver == nullptr)
            return failed(OutcomeKind::threw, "no solver for its impulse, of contact", i);
        if (one.role == ContactRole::solved &&
            (one.k != 0.0 || one.mu != 0.0 || one.friction > 0.0 || one.adhesive || std::isfinite(one.limit)))
            return failed(OutcomeKind::threw, "a law, friction or limit beside its solver, of contact", i);
        if (const char* fault = fault_of(one)) return failed(OutcomeKind::threw, fault, i);
    }
    for (std::size_t i = 0; i < output.position_corrections.size(); ++i) {
        const PositionCorrection& one = output.position_corrections[i];
        if (one.vertex < 0 || one.vertex >= topology.vertex_count)
            return failed(OutcomeKind::threw, "a vertex that there is not, of position correction", i);
        if (!one.position.allFinite() || !one.velocity.allFinite())
            return failed(OutcomeKind::not_finite, "a number that is not finite, of position correction", i);
    }
    if (!std::isfinite((output.held_force.array() * 0.0).sum()))
        return {OutcomeKind::not_finite, "respond: a held force that is not finite"};
    for (std::size_t body = 0; body < output.wrench.size(); ++body) {
        if (!output.wrench[body].force.allFinite() || !output.wrench[body].moment.allFinite())
            return failed(OutcomeKind::not_finite, "a wrench that is not finite, of body", body);
    }
    return {};
}

}  // namespace trocar
