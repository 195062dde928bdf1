#include "respond/back_projection.hpp"

#include <algorithm>

#include "respond/equations.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

void BackProjection::respond(const ThesisState& state, const Frame& frame, Effect& effect) {
    const Topology& topology = *state.topology;
    Box tissue;
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue || body.vertices.count == 0) continue;
        const auto points = frame.position.middleCols(body.vertices.first, body.vertices.count);
        tissue.add(points.rowwise().minCoeff());
        tissue.add(points.rowwise().maxCoeff());
    }
    // Only what lies near the instruments' back paths: a grid over all tissue would cost more than the response.
    paths_.clear();
    Box all;
    for (Index body = 0; body < topology.body_count(); ++body) {
        if (state.kind(body) != BodyKind::instrument) continue;
        const Range range = topology.bodies[at(body)].vertices;
        for (Index a = range.first; a < range.end(); ++a) {
            const Vector3 v = frame.velocity.col(a);
            const double speed = v.norm();
            if (speed == 0.0) continue;
            const Vector3 x = frame.position.col(a);
            Path path{.body = body, .vertex = a, .from = x};
            path.from -= v / speed * std::min(state.settings.n_back * state.dt * speed, state.settings.l_max);
            path.box.min = x.cwiseMin(path.from);
            path.box.max = x.cwiseMax(path.from);
            if (!path.box.overlaps(tissue)) continue;
            all.add(path.box.min);
            all.add(path.box.max);
            paths_.push_back(path);
        }
    }
    if (paths_.empty()) return;
    near_.clear();
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            const auto corner = topology.triangles.col(t);
            const auto p = frame.position.col(corner[0]);
            const auto q = frame.position.col(corner[1]);
            const auto r = frame.position.col(corner[2]);
            bool apart = false;
            for (int axis = 0; axis < 3 && !apart; ++axis) {
                apart = std::max({p[axis], q[axis], r[axis]}) < all.min[axis] ||
                        std::min({p[axis], q[axis], r[axis]}) > all.max[axis];
            }
            if (!apart) near_.push_back(t);
        }
    }
    grid_.prepare(topology, near_);
    grid_.fill(topology, frame.position);
    for (const Path& path : paths_) {
        attracted_.clear();
        crossed_.clear();
        grid_.visit(path.box, [&](Index t) { crossed_.push_back(t); });
        std::sort(crossed_.begin(), crossed_.end());  // the first triangle of a vertex says how deep it is
        for (const Index t : crossed_) attract(state, frame, path, t, effect);
    }
}

void BackProjection::attract(const ThesisState& state, const Frame& frame, const Path& path, Index triangle,
                             Effect& effect) {
    const Topology& topology = *state.topology;
    if (topology.body_pair(path.body, topology.body_of_triangle[at(triangle)]) < 0) return;
    const Vector3 x = frame.position.col(path.vertex);
    const equations::Corners corners = corners_of(topology, frame.position, triangle);
    const equations::PathHit hit = equations::path_hit(corners, path.from, x);
    if (!hit.found) return;
    const Index vertex = topology.triangles(equations::nearest_corner(corners, hit.point), triangle);
    if (std::find(attracted_.begin(), attracted_.end(), vertex) != attracted_.end()) return;
    attracted_.push_back(vertex);
    const Vector3 towards = x - frame.position.col(vertex);
    const double distance = towards.norm();
    if (distance == 0.0) return;
    LinearContact linear;
    linear.vertices = {vertex, -1, -1};
    linear.weights = {1.0, 0.0, 0.0};
    linear.normal = towards / distance;
    linear.gap = -(x - hit.point).norm();
    linear.k = state.materials->mean_stiffness[at(vertex)];
    linear.face_velocity = frame.velocity.col(path.vertex).dot(linear.normal);
    linear.adhesive = true;
    linear.reaction_body = path.body;
    linear.reaction_point = x;
    effect.contacts.push_back(linear);
}

}  // namespace trocar
