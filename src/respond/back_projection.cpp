#include "respond/back_projection.hpp"

#include <algorithm>
#include <tuple>

#include "respond/equations.hpp"

namespace trocar {
namespace {

/// Position of a vertex n_back ticks ago at constant velocity, at most l_max back.
Vector3 came_from(const ThesisState& state, const Frame& frame, Index vertex) {
    const Vector3 v = frame.velocity.col(vertex);
    const double speed = v.norm();
    const double time = std::min(state.settings.n_back * state.dt, state.settings.l_max / speed);
    return frame.position.col(vertex) - time * v;
}

}  // namespace

void BackProjection::respond(const ThesisState& state, const Frame& frame, const ContactSet& contacts,
                             ResponseOutput& output) {
    collect_met(state, frame, contacts);
    for (auto first = met_.begin(); first != met_.end();) {
        const Index body = first->body;
        const auto end = std::find_if(first, met_.end(), [body](const Met& met) { return met.body != body; });
        Box all;
        for (auto met = first; met != end; ++met) all.add(met->box);
        const Range vertices = state.topology->bodies[at(body)].vertices;
        for (Index vertex = vertices.first; vertex < vertices.end(); ++vertex) {
            if (frame.velocity.col(vertex) == Vector3::Zero()) continue;
            const Vector3 from = came_from(state, frame, vertex);
            const Box path = box_of(from, frame.position.col(vertex));
            if (!path.overlaps(all)) continue;
            attracted_.clear();
            // The first triangle of a tissue vertex determines its depth.
            for (auto met = first; met != end; ++met) {
                if (met->box.overlaps(path)) attract(state, frame, vertex, from, *met, output);
            }
        }
        first = end;
    }
}

void BackProjection::collect_met(const ThesisState& state, const Frame& frame, const ContactSet& contacts) {
    const Topology& topology = *state.topology;
    met_.clear();
    for (const TrianglePair& pair : contacts.pairs) {
        const Index body = topology.body_of_triangle[at(pair.a)];
        if (state.kind(body) != BodyKind::instrument) continue;
        if (state.kind(topology.body_of_triangle[at(pair.b)]) != BodyKind::tissue) continue;
        met_.push_back({.body = body, .triangle = pair.b});
    }
    const auto key = [](const Met& met) { return std::tuple{met.body, met.triangle}; };
    std::sort(met_.begin(), met_.end(), [&](const Met& a, const Met& b) { return key(a) < key(b); });
    met_.erase(std::unique(met_.begin(), met_.end(), [&](const Met& a, const Met& b) { return key(a) == key(b); }),
               met_.end());
    for (Met& met : met_) met.box = box_of(corners_of(topology.triangles, frame.position, met.triangle));
}

void BackProjection::attract(const ThesisState& state, const Frame& frame, Index tool_vertex, const Vector3& from,
                             const Met& met, ResponseOutput& output) {
    const Topology& topology = *state.topology;
    const Vector3 x = frame.position.col(tool_vertex);
    const Corners corners = corners_of(topology.triangles, frame.position, met.triangle);
    const equations::PathHit hit = equations::path_hit(corners, from, x);
    if (!hit.found || !hit.point.allFinite()) return;  // a corner is not finite
    const Index vertex = topology.triangles(equations::nearest_corner(corners, hit.point), met.triangle);
    if (std::find(attracted_.begin(), attracted_.end(), vertex) != attracted_.end()) return;
    attracted_.push_back(vertex);
    const Vector3 towards = x - frame.position.col(vertex);
    const double distance = towards.norm();
    if (distance == 0.0) return;
    ContactForceLaw linear;
    linear.vertices = {vertex, -1, -1};
    linear.weights = {1.0, 0.0, 0.0};
    linear.normal = towards / distance;
    linear.gap = -(x - hit.point).norm();
    linear.k = state.materials->mean_stiffness[at(vertex)];
    linear.face_velocity = frame.velocity.col(tool_vertex).dot(linear.normal);
    linear.adhesive = true;
    linear.reaction_body = met.body;
    linear.reaction_point = x;
    report_at_start(topology, frame, state.dt, linear);
    output.contacts.push_back(linear);
}

}  // namespace trocar
