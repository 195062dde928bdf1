#include "measure/sheet_sides.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>

#include "geometry/exact.hpp"
#include "measure/vertical_crossings.hpp"

namespace trocar {
namespace {

constexpr int unreached = std::numeric_limits<int>::max();
constexpr std::size_t no_shell = std::numeric_limits<std::size_t>::max();

}  // namespace

SheetSides::SheetSides(BodySurface& body, BodySurface& sheet) : body_(&body), sheet_(&sheet) {
    const std::size_t samples = body.sample_count();
    rays_.assign(samples, 0);
    rays_before_.assign(samples, 0);
    by_surface_.assign(samples, 0);
    by_motion_.assign(samples, 0);
    side_.assign(samples, Side::right);
    find_shells();
    find_anchors();
    count_rays();
    start();
}

template <typename Act>
void SheetSides::each_neighbour(std::size_t vertex, const Act& act) const {
    const Index first = body_->range().vertices.first;
    const Index v = first + static_cast<Index>(vertex);
    const auto& edges = body_->edges();
    for (auto edge = std::lower_bound(edges.begin(), edges.end(), std::array<Index, 2>{v, -1});
         edge != edges.end() && (*edge)[0] == v; ++edge) {
        act(static_cast<std::size_t>((*edge)[1] - first), static_cast<std::size_t>(edge - edges.begin()));
    }
}

/// What edges join. A vertex without edges is a shell of its own.
void SheetSides::find_shells() {
    shell_of_vertex_.assign(body_->vertex_count(), no_shell);
    std::vector<std::size_t> waiting;
    for (std::size_t first = 0; first < shell_of_vertex_.size(); ++first) {
        if (shell_of_vertex_[first] != no_shell) continue;
        const std::size_t shell = shells_.size();
        shells_.push_back({.anchor = first});
        shell_of_vertex_[first] = shell;
        waiting.assign(1, first);
        while (!waiting.empty()) {
            const std::size_t vertex = waiting.back();
            waiting.pop_back();
            each_neighbour(vertex, [&](std::size_t other, std::size_t /*edge*/) {
                if (shell_of_vertex_[other] != no_shell) return;
                shell_of_vertex_[other] = shell;
                waiting.push_back(other);
            });
        }
    }
}

std::size_t SheetSides::shell_of(std::size_t sample) const {
    if (sample < shell_of_vertex_.size()) return shell_of_vertex_[sample];
    const Index corner = body_->topology().triangles(0, body_->area_sample(sample).triangle);
    return shell_of_vertex_[static_cast<std::size_t>(corner - body_->range().vertices.first)];
}

void SheetSides::find_anchors() {
    const Range sheet = sheet_->range().triangles;
    if (sheet.count == 0) return;
    // No vertex is farther from the sheet than from this point of it: most need not be examined.
    const Vector3 of_sheet = sheet_->now().col(sheet_->topology().triangles(0, sheet.first));
    std::vector<double> most(shells_.size(), -1.0);
    for (std::size_t vertex = 0; vertex < shell_of_vertex_.size(); ++vertex) {
        const std::size_t shell = shell_of_vertex_[vertex];
        const Vector3 p = body_->point(vertex);
        if ((p - of_sheet).norm() <= most[shell]) continue;
        const double away = sheet_->distance(p);
        if (away <= most[shell]) continue;
        most[shell] = away;
        shells_[shell].anchor = vertex;
    }
}

void SheetSides::count_rays() {
    rays_.swap(rays_before_);
    const bool none = rays_miss(body_->box(), sheet_->box());
    for (std::size_t i = 0; i < rays_.size(); ++i) rays_[i] = none ? 0 : sheet_->crossings(body_->point(i));
}

void SheetSides::start() {
    if (shells_.empty() || rays_miss(body_->box(), sheet_->box())) return;
    find_near_rim();
    std::size_t reference = shells_.front().anchor;
    double most = -1.0;
    for (const Shell& shell : shells_) {
        const double away = sheet_->distance(body_->point(shell.anchor));
        if (away <= most) continue;
        most = away;
        reference = shell.anchor;
    }
    const Vector3 from = body_->point(reference);
    for (Shell& shell : shells_) {
        shell.side = step(from, rays_[reference], body_->point(shell.anchor), rays_[shell.anchor]);
        shell.last_sure = shell.side;
    }
    for (std::size_t i = 0; i < by_motion_.size(); ++i) {
        by_motion_[i] = step(from, rays_[reference], body_->point(i), rays_[i]);
    }
    read_surface();
    hear_witnesses(true);
    declare_start_side();
}

void SheetSides::update() {
    count_rays();
    follow_anchors();
    find_near_rim();
    read_surface();
    hear_witnesses(false);
}

void SheetSides::follow_anchors() {
    const bool may_pass_rim = !rays_miss(body_->swept(), sheet_->swept());
    for (Shell& shell : shells_) {
        shell.side += rays_[shell.anchor] - rays_before_[shell.anchor];
        if (may_pass_rim) {
            shell.side -= rim_contribution(body_->point_before(shell.anchor), body_->point(shell.anchor));
        }
    }
}

/// What the rim contributed to the ray's crossings while the point went before → now past the old rim, and the rim then
/// moved over the point where it is now (the sheet's sweep is closed by walls along its rim).
int SheetSides::rim_contribution(const Vector3& before, const Vector3& now) const {
    int sum = 0;
    const Box path = box_of(before, now);
    for (const RimEdge& edge : sheet_->rim()) {
        const Vector3 u = sheet_->before().col(edge.from);
        const Vector3 v = sheet_->before().col(edge.to);
        if (!apart_seen_from_above(box_of(u, v), path)) {
            sum += edge.count * edge_passage(u, v, before, now);
        }
    }
    for (const RimEdge& edge : sheet_->moved_rim()) {
        const Vector3 u0 = sheet_->before().col(edge.from);
        const Vector3 v0 = sheet_->before().col(edge.to);
        const Vector3 u1 = sheet_->now().col(edge.from);
        const Vector3 v1 = sheet_->now().col(edge.to);
        sum -= edge.count * (upward_crossing(u0, v0, v1, now) + upward_crossing(u0, v1, u1, now));
    }
    return sum;
}

void SheetSides::find_near_rim() {
    near_rim_.clear();
    near_rim_box_.clear();
    for (const RimEdge& edge : sheet_->rim()) {
        const Vector3 u = sheet_->now().col(edge.from);
        const Vector3 v = sheet_->now().col(edge.to);
        const Box ends = box_of(u, v);
        if (rays_miss(body_->box(), ends)) continue;
        near_rim_.push_back(edge);
        near_rim_box_.push_back(ends);
    }
    if (near_rim_.empty()) return;
    near_rim_corners_.resize(3, static_cast<Eigen::Index>(near_rim_.size()));
    for (std::size_t i = 0; i < near_rim_.size(); ++i) {
        near_rim_corners_.col(static_cast<Eigen::Index>(i)) << near_rim_[i].from, near_rim_[i].to, near_rim_[i].to;
    }
    near_rim_tree_.prepare(near_rim_corners_, {0, static_cast<Index>(near_rim_.size())}, sheet_->now(), false);
}

/// Signed crossings of the curtain on the straight path, as they change the upward ray's.
int SheetSides::curtain_passages(const Vector3& from, const Vector3& to) {
    if (near_rim_.empty()) return 0;
    const Box path = box_of(from, to);
    int sum = 0;
    // A curtain has no end: only its view from above counts.
    near_rim_tree_.visit_along_from_above(from, to, [&](Index i) {
        const auto number = static_cast<std::size_t>(i);
        if (apart_seen_from_above(near_rim_box_[number], path)) return;
        const RimEdge& edge = near_rim_[number];
        sum += edge.count * edge_passage(sheet_->now().col(edge.from), sheet_->now().col(edge.to), from, to);
    });
    return sum;
}

/// Signed crossings of the sheet on the straight path between two points whose rays have been counted.
int SheetSides::step(const Vector3& from, int ray_from, const Vector3& to, int ray_to) {
    return ray_to - ray_from - curtain_passages(from, to);
}

void SheetSides::read_surface() {
    for (Shell& shell : shells_) {
        shell.rim_was_inside = shell.rim_inside;
        shell.rim_inside = false;
    }
    if (near_rim_.empty()) {  // no curtain: the sheet alone is between them
        for (std::size_t i = 0; i < by_surface_.size(); ++i) {
            const Shell& shell = shells_[shell_of(i)];
            by_surface_[i] = shell.side + rays_[i] - rays_[shell.anchor];
        }
        return;
    }
    cross_edges();
    walk_edges();
    join_area_samples();
    search_for_rim_inside();
}

/// What every edge of the body crosses; in the other direction it is the opposite.
void SheetSides::cross_edges() {
    const Index first = body_->range().vertices.first;
    const auto& edges = body_->edges();
    if (reverse_.empty()) {
        reverse_.reserve(edges.size());
        for (const auto& [u, v] : edges) {
            const auto same = std::lower_bound(edges.begin(), edges.end(), std::array<Index, 2>{v, u});
            reverse_.push_back(static_cast<std::size_t>(same - edges.begin()));
        }
        crossed_.assign(edges.size(), 0);
    }
    for (std::size_t i = 0; i < edges.size(); ++i) {
        if (edges[i][0] > edges[i][1]) continue;
        const auto from = static_cast<std::size_t>(edges[i][0] - first);
        const auto to = static_cast<std::size_t>(edges[i][1] - first);
        crossed_[i] = step(body_->point(from), rays_[from], body_->point(to), rays_[to]);
        crossed_[reverse_[i]] = -crossed_[i];
    }
}

/// The path from the anchor that crosses the sheet the fewest times (Dijkstra 1959).
void SheetSides::walk_edges() {
    const std::greater<> nearest_first;
    cost_.assign(shell_of_vertex_.size(), unreached);
    queue_.clear();
    for (const Shell& shell : shells_) {
        cost_[shell.anchor] = 0;
        by_surface_[shell.anchor] = shell.side;
        queue_.push_back({0, shell.anchor});
    }
    std::make_heap(queue_.begin(), queue_.end(), nearest_first);
    while (!queue_.empty()) {
        std::pop_heap(queue_.begin(), queue_.end(), nearest_first);
        const auto [cost, vertex] = queue_.back();
        queue_.pop_back();
        if (static_cast<int>(cost) != cost_[vertex]) continue;
        each_neighbour(vertex, [&, cost = cost, vertex = vertex](std::size_t other, std::size_t edge) {
            const int crossed = crossed_[edge];
            const int reached = static_cast<int>(cost) + std::abs(crossed);
            if (reached >= cost_[other]) return;
            cost_[other] = reached;
            by_surface_[other] = by_surface_[vertex] + crossed;
            queue_.push_back({static_cast<std::size_t>(reached), other});
            std::push_heap(queue_.begin(), queue_.end(), nearest_first);
        });
    }
}

void SheetSides::join_area_samples() {
    const Index first = body_->range().vertices.first;
    for (std::size_t i = cost_.size(); i < by_surface_.size(); ++i) {
        const auto corners = body_->topology().triangles.col(body_->area_sample(i).triangle);
        const Vector3 p = body_->point(i);
        int least = unreached;
        for (int corner = 0; corner < 3; ++corner) {
            const auto vertex = static_cast<std::size_t>(corners[corner] - first);
            const int crossed = step(body_->point(vertex), rays_[vertex], p, rays_[i]);
            const int reached = cost_[vertex] + std::abs(crossed);
            if (reached >= least) continue;
            least = reached;
            by_surface_[i] = by_surface_[vertex] + crossed;
        }
    }
}

/// Two paths over the surface that do not agree have the rim between them.
void SheetSides::search_for_rim_inside() {
    const Index first = body_->range().vertices.first;
    const auto& edges = body_->edges();
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const auto from = static_cast<std::size_t>(edges[i][0] - first);
        const auto to = static_cast<std::size_t>(edges[i][1] - first);
        Shell& shell = shells_[shell_of_vertex_[from]];
        shell.rim_inside = shell.rim_inside || by_surface_[to] - by_surface_[from] != crossed_[i];
    }
    if (!body_->range().closed) return;
    const auto is_inside = [this](Index vertex) {
        const Vector3 p = sheet_->now().col(vertex);
        return body_->box().overlaps(Box{p, p}) && body_->crossings(p) != 0;
    };
    const bool inside = std::any_of(near_rim_.begin(), near_rim_.end(),
                                    [&](const RimEdge& edge) { return is_inside(edge.from) || is_inside(edge.to); });
    if (!inside) return;
    for (Shell& shell : shells_) shell.rim_inside = true;
}

void SheetSides::hear_witnesses(bool first) {
    for (Shell& shell : shells_) {
        if (shell.rim_inside || shell.rim_was_inside || shell.doubtful) {
            shell.doubtful = shell.side != shell.last_sure;
        } else {
            shell.last_sure = shell.side;
        }
    }
    const bool may_pass_rim = !rays_miss(body_->swept(), sheet_->swept());
    for (std::size_t i = 0; i < side_.size(); ++i) {
        const Shell& shell = shells_[shell_of(i)];
        if (!shell.rim_inside) {
            by_motion_[i] = by_surface_[i];
        } else if (!first) {
            by_motion_[i] += rays_[i] - rays_before_[i];
            if (may_pass_rim) by_motion_[i] -= rim_contribution(body_->point_before(i), body_->point(i));
        }
        settle(i);
    }
}

void SheetSides::settle(std::size_t sample) {
    const bool beyond = by_surface_[sample] != 0;
    if (shells_[shell_of(sample)].doubtful || beyond != (by_motion_[sample] != 0)) {
        side_[sample] = Side::undecided;
    } else {
        side_[sample] = beyond ? Side::wrong : Side::right;
    }
}

/// A vertex that the scene declares to be on the right side: the end of an edge through the sheet. -1 when no edge
/// passes through.
Index SheetSides::declared_right() const {
    const bool in_front = sheet_->range().start_side == SheetSide::front;
    const Topology& topology = body_->topology();
    const Range own = body_->range().triangles;
    const Range other = sheet_->range().triangles;
    for (Index t = own.first; t < own.end(); ++t) {
        for (int i = 0; i < 3; ++i) {
            const Index from = topology.triangles(i, t);
            const Index to = topology.triangles((i + 1) % 3, t);
            const Vector3 p = body_->now().col(from);
            const Vector3 q = body_->now().col(to);
            const Box edge = box_of(p, q);
            if (!edge.overlaps(sheet_->box())) continue;
            for (Index face = other.first; face < other.end(); ++face) {
                const Corners corners = corners_of(topology.triangles, sheet_->now(), face);
                if (!edge.overlaps(box_of(corners))) continue;
                const auto& [a, b, c] = corners;
                const int start = orientation_sign(a, b, c, p);  // -1: in front
                if (start == 0 || orientation_sign(a, b, c, q) != -start) continue;
                const int side = orientation_sign(p, q, a, b);
                if (side == 0 || orientation_sign(p, q, b, c) != side || orientation_sign(p, q, c, a) != side) continue;
                return (start < 0) == in_front ? from : to;
            }
        }
    }
    return -1;
}

void SheetSides::declare_start_side() {
    const bool all_right = std::all_of(side_.begin(), side_.end(), [](Side side) { return side == Side::right; });
    const Index right = all_right ? -1 : declared_right();
    if (right < 0) return;
    const auto sample = static_cast<std::size_t>(right - body_->range().vertices.first);
    const int level = by_surface_[sample];
    const int motion_level = by_motion_[sample];
    for (Shell& shell : shells_) {
        shell.side -= level;
        shell.last_sure -= level;
    }
    for (std::size_t i = 0; i < side_.size(); ++i) {
        by_surface_[i] -= level;
        by_motion_[i] -= motion_level;
        settle(i);
    }
}

}  // namespace trocar
