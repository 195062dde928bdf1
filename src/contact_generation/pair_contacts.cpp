#include "contact_generation/pair_contacts.hpp"

#include <cmath>

#include "contact_generation/feature_contacts.hpp"
#include "geometry/triangle_distance.hpp"

namespace trocar {
void place_at_start(const TickStart& start, Contact& contact) {
    if (contact.a < 0 || contact.b < 0) return;
    const Topology& topology = start.topology();
    const Matrix3X& position = start.frame().position;
    contact.body_a = topology.body_of_triangle[at(contact.a)];
    contact.body_b = topology.body_of_triangle[at(contact.b)];
    if (!contact.normal.allFinite() || !contact.point.allFinite() || !std::isfinite(contact.depth)) return;
    const Vector3 where = contact.point;
    const double depth = contact.depth;
    const auto on = [&](Index triangle, Index entering) {
        if (entering >= 0) return ContactPoint::at_vertex(entering);
        return ContactPoint::in_triangle(
            topology.triangles, triangle,
            closest_point_on_triangle(corners_of(topology.triangles, position, triangle), where));
    };
    contact.on_a = on(contact.a, contact.kind == ContactCase::a_enters_b ? contact.vertex_a : -1);
    contact.on_b = on(contact.b, contact.kind == ContactCase::b_enters_a ? contact.vertex_b : -1);
    finish_contact(start, contact);
    // The equations of the thesis read point and depth of the frame.
    contact.point = where;
    contact.depth = depth;
    contact.gap = -depth - contact.approach;
}

}  // namespace trocar
