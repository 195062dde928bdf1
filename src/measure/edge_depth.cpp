#include "measure/edge_depth.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

/// Parameter of the segment from p to q at which it passes through the triangle, or just beside it.
std::optional<double> path_through(const Corners& corners, const Vector3& p, const Vector3& q) {
    const auto& [a, b, c] = corners;
    const Vector3 normal = area_normal(corners);
    const double before = normal.dot(p - a);
    const double after = normal.dot(q - a);
    if ((before > 0.0) == (after > 0.0)) return std::nullopt;
    const double path = before / (before - after);
    const Vector3 x = p + path * (q - p);
    constexpr double beside = 1e-9;  // of the triangle's doubled area: an edge that is met counts for both neighbours
    const double least = -beside * normal.squaredNorm();
    if (normal.dot((b - a).cross(x - a)) < least || normal.dot((c - b).cross(x - b)) < least ||
        normal.dot((a - c).cross(x - c)) < least) {
        return std::nullopt;
    }
    return path;
}

/// The deepest point between two parameters of the segment from p to q; `depth_at` returns the depth of a point
/// of it, or within its second argument any bound on it.
template <typename DepthAt>
double deepest_between(double length, double first, double last, double at_least, const DepthAt& depth_at) {
    constexpr int parts = 8;
    constexpr int halvings = 6;
    double step = (last - first) / parts;
    const double half = 0.5 * (last - first);
    double best = first + half;
    // A distance changes by no more than the path along the edge.
    double depth = depth_at(best, std::max(0.0, at_least - half * length));
    if (depth + half * length <= at_least) return depth;
    for (int i = 1; i < parts; ++i) {
        const double path = first + step * i;
        const double here = depth_at(path, depth);
        if (here <= depth) continue;
        depth = here;
        best = path;
    }
    for (int i = 0; i < halvings; ++i) {
        step *= 0.5;
        for (const double path : {best - step, best + step}) {
            const double here = depth_at(path, depth);
            if (here <= depth) continue;
            depth = here;
            best = path;
            break;
        }
    }
    return depth;
}

}  // namespace

EdgeDepth edge_depth(const Triangles& triangles, const Matrix3X& position, std::span<const std::array<Index, 2>> edges,
                     const RayTree& rays, const std::function<double(const Vector3&, double)>& distance,
                     double at_least) {
    EdgeDepth result{.depth = at_least};
    std::vector<double> cuts;
    for (const auto& [from, to] : edges) {
        if (from >= to) continue;
        const Vector3 p = position.col(from);
        const Vector3 q = position.col(to);
        const Box box = box_of(p, q);
        if (!box.overlaps(rays.box())) continue;
        cuts.assign({0.0, 1.0});
        rays.visit_along(p, q, [&](Index t) {
            const Corners corners = corners_of(triangles, position, t);
            if (!box.overlaps(box_of(corners))) return;
            const auto path = path_through(corners, p, q);
            if (path) cuts.push_back(*path);
        });
        std::sort(cuts.begin(), cuts.end());
        const auto depth_at = [&](double path, double enough) {
            const Vector3 x = p + path * (q - p);
            return rays.crossings(triangles, position, x) == 0 ? 0.0 : distance(x, enough);
        };
        bool was_inside = false;
        for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
            const double middle = 0.5 * (cuts[i] + cuts[i + 1]);
            if (!(cuts[i] < middle && middle < cuts[i + 1])) continue;
            const bool inside = rays.crossings(triangles, position, p + middle * (q - p)) != 0;
            if (inside && !was_inside) ++result.stretches;
            was_inside = inside;
            if (!inside) continue;
            const double deepest = deepest_between((q - p).norm(), cuts[i], cuts[i + 1], result.depth, depth_at);
            result.depth = std::max(result.depth, deepest);
        }
    }
    return result;
}

}  // namespace trocar
