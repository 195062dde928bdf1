#include "respond/approaching_faces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "respond/equations.hpp"
#include "respond/penetration.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

constexpr double rounding = 1e-9;  // m

/// A face that moves from one place to another while a point does the same.
struct Passage {
    double part =
        -1.0;  ///< of the way, until the point comes through the face from outside; negative where it does not
    Vector3 weights = Vector3::Zero();
};

Passage passage(const equations::Corners& face_from, const equations::Corners& face_to, const Vector3& from,
                const Vector3& to) {
    const auto above = [](const equations::Corners& c, const Vector3& point) {
        return (c[1] - c[0]).cross(c[2] - c[0]).dot(point - c[0]);
    };
    const double start = above(face_from, from);
    const double end = above(face_to, to);
    if (start < 0.0 || end >= 0.0) return {};
    const double part = start / (start - end);
    equations::Corners then;
    for (std::size_t i = 0; i < 3; ++i) then[i] = face_from[i] + part * (face_to[i] - face_from[i]);
    const Vector3 place = from + part * (to - from);
    const Vector3 weights = closest_point_on_triangle(then, place);
    if ((equations::point_at(then, weights) - place).norm() > rounding) return {};
    return {part, weights};
}

}  // namespace

void ApproachingFaces::prepare(const ThesisState& state) {
    const Topology& topology = *state.topology;
    const ThesisSettings& settings = state.settings;
    pairs_.clear();
    tick_ = 0;
    region_.assign(1, Box{});
    if (!settings.meet_tools || !settings.constrain || !settings.reduce || settings.resolution != Resolution::ledger)
        return;
    for (const auto& [a, b] : topology.body_pairs) {
        for (const auto& [body, tissue] : {std::array{a, b}, std::array{b, a}}) {
            const BodyRange& range = topology.bodies[at(body)];
            if (range.kind == BodyKind::tissue || !range.closed || state.kind(tissue) != BodyKind::tissue) continue;
            const std::size_t count = at(topology.bodies[at(tissue)].vertices.count);
            Pair& pair = pairs_.emplace_back();
            pair.body = body;
            pair.tissue = tissue;
            pair.blocks.prepare(topology, range.triangles);
            pair.clearance.assign(count, 0.0);
            pair.triangle.assign(count, -1);
            pair.when.assign(count, -1);
        }
    }
}

void ApproachingFaces::respond(const ThesisState& state, const Frame& frame, VelocityChanges& changes,
                               HeldContacts& held, Effect& effect) {
    if (pairs_.empty()) return;
    ++tick_;
    changes.note(effect);
    for (Pair& pair : pairs_) {
        const Range vertices = state.topology->bodies[at(pair.tissue)].vertices;
        for (const RestingVertex& r : held.resting()) {
            if (r.face_body != pair.body || !vertices.contains(r.vertex)) continue;
            pair.triangle[at(r.vertex - vertices.first)] = r.triangle;
            pair.when[at(r.vertex - vertices.first)] = tick_;
        }
    }
    for (Pair& pair : pairs_) {
        const double near = state.touching_gap(pair.tissue);
        const double body = changes.fastest(pair.body);
        const double most = (body + changes.fastest(pair.tissue)) * state.dt;
        pair.blocks.move(std::isfinite(body) ? body * state.dt : std::numeric_limits<double>::infinity());
        pair.travelled += most;
        if (pair.travelled < pair.least - near) continue;
        find_looked_at(state, pair, near);
        if (looked_at_.empty()) continue;
        const double reach = near + most + state.look_out(pair.tissue);
        Box& region = region_.front();
        region = Box{};
        for (const Index v : looked_at_) region.add(frame.position.col(v));
        region.min.array() -= reach;
        region.max.array() += reach;
        pair.blocks.collect(*state.topology, frame.position, region_, near_);
        grid_.fill(*state.topology, frame.position, near_);
        for (const Index v : looked_at_) {
            double& clearance = pair.clearance[at(v - state.topology->bodies[at(pair.tissue)].vertices.first)];
            clearance = look_at(state, frame, pair, v, reach, changes, held, effect) - most;
            pair.least = std::min(pair.least, clearance);
        }
    }
}

/// What is further off than all that moves can go in the ticks since it was looked at is not looked at again.
void ApproachingFaces::find_looked_at(const ThesisState& state, Pair& pair, double near) {
    const Range vertices = state.topology->bodies[at(pair.tissue)].vertices;
    looked_at_.clear();
    pair.least = std::numeric_limits<double>::infinity();
    for (Index v = vertices.first; v < vertices.end(); ++v) {
        const std::size_t local = at(v - vertices.first);
        double& clearance = pair.clearance[local];
        clearance = state.fixed(v) ? std::numeric_limits<double>::infinity() : clearance - pair.travelled;
        if (clearance <= near && pair.when[local] != tick_ && !state.follows(v, pair.body)) {
            looked_at_.push_back(v);
        } else {
            pair.least = std::min(pair.least, clearance);
        }
    }
    pair.travelled = 0.0;
}

/// True where the body has held the vertex in the last tick and it is still on its surface, or below.
bool ApproachingFaces::keep(const ThesisState& state, const Frame& frame, Pair& pair, Index vertex, HeldContacts& held,
                            Effect& effect) {
    const Topology& topology = *state.topology;
    const std::size_t local = at(vertex - topology.bodies[at(pair.tissue)].vertices.first);
    if (pair.when[local] != tick_ - 1) return false;
    const Vector3 x = frame.position.col(vertex);
    const VertexInFace v = vertex_at_surface(state, frame, vertex, pair.body, pair.triangle[local]);
    if (!state.surface.is_behind(topology, frame.position, v.triangle, v.weights, x)) return false;
    if (v.depth <= 0.0 || v.depth > state.resting_margin(vertex)) return false;
    held.hold_ahead(state, frame, v, true, effect);
    pair.triangle[local] = v.triangle;
    pair.when[local] = tick_;
    return true;
}

/// How far off the body is, m; at most `reach`.
double ApproachingFaces::look_at(const ThesisState& state, const Frame& frame, Pair& pair, Index vertex, double reach,
                                 VelocityChanges& changes, HeldContacts& held, Effect& effect) {
    if (keep(state, frame, pair, vertex, held, effect)) return 0.0;
    const Topology& topology = *state.topology;
    const Vector3 x = frame.position.col(vertex);
    // Seen from the place where the face is now and, led by a hand, still is at the start of the tissue's tick.
    const Vector3& hand = state.hand_velocity(pair.body);
    const Vector3 end = x + (frame.velocity.col(vertex) - hand) * state.dt;
    double clearance = reach;
    double least = std::numeric_limits<double>::infinity();
    Meeting meeting;
    grid_.visit({.min = x.array() - reach, .max = x.array() + reach}, [&](Index t) {
        const equations::Corners now = corners_of(topology, frame.position, t);
        const Vector3 weights = closest_point_on_triangle(now, x);
        const double distance = (equations::point_at(now, weights) - x).norm();
        clearance = std::min(clearance, distance);
        equations::Corners before = now;
        for (int i = 0; i < 3; ++i) {
            before[at(i)] -= (frame.velocity.col(topology.triangles(i, t)) - hand) * state.dt;
        }
        const Passage through = passage(before, now, x, end);
        if (through.part >= 0.0 && (!meeting.crosses || through.part < least)) {
            meeting = {.triangle = t, .weights = through.weights, .crosses = true};
            least = through.part;
        }
        if (meeting.crosses || distance >= least) return;
        meeting = {.triangle = t, .weights = weights, .distance = distance};
        least = distance;
    });
    if (meeting.triangle >= 0) meet(state, frame, pair, vertex, meeting, changes, held, effect);
    return clearance;
}

/// Without a path through the face, what touches it may still be drawn in: by how much faster it may get in the tick.
void ApproachingFaces::meet(const ThesisState& state, const Frame& frame, Pair& pair, Index vertex,
                            const Meeting& meeting, VelocityChanges& changes, HeldContacts& held, Effect& effect) {
    const Topology& topology = *state.topology;
    const Vector3 x = frame.position.col(vertex);
    const equations::Corners corners = corners_of(topology, frame.position, meeting.triangle);
    const Vector3 foot = equations::point_at(corners, meeting.weights);
    VertexInFace v;
    v.vertex = vertex;
    v.face_body = pair.body;
    v.triangle = meeting.triangle;
    v.weights = meeting.weights;
    v.nearest = topology.triangles(equations::nearest_corner(corners, x), v.triangle);
    v.normal = equations::unit_normal(corners);
    if (!meeting.crosses) {
        v.normal = state.surface.blended_normal(topology, frame.position, v.triangle, v.weights);
        const double near = state.touching_gap(pair.tissue);
        if (meeting.distance > near + changes.when_free(vertex) * state.dt) return;
        if (state.surface.is_behind(topology, frame.position, v.triangle, v.weights, x)) return;
        if (meeting.distance > rounding) {
            const Vector3 out = (x - foot) / meeting.distance;
            constexpr double mostly = 0.9;  // cosine: beside an edge it would be drawn past the face, not in
            if (meeting.distance > near && out.dot(v.normal) < mostly) return;
            v.normal = out;
        }
    }
    v.depth = v.normal.dot(foot - x);
    held.hold_ahead(state, frame, v, false, effect);
    const std::size_t local = at(vertex - topology.bodies[at(pair.tissue)].vertices.first);
    pair.triangle[local] = v.triangle;
    pair.when[local] = tick_;
}

}  // namespace trocar
