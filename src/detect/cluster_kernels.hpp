// The inner loops of ohc_clustered in the widest vectors the CPU has: boxes of vertex blocks, of clusters and of
// triangles, and sixteen boxes against one.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "detect/clusters.hpp"

namespace trocar {

/// A box of three lows and three highs, m; empty until something is put in. The fourth numbers are never looked at.
struct alignas(64) Extent {
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    std::array<double, 4> low{infinity, infinity, infinity, infinity};
    std::array<double, 4> high{-infinity, -infinity, -infinity, -infinity};
    void add(const Extent& other) {
        for (std::size_t k = 0; k < 4; ++k) low[k] = other.low[k] < low[k] ? other.low[k] : low[k];
        for (std::size_t k = 0; k < 4; ++k) high[k] = other.high[k] > high[k] ? other.high[k] : high[k];
    }
    [[nodiscard]] bool overlaps(const Extent& other) const {
        unsigned overlap = 1;
        for (std::size_t k = 0; k < 3; ++k) {
            overlap &= static_cast<unsigned>(low[k] <= other.high[k]) & static_cast<unsigned>(other.low[k] <= high[k]);
        }
        return overlap != 0;
    }
};

/// How points become floats: (x − origin) · scale, each operation rounded to nearest, no two of them fused. Each is
/// monotone, so the whole is: boxes that overlap still do, whatever is lost far from the origin. What does not fit
/// becomes infinite, never NaN.
struct FloatFrame {
    std::array<double, 3> origin{0.0, 0.0, 0.0};  ///< m
    double scale = 1.0;                           ///< a power of two, 1/m
};

/// A point in a FloatFrame; the fourth number is never looked at.
struct alignas(16) FloatPoint {
    std::array<float, 4> x;
};

/// Sixteen boxes in a FloatFrame, axis by axis.
struct alignas(64) SixteenBoxes {
    std::array<std::array<float, fan>, 3> low;
    std::array<std::array<float, fan>, 3> high;
};
struct FloatBox {
    std::array<float, 3> low;
    std::array<float, 3> high;
    [[nodiscard]] static FloatBox of(const SixteenBoxes& boxes, std::size_t i) {
        return {{boxes.low[0][i], boxes.low[1][i], boxes.low[2][i]},
                {boxes.high[0][i], boxes.high[1][i], boxes.high[2][i]}};
    }
    /// Sum of the three edges.
    [[nodiscard]] float size() const { return high[0] - low[0] + (high[1] - low[1]) + (high[2] - low[2]); }
};

using SixteenRows = std::array<std::uint16_t, fan>;

struct ClusterKernels {
    /// Box of `count` >= 1 consecutive points (x y z …). Returns false when a number is not finite.
    bool (*box_of_run)(const double* points, Index count, Extent& result);
    /// Box of the points with these `count` >= 1 numbers, of which none is larger than the last; `known` >= count
    /// numbers can be looked at to foresee what will be asked next.
    bool (*box_of_some)(const double* position, const Index* number, Index count, Index known, Extent& result);
    /// The points with these `count` >= 1 numbers, of which none is larger than the last, in a FloatFrame, and their
    /// box.
    void (*to_floats)(const double* position, const Index* number, Index count, const FloatFrame& frame,
                      FloatPoint* result, FloatBox& box);
    /// Box of the points at these places, which becomes box i of `result`.
    void (*box_of_places)(const FloatPoint* points, const std::uint16_t* place, Index count, std::size_t i,
                          SixteenBoxes& result);
    void (*boxes_of_triangles)(const FloatPoint* points, const ClusterCorners& corners, SixteenBoxes& result);
    /// Bit j is set when box j of `boxes` overlaps or touches `box`; a box of NaN overlaps nothing.
    std::uint32_t (*overlaps)(const SixteenBoxes& boxes, const FloatBox& box);
    /// As `overlaps` for each box i of `first` in `first_mask`: bit j of result[i] tells of box j of `second`. The
    /// other results are not set.
    void (*rows)(const SixteenBoxes& first, std::uint32_t first_mask, const SixteenBoxes& second, SixteenRows& result);
    const char* target;  ///< instruction set, as Highway names it
};

/// One for each instruction set that was built and that this CPU has, the best first, the plainest last.
const std::vector<ClusterKernels>& cluster_kernels();

}  // namespace trocar
