#include "respond/held_contacts.hpp"

#include <algorithm>
#include <limits>

#include "respond/equations.hpp"
#include "respond/penetration.hpp"

namespace trocar {
namespace {

/// Where the lines of two edges come closest.
struct EdgeMeeting {
    LoadPoint a;
    LoadPoint b;
    Vector3 across = Vector3::Zero();  ///< unit, perpendicular to both
    double gap = 0.0;                  ///< m, from a to b along `across`
};

/// Nothing where the edges are parallel or the lines come closest beyond an end. Of the two directions across both
/// edges the one towards `side`.
std::optional<EdgeMeeting> meet(const Matrix3X& position, const EdgeKey& edges, const Vector3& side) {
    const Vector3 a0 = position.col(edges[0]);
    const Vector3 b0 = position.col(edges[2]);
    const Vector3 edge_a = position.col(edges[1]) - a0;
    const Vector3 edge_b = position.col(edges[3]) - b0;
    const Vector3 normal = edge_a.cross(edge_b);
    const double size = normal.norm();
    constexpr double parallel_sine = 1e-3;
    if (size <= parallel_sine * edge_a.norm() * edge_b.norm()) return std::nullopt;
    // The plane of one edge and the common normal cuts the other.
    const Vector3 between = b0 - a0;
    const double s = between.cross(edge_b).dot(normal) / (size * size);
    const double t = between.cross(edge_a).dot(normal) / (size * size);
    if (s < 0.0 || s > 1.0 || t < 0.0 || t > 1.0) return std::nullopt;
    EdgeMeeting meeting;
    meeting.a = {{edges[0], edges[1], -1}, {1.0 - s, s, 0.0}};
    meeting.b = {{edges[2], edges[3], -1}, {1.0 - t, t, 0.0}};
    meeting.across = normal / (normal.dot(side) < 0.0 ? -size : size);
    meeting.gap = between.dot(meeting.across);
    return meeting;
}

/// Sum of the area normals of the faces that meet in the edge p-q.
Vector3 faces_at(const ThesisState& state, const Matrix3X& position, Index p, Index q) {
    Vector3 sum = Vector3::Zero();
    for (const Index t : state.surface.triangles_at(p)) {
        if ((state.topology->triangles.col(t).array() == q).any()) {
            sum += area_normal(*state.topology, position, t);
        }
    }
    return sum;
}

/// How triangle b of a contact gets clear of triangle a.
struct WayOut {
    Vector3 direction = Vector3::Zero();  ///< unit
    double depth = 0.0;                   ///< m
};

/// The shortest of the ways along the contact's own normal, the normal of a face of a closed body, and that of b; none
/// leads through a closed body, or what it holds would be drawn in. Where a flat tool lands on a flat sheet the first
/// is nonsense: the triangles overlap by their whole width in the plane that they share, while nothing is inside.
WayOut shortest_way_out(const Topology& topology, const Matrix3X& position, const Contact& contact) {
    const equations::Corners a = corners_of(topology, position, contact.a);
    const equations::Corners b = corners_of(topology, position, contact.b);
    const Index body_a = topology.body_of_triangle[static_cast<std::size_t>(contact.a)];
    const bool closed = topology.bodies[static_cast<std::size_t>(body_a)].closed;
    const Vector3 out = equations::unit_normal(a);
    WayOut way{contact.normal, std::numeric_limits<double>::infinity()};
    const auto consider = [&](const Vector3& direction, double depth) {
        const bool leads_in = closed && direction.dot(out) < 0.0;
        if (!leads_in && depth < way.depth) way = {direction, std::max(depth, 0.0)};
    };
    consider(contact.normal, contact.depth);
    if (closed) {
        double depth = 0.0;
        for (const Vector3& corner : b) depth = std::max(depth, out.dot(a[0] - corner));
        consider(out, depth);
    }
    const Vector3 front = equations::unit_normal(b);
    double behind = 0.0;
    double before = 0.0;
    for (const Vector3& corner : a) {
        behind = std::max(behind, front.dot(b[0] - corner));
        before = std::max(before, front.dot(corner - b[0]));
    }
    consider(-front, behind);
    consider(front, before);
    return way;
}

}  // namespace

bool faces_below(const ThesisState& state, const Matrix3X& position, Index p, Index q, const Vector3& normal,
                 double least) {
    const Topology& topology = *state.topology;
    const Vector3 foot = position.col(p);
    for (const Index t : state.surface.triangles_at(p)) {
        if (!(topology.triangles.col(t).array() == q).any()) continue;
        const Index apex = topology.triangles.col(t).sum() - p - q;
        const Vector3 way = position.col(apex) - foot;
        const Vector3 edge = (position.col(q) - foot).normalized();
        const Vector3 into = way - way.dot(edge) * edge;
        if (-into.dot(normal) < least * into.norm()) return false;
    }
    return true;
}

VertexInFace vertex_at_surface(const ThesisState& state, const Frame& frame, Index vertex, Index face_body,
                               Index triangle) {
    const Topology& topology = *state.topology;
    const Vector3 x = frame.position.col(vertex);
    VertexInFace v;
    v.vertex = vertex;
    v.face_body = face_body;
    v.triangle = triangle;
    follow_surface(topology, state.surface, frame, x, v.triangle, v.weights);
    const equations::Corners corners = corners_of(topology, frame.position, v.triangle);
    const Vector3 foot = equations::point_at(corners, v.weights);
    v.normal = state.surface.blended_normal(topology, frame.position, v.triangle, v.weights);
    v.depth = v.normal.dot(foot - x);
    v.distance = (foot - x).norm();
    v.nearest = topology.triangles(equations::nearest_corner(corners, x), v.triangle);
    return v;
}

void HeldContacts::prepare() {
    resting_.clear();
    resting_now_.clear();
    edges_.clear();
    edges_now_.clear();
}

/// The pierced face need not be the nearest one: a vertex that came in over a rim is deep below the side and just
/// inside the end. Walks over the surface to where the vertex is nearest to it. Nor need a vertex below the pierced
/// face be inside: where the point of a needle just enters a tissue face, that face's corners lie below planes of the
/// cone and far beside it.
void HeldContacts::hold_nearest(const ThesisState& state, const Frame& frame, VertexInFace v, Effect& effect) {
    const Topology& topology = *state.topology;
    const Vector3 x = frame.position.col(v.vertex);
    const Index pierced = v.triangle;
    Vector3 weights = v.weights;
    follow_surface(topology, state.surface, frame, x, v.triangle, weights);
    if (!state.surface.is_behind(topology, frame.position, v.triangle, weights, x)) return;
    if (v.triangle != pierced) {
        const equations::Corners corners = corners_of(topology, frame.position, v.triangle);
        const Vector3 foot = equations::point_at(corners, weights);
        v.weights = weights;
        v.normal = state.surface.blended_normal(topology, frame.position, v.triangle, weights);
        v.depth = std::min(v.depth, (foot - x).norm());
        v.nearest = topology.triangles(equations::nearest_corner(corners, x), v.triangle);
    }
    hold_vertex(state, frame, v, effect);
}

void HeldContacts::hold_vertex(const ThesisState& state, const Frame& frame, const VertexInFace& v, Effect& effect) {
    resting_now_.push_back({v.vertex, v.triangle, v.face_body, v.normal});
    push_vertex(state, frame, v, effect);
}

void HeldContacts::hold_ahead(const ThesisState& state, const Frame& frame, const VertexInFace& v, bool rests,
                              Effect& effect) {
    if (rests) resting_.push_back({v.vertex, v.triangle, v.face_body, v.normal});
    push_vertex(state, frame, v, effect);
}

void HeldContacts::push_vertex(const ThesisState& state, const Frame& frame, const VertexInFace& v, Effect& effect) {
    const LoadPoint foot = LoadPoint::in_triangle(*state.topology, v.triangle, v.weights);
    Vector3 face_velocity = frame.velocity.col(v.nearest);
    if (state.settings.closest_point) face_velocity = foot.blend(frame.velocity);
    LinearContact linear = state.hard_contact(v.depth);
    linear.vertices = {v.vertex, -1, -1};
    linear.weights = {1.0, 0.0, 0.0};
    linear.normal = v.normal;
    state.end_on_time(
        v.face_body, face_velocity, [&](const Vector3& u) { return u.dot(v.normal); }, linear);
    state.rub(v.vertex, face_velocity, linear);
    if (state.kind(v.face_body) == BodyKind::instrument) {
        linear.reaction_body = v.face_body;
        linear.reaction_point = foot.blend(frame.position);
    }
    effect.contacts.push_back(linear);
}

void HeldContacts::hold_edges(const ThesisState& state, const Frame& frame, Index body_a, const LoadPoint& a,
                              const LoadPoint& b, const Vector3& direction, double gap, const EdgeKey* key,
                              Effect& effect) {
    if (key != nullptr) edges_now_.push_back({*key, body_a, direction});
    hold_points_apart(state, frame, body_a, a, b, direction, gap, effect);
}

void HeldContacts::hold_points_apart(const ThesisState& state, const Frame& frame, Index body_a, const LoadPoint& a,
                                     const LoadPoint& b, const Vector3& direction, double gap, Effect& effect) {
    const Vector3 face_velocity = a.blend(frame.velocity);
    LinearContact linear = state.hard_contact(-gap);
    linear.vertices = b.vertices;
    linear.weights = b.weights;
    linear.normal = direction;
    state.end_on_time(
        body_a, face_velocity, [&](const Vector3& u) { return u.dot(direction); }, linear);
    const auto heaviest = std::max_element(b.weights.begin(), b.weights.end());
    state.rub(b.vertices[static_cast<std::size_t>(heaviest - b.weights.begin())], face_velocity, linear);
    if (state.kind(body_a) == BodyKind::instrument) {
        linear.reaction_body = body_a;
        linear.reaction_point = a.blend(frame.position);
    } else if (state.kind(body_a) == BodyKind::tissue) {
        linear.reaction_vertices = a.vertices;
        linear.reaction_weights = a.weights;
    }
    effect.contacts.push_back(linear);
}

void HeldContacts::hold_crossing(const ThesisState& state, const Frame& frame, const Contact& contact,
                                 const LoadPoint& a, const LoadPoint& b, const EdgeKey* key, Effect& effect) {
    const Topology& topology = *state.topology;
    WayOut way{contact.interval_direction, contact.interval_length};
    if (state.settings.edge_normal) way = shortest_way_out(topology, frame.position, contact);
    const Index body_a = topology.body_of_triangle[static_cast<std::size_t>(contact.a)];
    hold_edges(state, frame, body_a, a, b, way.direction, -way.depth, key, effect);
}

bool HeldContacts::hold_edges_apart(const ThesisState& state, const Frame& frame, Index body_a,
                                    std::optional<double> side, const EdgePair& pair, Effect& effect) {
    const EdgeKey& key = pair.key;
    Vector3 outwards = pair.contact.normal;
    Vector3 home = Vector3::Zero();  // to where the body belongs
    if (side) home = *side * faces_at(state, frame.position, key[2], key[3]);
    if (state.topology->bodies[static_cast<std::size_t>(body_a)].closed) {
        outwards = faces_at(state, frame.position, key[0], key[1]);
    } else if (side) {
        outwards = -home;
    }
    const std::optional<EdgeMeeting> meeting = meet(frame.position, key, outwards);
    if (!meeting || (!pair.crosses && meeting->gap > 0.0) || meeting->across.dot(home) > 0.0) return false;
    if (!faces_below(state, frame.position, key[0], key[1], meeting->across) ||
        !faces_below(state, frame.position, key[2], key[3], -meeting->across))
        return false;
    hold_edges(state, frame, body_a, meeting->a, meeting->b, meeting->across, meeting->gap, &key, effect);
    return true;
}

bool HeldContacts::holds_corner(const Topology& topology, Index triangle, Index body) const {
    return std::any_of(resting_now_.begin(), resting_now_.end(), [&](const RestingVertex& r) {
        return r.face_body == body && (topology.triangles.col(triangle).array() == r.vertex).any();
    });
}

void HeldContacts::keep_resting(const ThesisState& state, const Frame& frame, Effect& effect) {
    keep_vertices(state, frame, effect);
    keep_edges(state, frame, effect);
}

void HeldContacts::keep_vertices(const ThesisState& state, const Frame& frame, Effect& effect) {
    for (const RestingVertex& r : resting_) {
        const auto known = std::any_of(resting_now_.begin(), resting_now_.end(), [&r](const RestingVertex& now) {
            return now.vertex == r.vertex && now.face_body == r.face_body;
        });
        if (known || state.follows(r.vertex, r.face_body)) continue;
        const VertexInFace v = vertex_at_surface(state, frame, r.vertex, r.face_body, r.triangle);
        if (v.depth > 0.0 || v.distance > state.resting_margin(r.vertex)) continue;
        hold_vertex(state, frame, v, effect);
    }
    resting_.swap(resting_now_);
    resting_now_.clear();
}

void HeldContacts::keep_edges(const ThesisState& state, const Frame& frame, Effect& effect) {
    for (const HeldEdges& held : edges_) {
        const auto known = std::any_of(edges_now_.begin(), edges_now_.end(),
                                       [&held](const HeldEdges& now) { return now.vertex == held.vertex; });
        if (known) continue;
        const std::optional<EdgeMeeting> meeting = meet(frame.position, held.vertex, held.normal);
        if (!meeting || meeting->gap < 0.0 || meeting->gap > state.resting_margin(held.vertex[2])) continue;
        const EdgeKey key = held.vertex;
        hold_edges(state, frame, held.body_a, meeting->a, meeting->b, meeting->across, meeting->gap, &key, effect);
    }
    edges_.swap(edges_now_);
    edges_now_.clear();
}

}  // namespace trocar
