// SIMD kernels of ohc_clustered for the CPU's widest vectors: float boxes of clusters and of triangles, and overlap of
// sixteen boxes with one.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "detect/clusters.hpp"
#include "detect/vertex_kernels.hpp"

namespace trocar {

/// Sixteen boxes in a FloatFrame, axis by axis.
struct alignas(64) SixteenBoxes {
    std::array<std::array<float, fan>, 3> low;
    std::array<std::array<float, fan>, 3> high;
};
/// Box i.
[[nodiscard]] inline FloatBox box_of(const SixteenBoxes& boxes, std::size_t i) {
    return {{boxes.low[0][i], boxes.low[1][i], boxes.low[2][i]},
            {boxes.high[0][i], boxes.high[1][i], boxes.high[2][i]}};
}

/// Low of a box grown by `query_distance`, in a FloatFrame. Conservative: not above the low of any box that, before
/// rounding, is within `query_distance`. Both arguments have a relative error of 2^-24, and three operations round
/// here. An infinite low gives -infinity.
[[nodiscard]] inline float grown_down(float low, float query_distance) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    const float size = low < 0.0F ? -low : low;
    const float wider = query_distance * (1.0F + 0x1p-20F) + std::numeric_limits<float>::min();
    return size == infinity ? -infinity : low - (size * 0x1p-21F + wider);
}
[[nodiscard]] inline float grown_up(float high, float query_distance) { return -grown_down(-high, query_distance); }

using SixteenRows = std::array<std::uint16_t, fan>;

struct ClusterKernels {
    /// Writes the box of the points at these places to box i of `result`.
    void (*box_of_places)(const FloatPoint* points, const std::uint16_t* place, Index count, std::size_t i,
                          SixteenBoxes& result);
    void (*boxes_of_triangles)(const FloatPoint* points, const ClusterCorners& corners, SixteenBoxes& result);
    /// Bit j is set when box j of `boxes` overlaps or touches `box`; a box of NaN overlaps nothing.
    std::uint32_t (*overlaps)(const SixteenBoxes& boxes, const FloatBox& box);
    /// `overlaps` for each box i of `first` in `first_mask`: bit j of result[i] belongs to box j of `second`. Other
    /// results are not set.
    void (*rows)(const SixteenBoxes& first, std::uint32_t first_mask, const SixteenBoxes& second, SixteenRows& result);
    /// Grows each box by `query_distance` as grown_down and grown_up do; NaN stays NaN.
    void (*grow)(const SixteenBoxes& boxes, float query_distance, SixteenBoxes& result);
    const char* target;  ///< instruction set, as Highway names it
};

/// One per instruction set that was built and that this CPU has, best first, scalar last.
const std::vector<ClusterKernels>& cluster_kernels();

}  // namespace trocar
