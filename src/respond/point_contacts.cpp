#include "respond/point_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "respond/equations.hpp"

namespace trocar {
namespace {

/// Contact of features. Depth is the predicted penetration after the tick's scripted motion, negative if open.
bool describe_features(const Contact& contact, PointContact& out) {
    out = {};
    out.body_a = contact.body_a;
    out.body_b = contact.body_b;
    out.normal = contact.normal;
    out.depth = -(contact.gap + contact.approach);
    if (!out.normal.allFinite() || !std::isfinite(out.depth)) return false;
    out.a = {contact.on_a.vertices, contact.on_a.weights};
    out.b = {contact.on_b.vertices, contact.on_b.weights};
    out.distance = std::abs(contact.gap);
    out.of_vertex = contact.kind == ContactCase::point_face;
    const bool vertex_of_a = out.of_vertex && out.a.weights[0] == 1.0;
    const ContactPoint& stands = vertex_of_a ? out.a : out.b;
    out.vertex = stands.heaviest();
    out.other = vertex_of_a ? out.body_b : out.body_a;
    return true;
}

bool describe(const Topology& topology, const Frame& frame, const Contact& contact, PointContact& out) {
    if (contact.kind == ContactCase::point_face || contact.kind == ContactCase::edge_edge) {
        return describe_features(contact, out);
    }
    if (contact.kind == ContactCase::touch || contact.kind == ContactCase::coplanar ||
        contact.kind == ContactCase::degenerate || contact.a < 0 || contact.b < 0) {
        return false;
    }
    out = {};
    out.body_a = topology.body_of_triangle[at(contact.a)];
    out.body_b = topology.body_of_triangle[at(contact.b)];
    out.normal = contact.normal;
    out.depth = contact.depth;
    if (!out.normal.allFinite() || !std::isfinite(out.depth) || out.depth < 0.0) return false;
    const bool vertex_of_a = contact.kind == ContactCase::a_enters_b && contact.vertex_a >= 0;
    const bool vertex_of_b = contact.kind == ContactCase::b_enters_a && contact.vertex_b >= 0;
    Vector3 point = contact.point;
    if (vertex_of_a) point = frame.position.col(contact.vertex_a);
    if (vertex_of_b) point = frame.position.col(contact.vertex_b);
    out.of_vertex = vertex_of_a || vertex_of_b;
    if (!point.allFinite()) return false;
    const auto spread = [&](Index triangle) {
        const Corners corners = corners_of(topology.triangles, frame.position, triangle);
        return ContactPoint::in_triangle(topology.triangles, triangle, closest_point_on_triangle(corners, point));
    };
    out.a = vertex_of_a ? ContactPoint::at_vertex(contact.vertex_a) : spread(contact.a);
    out.b = vertex_of_b ? ContactPoint::at_vertex(contact.vertex_b) : spread(contact.b);
    out.distance = (out.b.blend(frame.position) - out.a.blend(frame.position)).norm();
    // Without an entering vertex, the vertex of b with the largest weight represents the contact.
    if (vertex_of_a) {
        out.vertex = contact.vertex_a;
        out.other = out.body_b;
    } else {
        out.vertex = out.b.heaviest();
        out.other = out.body_a;
    }
    return true;
}

constexpr double alike = 1e-9;  ///< relative tolerance of equal depths and distances, well above rounding

/// Order of a vertex's contacts: the deepest first, then the nearest. Coplanar faces are equally deep up to rounding;
/// the nearest one has the load's corners. Positive: a precedes b; 0: a tie.
int compare(const PointContact& a, const PointContact& b) {
    const double deeper = a.depth - b.depth;
    if (std::abs(deeper) > alike * (a.depth + a.distance + b.distance)) return deeper > 0.0 ? 1 : -1;
    const double nearer = b.distance - a.distance;
    if (std::abs(nearer) > alike * (a.depth + a.distance + b.distance)) return nearer > 0.0 ? 1 : -1;
    return 0;
}

}  // namespace

Parameter reduction_parameter() {
    return choice_parameter(
        "reduction", "vertex", {"vertex", "pair"},
        "of closed contacts one per vertex and other body, the deepest, so that force does not grow with "
        "the number of faces (a scene's k); or each pair of triangles or features (hard contact)");
}

void PointContacts::prepare(const Topology& topology) {
    first_.assign(at(topology.vertex_count), -1);
    list_.clear();
    list_.reserve(std::min(at(topology.vertex_count), usual_contacts));
}

void PointContacts::gather(const Topology& topology, const Frame& frame, const ContactSet& contacts, bool reduce,
                           ResponseOutput& output) {
    for (const PointContact& contact : list_) first_[at(contact.vertex)] = -1;
    list_.clear();
    // Edges at an entered vertex cross the other body's edges: the same overlap with other normals. Vertices therefore
    // come first and replace the edge contacts beside them.
    for (const bool edges : {false, true}) {
        if (edges && !reduce) break;
        for (const Contact& contact : contacts.contacts) {
            const bool of_edges = contact.kind == ContactCase::edges_cross || contact.kind == ContactCase::edge_edge;
            if (reduce && edges != of_edges) continue;
            PointContact point;
            const bool described = describe(topology, frame, contact, point);
            point.id = contact.id;
            if (!described) {
                output.skip(SkipReason::no_direction);
            } else if (!reduce || point.depth < 0.0) {
                list_.push_back(point);
            } else if ((edges && is_left_to_a_vertex(contact, point)) || !keep_deepest(point)) {
                output.skip(SkipReason::reduced);
            }
        }
    }
    for (PointContact& contact : list_) {
        Vector3 sum = Vector3::Zero();
        for (int i = 0; i < contact.normal_count; ++i) sum += contact.normals[at(i)];
        const double length = sum.norm();
        if (contact.normal_count > 1 && length > 0.0) contact.normal = sum / length;
    }
}

bool PointContacts::is_left_to_a_vertex(const Contact& contact, const PointContact& point) const {
    if (contact.kind != ContactCase::edge_edge) {
        return stands_for(contact.vertex_a, point.body_b) || stands_for(contact.vertex_b, point.body_a);
    }
    const auto any_end = [this](const ContactPoint& edge, Index other) {
        return std::any_of(edge.vertices.begin(), edge.vertices.end(),
                           [&](Index vertex) { return stands_for(vertex, other); });
    };
    return any_end(contact.on_a, point.body_b) || any_end(contact.on_b, point.body_a);
}

bool PointContacts::stands_for(Index vertex, Index other) const {
    if (vertex < 0) return false;
    for (Index c = first_[at(vertex)]; c >= 0; c = list_[at(c)].next) {
        if (list_[at(c)].other == other && list_[at(c)].of_vertex) return true;
    }
    return false;
}

bool PointContacts::keep_deepest(PointContact& contact) {
    Index& first = first_[at(contact.vertex)];
    contact.normals[0] = contact.normal;
    contact.normal_count = 1;
    for (Index c = first; c >= 0; c = list_[at(c)].next) {
        PointContact& known = list_[at(c)];
        if (known.other != contact.other) continue;
        const int order = compare(contact, known);
        if (order > 0) {
            contact.next = known.next;
            contact.of_vertex = contact.of_vertex || known.of_vertex;  // it still replaces the edge contacts beside it
            known = contact;
        } else if (order == 0) {
            // On an edge or a corner of the other surface faces tie, and their normals are averaged. The lowest feature
            // takes the load, so that the result does not depend on the order of contacts.
            const auto end = known.normals.begin() + known.normal_count;
            const bool seen = std::any_of(known.normals.begin(), end, [&contact](const Vector3& normal) {
                return (contact.normal - normal).norm() <= alike;
            });
            if (!seen && end != known.normals.end()) known.normals[at(known.normal_count++)] = contact.normal;
            const auto rank = [](const PointContact& one) { return std::tie(one.id, one.a.weights, one.b.weights); };
            if (rank(contact) < rank(known)) {
                contact.normals = known.normals;
                contact.normal_count = known.normal_count;
                contact.next = known.next;
                known = contact;
            }
        }
        return false;
    }
    contact.next = first;
    first = static_cast<Index>(list_.size());
    list_.push_back(contact);
    return true;
}

ContactForceLaw spring_damper(const Topology& topology, const ContactLaws& laws, const Frame& frame, double dt,
                              const PointContact& contact) {
    const bool push_b = laws.kind(contact.body_a, contact.body_b) != CollisionClass::instrument_rigid;
    const ContactPoint& pushed = push_b ? contact.b : contact.a;
    const ContactPoint& other = push_b ? contact.a : contact.b;
    const bool tissue = topology.bodies[at(contact.body_b)].kind == BodyKind::tissue;
    const BodyKind kind_a = topology.bodies[at(contact.body_a)].kind;
    const Vector3 other_velocity = other.blend(frame.velocity);
    ContactForceLaw linear;
    linear.source_id = contact.id;
    linear.vertices = pushed.vertices;
    linear.weights = pushed.weights;
    linear.normal = push_b ? contact.normal : Vector3(-contact.normal);
    linear.gap = -contact.depth;
    linear.k = laws.k(contact.body_a, contact.body_b);
    if (std::isnan(linear.k)) linear.k = tissue ? laws.mean_of_springs(pushed) : rigid_stiffness;
    linear.mu = laws.mu(contact.body_a, contact.body_b, linear.k);
    linear.face_velocity = other_velocity.dot(linear.normal);
    if (kind_a == BodyKind::tissue) {
        linear.reaction_vertices = other.vertices;
        linear.reaction_weights = other.weights;
    } else if (push_b && kind_a == BodyKind::instrument) {
        react_on_line(frame, contact.body_a, linear);
    }
    report_at_start(topology, frame, dt, linear);
    if (tissue) laws.finish_on_tissue(contact.body_b, other_velocity, linear);
    return linear;
}

ContactForceLaw solved_contact(const Frame& frame, const PointContact& contact, ContactForceLaw law) {
    law.role = ContactRole::solved;
    law.k = law.mu = 0.0;
    if (any_vertex(law.reaction_vertices) < 0) law.surface_velocity = contact.a.blend(frame.velocity);
    return law;
}

void PointResponse::prepare(const Topology& topology, const Materials& materials) {
    topology_ = &topology;
    laws_.prepare(topology, materials, settings_.law);
    points_.prepare(topology);
}

void PointResponse::respond(const Frame& frame, double dt, const ContactSet& contacts,
                            std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) {
    output.clear();
    output.solver = solver_.get();
    points_.gather(*topology_, frame, contacts, settings_.reduce, output);
    for (const PointContact& contact : points_.list()) {
        const bool on_tissue = topology_->bodies[at(contact.body_b)].kind == BodyKind::tissue;
        const ContactForceLaw law = spring_damper(*topology_, laws_, frame, dt, contact);
        output.contacts.push_back(on_tissue && solver_ ? solved_contact(frame, contact, law) : law);
    }
}

}  // namespace trocar
