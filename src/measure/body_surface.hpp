// One body as truth sees it: the points of it that are judged, and the questions that are asked of its surface on the
// current frame. What is dear to build (the trees for rays and for distances) is built when first asked for.
#pragma once

#include <array>
#include <vector>

#include "measure/ray_tree.hpp"
#include "measure/surface_distance.hpp"
#include "scene/world.hpp"

namespace trocar {

/// A directed edge of a surface's boundary chain: edges that the triangles on both sides cancel do not appear.
struct RimEdge {
    Index from = -1;
    Index to = -1;
    int count = 0;  ///< net number of times that triangles run along it
};

/// A point that rides on a triangle.
struct AreaSample {
    Index triangle = -1;
    Vector3 weights = Vector3::Zero();  ///< barycentric
};

class BodySurface {
public:
    /// The samples are all vertices of the body, then `area_samples` points evenly by area, as it is at `now`. The
    /// matrices (3×N, m) are the caller's: `now` of the current frame, `before` of the one before. All outlive this.
    BodySurface(const Topology& topology, Index body, const Matrix3X& now, const Matrix3X& before, Index area_samples);

    /// To be called when the matrices have changed.
    void follow();

    [[nodiscard]] const BodyRange& range() const { return *range_; }
    [[nodiscard]] std::size_t vertex_count() const { return static_cast<std::size_t>(range_->vertices.count); }
    [[nodiscard]] std::size_t sample_count() const { return vertex_count() + area_.size(); }
    [[nodiscard]] const AreaSample& area_sample(std::size_t sample) const { return area_[sample - vertex_count()]; }
    [[nodiscard]] double area_weight() const { return area_weight_; }  ///< m² that one area sample stands for
    [[nodiscard]] Vector3 point(std::size_t sample) const { return point(sample, *now_); }
    [[nodiscard]] Vector3 point_before(std::size_t sample) const { return point(sample, *before_); }
    /// Vertex numbers, both ways, sorted.
    [[nodiscard]] const std::vector<std::array<Index, 2>>& edges() const { return edges_; }
    [[nodiscard]] const Topology& topology() const { return *topology_; }
    [[nodiscard]] const Matrix3X& now() const { return *now_; }
    [[nodiscard]] const Matrix3X& before() const { return *before_; }

    [[nodiscard]] const Box& box() const { return box_; }      ///< of the vertices on the current frame
    [[nodiscard]] const Box& swept() const { return swept_; }  ///< the same together with the frame before
    /// Of an open sheet; empty for a watertight surface.
    [[nodiscard]] const std::vector<RimEdge>& rim() const { return rim_; }
    /// Those that have moved since the frame before.
    [[nodiscard]] const std::vector<RimEdge>& moved_rim() const { return moved_rim_; }

    [[nodiscard]] const RayTree& rays();
    /// Signed crossings of the upward ray from p with the surface. Exact.
    [[nodiscard]] int crossings(const Vector3& p);
    /// Distance of p to the surface, m.
    [[nodiscard]] double distance(const Vector3& p);

private:
    [[nodiscard]] Vector3 point(std::size_t sample, const Matrix3X& at) const;
    void spread(Index count);
    void find_edges();

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
