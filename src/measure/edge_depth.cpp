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

/// Halvings of a part of an edge in the search for its deepest point.
constexpr int halvings = 8;

/// Search of one edge for a point deeper than those before it.
struct DeepestPoint {
    const Triangles& triangles;
    const Matrix3X& position;
    const RayTree& rays;
    const SurfaceDistance& surface;
    Vector3 from;
    Vector3 along;
    double depth;  ///< m, of the deepest point so far

    [[nodiscard]] Vector3 at(double path) const { return from + path * along; }

    [[nodiscard]] bool inside(double path) const { return rays.crossings(triangles, position, at(path)) != 0; }

    /// Branch and bound: halves the part between two parameters while its bound is larger, at most `times` times.
    void search(double first, double last, int times) {
        constexpr double rounding = 1e-9;  // of a depth: a part that is equally deep everywhere ends here
        const double deeper = depth * (1.0 + rounding);
        if (surface.bound_along(triangles, position, at(first), at(last), deeper) <= deeper) return;
        const double middle = 0.5 * (first + last);
        const double here = surface.distance(triangles, position, at(middle), depth);
        if (here > depth && inside(middle)) depth = here;
        if (times == 0) return;
        search(first, middle, times - 1);
        search(middle, last, times - 1);
    }
};

}  // namespace

EdgeDepth edge_depth(const Triangles& triangles, const Matrix3X& position, std::span<const std::array<Index, 2>> edges,
                     const RayTree& rays, const SurfaceDistance& surface, std::span<const double> vertex_bounds,
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
        bool is_near = false;
        rays.visit_along(p, q, [&](Index t) {
            const Corners corners = corners_of(triangles, position, t);
            if (!box.overlaps(box_of(corners))) return;
            is_near = true;
            const auto path = path_through(corners, p, q);
            if (path) cuts.push_back(*path);
        });
        const double bound_from = vertex_bounds[at(from)];
        const double bound_to = vertex_bounds[at(to)];
        if (!is_near) {
            if (bound_from < 0.0) continue;
            // A distance changes by no more than the path.
            if (bound_from + bound_to + (q - p).norm() <= 2.0 * result.depth) {
                ++result.stretches;
                continue;
            }
        }
        std::sort(cuts.begin(), cuts.end());
        DeepestPoint deepest{triangles, position, rays, surface, p, q - p, result.depth};
        bool was_inside = false;
        for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
            const double middle = 0.5 * (cuts[i] + cuts[i + 1]);
            if (!(cuts[i] < middle && middle < cuts[i + 1])) continue;
            const bool inside = deepest.inside(middle);
            if (inside && !was_inside) ++result.stretches;
            was_inside = inside;
            if (inside) deepest.search(cuts[i], cuts[i + 1], halvings);
        }
        result.depth = deepest.depth;
    }
    return result;
}

}  // namespace trocar
