#include "respond/thesis_contacts.hpp"

#include <algorithm>

#include "respond/equations.hpp"

namespace trocar {
namespace {

bool names_vertex(const ContactPoint& point) { return point.weights[0] == 1.0; }

/// m, after this tick's scripted motion.
double depth_of_features(const Contact& contact) { return -(contact.gap + contact.approach); }

}  // namespace

bool enters_with_b(const Contact& contact) {
    return contact.kind == ContactCase::b_enters_a ||
           (contact.kind == ContactCase::point_face && names_vertex(contact.on_b));
}

void read_vertices(const ThesisState& state, const Frame& frame, const Contact& contact,
                   std::vector<VertexInFace>& out) {
    out.clear();
    const Topology& topology = *state.topology;
    const bool b_enters = contact.kind == ContactCase::b_enters_a;
    const Index entering = b_enters ? contact.b : contact.a;
    const Index deepest = b_enters ? contact.vertex_b : contact.vertex_a;
    VertexInFace v;
    v.vertex_body = b_enters ? contact.body_b : contact.body_a;
    v.face_body = b_enters ? contact.body_a : contact.body_b;
    v.triangle = b_enters ? contact.a : contact.b;
    const Vector3 face_normal = b_enters ? contact.normal : Vector3(-contact.normal);
    const Corners corners = corners_of(topology.triangles, frame.position, v.triangle);
    for (int i = 0; i < 3; ++i) {
        v.vertex = topology.triangles(i, entering);
        if (v.vertex != deepest && !state.settings.corrected()) continue;
        const Vector3 x = frame.position.col(v.vertex);
        v.depth = v.vertex == deepest ? contact.depth : -face_normal.dot(x - corners[0]);
        const Vector3 weights = closest_point_on_triangle(corners, x);
        v.distance = (x - equations::point_at(corners, weights)).norm();
        if (v.vertex != deepest && (v.depth <= 0.0 || v.distance > 1.0001 * v.depth)) continue;
        if (state.settings.corrected()) v.depth = std::min(v.depth, v.distance);
        v.face = ContactPoint::in_triangle(topology.triangles, v.triangle, weights);
        v.nearest = v.vertex == deepest ? (b_enters ? contact.vertex_a : contact.vertex_b)
                                        : topology.triangles(equations::nearest_corner(corners, x), v.triangle);
        v.normal = state.settings.corrected()
                       ? state.surface.blended_normal(topology, frame.position, v.triangle, weights)
                       : face_normal;
        out.push_back(v);
    }
}

VertexInFace read_point_face(const Contact& contact) {
    const bool b_enters = names_vertex(contact.on_b);
    VertexInFace v;
    v.vertex = b_enters ? contact.on_b.vertices[0] : contact.on_a.vertices[0];
    v.vertex_body = b_enters ? contact.body_b : contact.body_a;
    v.face_body = b_enters ? contact.body_a : contact.body_b;
    v.face = b_enters ? contact.on_a : contact.on_b;
    v.nearest = v.face.heaviest();
    v.normal = b_enters ? contact.normal : Vector3(-contact.normal);
    v.depth = depth_of_features(contact);
    v.distance = v.depth;
    return v;
}

CrossedEdges read_crossing(const ThesisState& state, const Frame& frame, const Contact& contact) {
    const auto load = [&](Index triangle, Index vertex) {
        if (!state.settings.distribute) return ContactPoint::at_vertex(vertex);
        const Corners corners = corners_of(state.topology->triangles, frame.position, triangle);
        return ContactPoint::in_triangle(state.topology->triangles, triangle,
                                         closest_point_on_triangle(corners, contact.point));
    };
    const bool tissue = state.kind(contact.body_b) == BodyKind::tissue;
    return {.body_a = contact.body_a,
            .body_b = contact.body_b,
            .a = load(contact.a, contact.vertex_a),
            .b = load(contact.b, contact.vertex_b),
            .vertex_a = contact.vertex_a,
            .vertex_b = contact.vertex_b,
            .direction = state.settings.corrected() ? contact.normal : contact.interval_direction,
            .depth = state.settings.corrected() ? contact.depth : contact.interval_length,
            .stiffness = tissue ? state.materials->triangle_stiffness[at(contact.b)] : 0.0,
            .place = contact.point};
}

CrossedEdges read_edge_edge(const ThesisState& state, const Contact& contact) {
    const ContactPoint& a = contact.on_a;
    const ContactPoint& b = contact.on_b;
    const bool tissue = state.kind(contact.body_b) == BodyKind::tissue;
    return {.body_a = contact.body_a,
            .body_b = contact.body_b,
            .a = a,
            .b = b,
            .vertex_a = a.heaviest(),
            .vertex_b = b.heaviest(),
            .direction = contact.normal,
            .depth = depth_of_features(contact),
            .stiffness = tissue ? state.materials->mean_stiffness[at(b.heaviest())] : 0.0,
            .place = contact.point};
}

}  // namespace trocar
