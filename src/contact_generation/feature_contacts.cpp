#include "contact_generation/feature_contacts.hpp"

#include <algorithm>

namespace trocar {
Contact point_face_contact(const TickStart& start, const PointFace& one, const Vector3& normal, double gap) {
    Contact contact;
    contact.kind = ContactCase::point_face;
    const ContactPoint vertex = ContactPoint::at_vertex(one.vertex);
    const ContactPoint face = ContactPoint::in_triangle(start.topology().triangles, one.triangle, one.weights);
    const bool vertex_first = one.vertex_body < one.face_body;
    contact.body_a = vertex_first ? one.vertex_body : one.face_body;
    contact.body_b = vertex_first ? one.face_body : one.vertex_body;
    contact.on_a = vertex_first ? vertex : face;
    contact.on_b = vertex_first ? face : vertex;
    contact.normal = vertex_first ? Vector3(-normal) : normal;
    contact.gap = gap;
    contact.side = gap < 0.0 ? -1 : 1;
    contact.id = point_face_id(one.vertex, one.triangle);
    finish_contact(start, contact);
    return contact;
}

Contact edge_edge_contact(const TickStart& start, const FeatureMesh& mesh, const EdgeEdge& one, bool crossed) {
    Contact contact;
    contact.kind = ContactCase::edge_edge;
    const auto on_edge = [&mesh](Index edge, double fraction) {
        return ContactPoint{{mesh.ends(edge)[0], mesh.ends(edge)[1], -1}, {1.0 - fraction, fraction, 0.0}};
    };
    contact.body_a = one.body_a;
    contact.body_b = one.body_b;
    contact.on_a = on_edge(one.edge_a, one.fraction_a);
    contact.on_b = on_edge(one.edge_b, one.fraction_b);
    contact.normal = crossed ? Vector3(-one.normal) : one.normal;
    contact.gap = crossed ? -one.distance : one.distance;
    contact.side = crossed ? -1 : 1;
    contact.id = edge_edge_id(one.edge_a, one.edge_b);
    finish_contact(start, contact);
    return contact;
}

double home_side(const BodyRange& body) { return !body.closed && body.start_side == SheetSide::back ? -1.0 : 1.0; }

void finish_contact(const TickStart& start, Contact& contact) {
    const auto scripted = [&](const ContactPoint& point, Index body) {
        return point.blend_of([&](Index vertex) { return start.scripted(vertex, body); });
    };
    contact.approach =
        (scripted(contact.on_b, contact.body_b) - scripted(contact.on_a, contact.body_a)).dot(contact.normal);
    contact.point = contact.on_a.blend_of([&](Index vertex) { return start.position(vertex, contact.body_a); });
    contact.depth = std::max(0.0, -contact.gap);
}

}  // namespace trocar
