#include "respond/point_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "respond/equations.hpp"

namespace trocar {
namespace {

/// A contact of features. Its depth is that at the end of the tick's scripted motion, negative where it is open then.
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
    const auto heaviest = std::max_element(stands.weights.begin(), stands.weights.end());
    out.vertex = stands.vertices[static_cast<std::size_t>(heaviest - stands.weights.begin())];
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
        const equations::Corners corners = corners_of(topology, frame.position, triangle);
        return ContactPoint::in_triangle(topology.triangles, triangle, closest_point_on_triangle(corners, point));
    };
    out.a = vertex_of_a ? ContactPoint::at_vertex(contact.vertex_a) : spread(contact.a);
    out.b = vertex_of_b ? ContactPoint::at_vertex(contact.vertex_b) : spread(contact.b);
    out.distance = (out.b.blend(frame.position) - out.a.blend(frame.position)).norm();
    // Without an entering vertex the most loaded vertex of b stands for the contact.
    if (vertex_of_a) {
        out.vertex = contact.vertex_a;
        out.other = out.body_b;
    } else {
        const auto heaviest = std::max_element(out.b.weights.begin(), out.b.weights.end());
        out.vertex = out.b.vertices[static_cast<std::size_t>(heaviest - out.b.weights.begin())];
        out.other = out.body_a;
    }
    return true;
}

/// Contacts and moved vertices that find room from the first tick on.
constexpr std::size_t usual_contacts = 1024;
constexpr double alike = 1e-9;  ///< part of a depth or a distance: well above rounding, well below a difference

/// The deepest contact of a vertex stands for it. Faces of one plane are equally deep but for rounding; of these it is
/// the nearest, whose corners are the ones that a load at this point belongs to. Positive: a comes before b.
int compare(const PointContact& a, const PointContact& b) {
    const double deeper = a.depth - b.depth;
    if (std::abs(deeper) > alike * (a.depth + a.distance + b.distance)) return deeper > 0.0 ? 1 : -1;
    const double nearer = b.distance - a.distance;
    if (std::abs(nearer) > alike * (a.depth + a.distance + b.distance)) return nearer > 0.0 ? 1 : -1;
    return 0;
}

}  // namespace

Parameter reduction_parameter() {
    return {.name = "reduction",
            .type = Parameter::Type::choice,
            .default_value = "vertex",
            .choices = {"vertex", "pair"},
            .meaning =
                "of closed contacts one per vertex and other body, the deepest, so that force does not grow with "
                "the number of faces (a scene's k); or each pair of triangles or features (hard contact)"};
}

void PointContacts::prepare(const Topology& topology) {
    first_.assign(at(topology.vertex_count), -1);
    list_.clear();
    list_.reserve(std::min(at(topology.vertex_count), usual_contacts));
}

void PointContacts::gather(const Topology& topology, const Frame& frame, const ContactSet& contacts, bool reduce,
                           Effect& effect) {
    for (const PointContact& contact : list_) first_[at(contact.vertex)] = -1;
    list_.clear();
    // Where a vertex is inside, the edges that meet in it cross the other body's edges round it: the same overlap once
    // more, along other normals. So vertices come first, and an edge contact beside one of them is left to it.
    for (const bool edges : {false, true}) {
        if (edges && !reduce) break;
        for (const Contact& contact : contacts.contacts) {
            const bool of_edges = contact.kind == ContactCase::edges_cross || contact.kind == ContactCase::edge_edge;
            if (reduce && edges != of_edges) continue;
            PointContact point;
            const bool described = describe(topology, frame, contact, point);
            point.id = contact.id;
            if (!described) {
                effect.skip(SkipReason::no_direction);
            } else if (!reduce || point.depth < 0.0) {
                list_.push_back(point);
            } else if ((edges && is_left_to_a_vertex(contact, point)) || !keep_deepest(point)) {
                effect.skip(SkipReason::reduced);
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
            contact.of_vertex = contact.of_vertex || known.of_vertex;  // the edges beside it stay left to it
            known = contact;
        } else if (order == 0) {
            // On an edge or a corner of the other surface no face comes first: their normals count alike, and the load
            // is that of the lowest feature, whatever the order of contacts.
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

void VertexEdits::prepare(const Topology& topology, const Materials& materials) {
    const auto n = at(topology.vertex_count);
    inverse_mass_.assign(n, 0.0);
    for (std::size_t v = 0; v < std::min(n, materials.mass.size()); ++v) {
        const bool pinned = v < materials.pinned.size() && materials.pinned[v] != 0;
        if (materials.mass[v] > 0.0 && !pinned) inverse_mass_[v] = 1.0 / materials.mass[v];
    }
    slot_.assign(n, -1);
    edits_.clear();
    edits_.reserve(std::min(n, usual_contacts));
}

void VertexEdits::clear() {
    for (const Placement& edit : edits_) slot_[at(edit.vertex)] = -1;
    edits_.clear();
}

Placement& VertexEdits::edit(const Frame& frame, Index vertex) {
    Index& slot = slot_[at(vertex)];
    if (slot < 0) {
        slot = static_cast<Index>(edits_.size());
        edits_.push_back(
            {.vertex = vertex, .position = frame.position.col(vertex), .velocity = frame.velocity.col(vertex)});
    }
    return edits_[at(slot)];
}

Vector3 VertexEdits::position(const Frame& frame, Index vertex) const {
    const Index slot = slot_[at(vertex)];
    return slot < 0 ? Vector3(frame.position.col(vertex)) : edits_[at(slot)].position;
}

Vector3 VertexEdits::velocity(const Frame& frame, Index vertex) const {
    const Index slot = slot_[at(vertex)];
    return slot < 0 ? Vector3(frame.velocity.col(vertex)) : edits_[at(slot)].velocity;
}

Vector3 VertexEdits::position(const Frame& frame, const ContactPoint& point) const {
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
        if (point.vertices[i] >= 0) sum += point.weights[i] * position(frame, point.vertices[i]);
    }
    return sum;
}

Vector3 VertexEdits::velocity(const Frame& frame, const ContactPoint& point) const {
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
        if (point.vertices[i] >= 0) sum += point.weights[i] * velocity(frame, point.vertices[i]);
    }
    return sum;
}

double VertexEdits::mobility(const ContactPoint& point) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        if (point.vertices[i] >= 0) sum += point.weights[i] * point.weights[i] * inverse_mass(point.vertices[i]);
    }
    return sum;
}

void VertexEdits::change_velocity(const Frame& frame, const ContactPoint& point, const Vector3& impulse) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Index v = point.vertices[i];
        if (v >= 0 && inverse_mass(v) > 0.0) edit(frame, v).velocity += point.weights[i] * inverse_mass(v) * impulse;
    }
}

void VertexEdits::change_position(const Frame& frame, const ContactPoint& point, const Vector3& impulse) {
    for (std::size_t i = 0; i < 3; ++i) {
        const Index v = point.vertices[i];
        if (v >= 0 && inverse_mass(v) > 0.0) edit(frame, v).position += point.weights[i] * inverse_mass(v) * impulse;
    }
}

void VertexEdits::write(Effect& effect) const {
    effect.placements.insert(effect.placements.end(), edits_.begin(), edits_.end());
}

LinearContact spring_damper(const Topology& topology, const ContactLaws& laws, const Frame& frame, double dt,
                            const PointContact& contact) {
    const bool push_b = laws.kind(contact.body_a, contact.body_b) != CollisionClass::instrument_rigid;
    const ContactPoint& pushed = push_b ? contact.b : contact.a;
    const ContactPoint& other = push_b ? contact.a : contact.b;
    const bool tissue = topology.bodies[at(contact.body_b)].kind == BodyKind::tissue;
    const BodyKind kind_a = topology.bodies[at(contact.body_a)].kind;
    const Vector3 other_velocity = other.blend(frame.velocity);
    LinearContact linear;
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
    tell_at_start(topology, frame, dt, linear);
    if (tissue) laws.finish_on_tissue(contact.body_b, other_velocity, linear);
    return linear;
}

void add_reaction(Index body, const Vector3& point, const Vector3& force, Effect& effect) {
    Wrench& wrench = effect.wrench[at(body)];
    wrench.force += force;
    wrench.moment += point.cross(force);
}

void PointResponse::prepare(const Topology& topology, const Materials& materials) {
    topology_ = &topology;
    laws_.prepare(topology, materials, settings_.law);
    points_.prepare(topology);
    edits_.prepare(topology, materials);
}

void PointResponse::respond(const Frame& frame, double dt, const ContactSet& contacts,
                            std::span<const ContactLoad> /*loads*/, Effect& effect) {
    effect.clear();
    edits_.clear();
    points_.gather(*topology_, frame, contacts, settings_.reduce, effect);
    for (const PointContact& contact : list()) {
        if (!on_tissue(contact)) effect.contacts.push_back(spring_damper_of(frame, dt, contact));
    }
    resolve(frame, dt, effect);
    edits_.write(effect);
}

bool PointResponse::on_tissue(const PointContact& contact) const {
    return topology_->bodies[at(contact.body_b)].kind == BodyKind::tissue;
}

Vector3 PointResponse::relative_velocity(const Frame& frame, const PointContact& contact) const {
    return edits_.velocity(frame, contact.b) - edits_.velocity(frame, contact.a);
}

double PointResponse::depth_left(const Frame& frame, const PointContact& contact) const {
    const Vector3 moved = edits_.position(frame, contact.b) - contact.b.blend(frame.position) -
                          (edits_.position(frame, contact.a) - contact.a.blend(frame.position));
    return contact.depth - moved.dot(contact.normal);
}

void PointResponse::push_apart(const Frame& frame, const PointContact& contact, const Vector3& impulse) {
    edits_.change_velocity(frame, contact.b, impulse);
    edits_.change_velocity(frame, contact.a, -impulse);
}

void PointResponse::move_apart(const Frame& frame, const PointContact& contact, const Vector3& impulse) {
    edits_.change_position(frame, contact.b, impulse);
    edits_.change_position(frame, contact.a, -impulse);
}

void PointResponse::react(const Frame& frame, const PointContact& contact, const Vector3& force, Effect& effect) const {
    if (topology_->bodies[at(contact.body_a)].kind != BodyKind::instrument) return;
    add_reaction(contact.body_a, contact.a.blend(frame.position), -force, effect);
}

}  // namespace trocar
