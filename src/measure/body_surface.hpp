// Surface of one body for truth: sample points, and geometric queries on the current frame. The trees for rays and
// distances are built at first use.
#pragma once

#include <array>
#include <vector>

#include "geometry/triangle_sides.hpp"
#include "measure/ray_tree.hpp"
#include "measure/surface_distance.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Point at fixed weights on a triangle.
struct AreaSample {
    Index triangle = -1;
    Vector3 weights = Vector3::Zero();  ///< barycentric
};

class BodySurface {
public:
    /// The samples are all vertices of the body, then `area_samples` points spread evenly by area on `now`. `now` and
    /// `before`: 3×N, m, the current and the previous frame, owned by the caller. All outlive this.
    BodySurface(const Topology& topology, Index body, const Matrix3X& now, const Matrix3X& before, Index area_samples);

    /// Call after the matrices have changed.
    void follow();

    [[nodiscard]] const BodyRange& range() const { return *range_; }
    [[nodiscard]] std::size_t vertex_count() const { return static_cast<std::size_t>(range_->vertices.count); }
    [[nodiscard]] std::size_t sample_count() const { return vertex_count() + area_.size(); }
    [[nodiscard]] const AreaSample& area_sample(std::size_t sample) const { return area_[sample - vertex_count()]; }
    [[nodiscard]] double area_weight() const { return area_weight_; }  ///< m² that one area sample stands for
    [[nodiscard]] Vector3 point(std::size_t sample) const { return point(sample, *now_); }
    [[nodiscard]] Vector3 point_before(std::size_t sample) const { return point(sample, *before_); }
    /// Vertex numbers, both directions of each edge, sorted.
    [[nodiscard]] const std::vector<std::array<Index, 2>>& edges() const { return edges_; }
    [[nodiscard]] const Topology& topology() const { return *topology_; }
    [[nodiscard]] const Matrix3X& now() const { return *now_; }
    [[nodiscard]] const Matrix3X& before() const { return *before_; }

    [[nodiscard]] const Box& box() const { return box_; }      ///< of the vertices on the current frame
    [[nodiscard]] const Box& swept() const { return swept_; }  ///< the same together with the frame before
    /// Boundary of an open sheet; empty for a watertight surface.
    [[nodiscard]] const std::vector<RimEdge>& rim() const { return rim_; }
    /// Rim edges that have moved since the frame before.
    [[nodiscard]] const std::vector<RimEdge>& moved_rim() const { return moved_rim_; }

    [[nodiscard]] const RayTree& rays();
    [[nodiscard]] const SurfaceDistance& surface();
    /// Signed crossings of the upward ray from p with the surface. Exact.
    [[nodiscard]] int crossings(const Vector3& p);
    /// SurfaceDistance::distance, m.
    [[nodiscard]] double distance(const Vector3& p, double enough = 0.0);

private:
    [[nodiscard]] Vector3 point(std::size_t sample, const Matrix3X& at) const;
    void spread(Index count);

    const Topology* topology_;
    const BodyRange* range_;
    const Matrix3X* now_;
    const Matrix3X* before_;
    std::vector<AreaSample> area_;
    double area_weight_ = 0.0;
    std::vector<std::array<Index, 2>> edges_;
    std::vector<RimEdge> rim_;
    std::vector<RimEdge> moved_rim_;
    Box box_;
    Box swept_;
    RayTree rays_;
    bool rays_are_prepared_ = false;
    bool rays_are_current_ = false;
    SurfaceDistance distance_;
    bool distance_is_current_ = false;
};

}  // namespace trocar
