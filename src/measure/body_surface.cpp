#include "measure/body_surface.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/exact.hpp"

namespace trocar {

BodySurface::BodySurface(const Topology& topology, Index body, const Matrix3X& now, const Matrix3X& before,
                         Index area_samples)
    : topology_(&topology), range_(&topology.bodies[static_cast<std::size_t>(body)]), now_(&now), before_(&before) {
    spread(area_samples);
    const std::vector<TriangleSide> sides = sorted_sides(topology.triangles, range_->triangles);
    for_each_edge(sides, [this](std::span<const TriangleSide> edge) {
        edges_.push_back({edge.front().low, edge.front().high});
        edges_.push_back({edge.front().high, edge.front().low});
    });
    std::sort(edges_.begin(), edges_.end());
    if (!range_->closed) rim_ = rim_of(sides);
    distance_.prepare(topology.triangles, range_->triangles, now);
    follow();
}

/// Evenly by area over the triangles, the same on every machine: strata along the summed area, and within the triangles
/// the additive recurrence of Roberts (2018), folded into the triangle.
void BodySurface::spread(Index count) {
    const Range range = range_->triangles;
    std::vector<double> area_up_to;
    double total = 0.0;
    for (Index t = range.first; t < range.end(); ++t) {
        total += 0.5 * area_normal(corners_of(topology_->triangles, *now_, t)).norm();
        area_up_to.push_back(total);
    }
    if (!(total > 0.0)) return;
    constexpr double step_u = 0.7548776662466927;
    constexpr double step_v = 0.5698402909980532;
    for (Index i = 0; i < count; ++i) {
        const double wanted = total * (i + 0.5) / count;
        const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end() - 1, wanted);
        double u = std::fmod(0.5 + step_u * (i + 1), 1.0);
        double v = std::fmod(0.5 + step_v * (i + 1), 1.0);
        if (u + v > 1.0) {
            u = 1.0 - u;
            v = 1.0 - v;
        }
        area_.push_back({range.first + static_cast<Index>(found - area_up_to.begin()), Vector3(1.0 - u - v, u, v)});
    }
    if (!area_.empty()) area_weight_ = total / static_cast<double>(area_.size());
}

void BodySurface::follow() {
    swept_ = box_;
    const Range vertices = range_->vertices;
    // Between detection and the step a body either moves or does not: what was built for it stands while it rests.
    const bool rests =
        now_->middleCols(vertices.first, vertices.count) == before_->middleCols(vertices.first, vertices.count);
    box_ = box_of(*now_, vertices);
    swept_.add(box_);
    rays_are_current_ = rays_are_current_ && rests;
    distance_is_current_ = distance_is_current_ && rests;
    moved_rim_.clear();
    if (rests) return;
    for (const RimEdge& edge : rim_) {
        if (now_->col(edge.from) != before_->col(edge.from) || now_->col(edge.to) != before_->col(edge.to)) {
            moved_rim_.push_back(edge);
        }
    }
}

Vector3 BodySurface::point(std::size_t sample, const Matrix3X& at) const {
    if (sample < vertex_count()) return at.col(range_->vertices.first + static_cast<Index>(sample));
    const AreaSample& area = area_sample(sample);
    const auto corners = topology_->triangles.col(area.triangle);
    return area.weights[0] * at.col(corners[0]) + area.weights[1] * at.col(corners[1]) +
           area.weights[2] * at.col(corners[2]);
}

const RayTree& BodySurface::rays() {
    if (!rays_are_prepared_) {
        rays_.prepare(topology_->triangles, range_->triangles, *now_);
    } else if (!rays_are_current_) {
        rays_.refit(topology_->triangles, *now_);
    }
    rays_are_prepared_ = true;
    rays_are_current_ = true;
    return rays_;
}

int BodySurface::crossings(const Vector3& p) { return rays().crossings(topology_->triangles, *now_, p); }

const SurfaceDistance& BodySurface::surface() {
    if (!distance_is_current_) distance_.refit(topology_->triangles, *now_);
    distance_is_current_ = true;
    return distance_;
}

double BodySurface::distance(const Vector3& p, double enough) {
    return surface().distance(topology_->triangles, *now_, p, enough);
}

}  // namespace trocar
