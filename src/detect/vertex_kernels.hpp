// SIMD kernels of ohc_clustered that read vertices, for the CPU's widest vectors: boxes of vertex blocks, boxes around
// those, and a group's vertices in float. A tick reads its whole frame once here, bound by memory bandwidth.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// Box of three lows and three highs, m; initially empty. The fourth numbers are ignored.
struct alignas(64) Extent {
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    std::array<double, 4> low{infinity, infinity, infinity, infinity};
    std::array<double, 4> high{-infinity, -infinity, -infinity, -infinity};
    void add(const Extent& other) {
        for (std::size_t k = 0; k < 4; ++k) low[k] = other.low[k] < low[k] ? other.low[k] : low[k];
        for (std::size_t k = 0; k < 4; ++k) high[k] = other.high[k] > high[k] ? other.high[k] : high[k];
    }
    /// Grown by `by` (m, >= 0) on all sides. Rounding is monotone: a box at exactly that distance still overlaps.
    [[nodiscard]] Extent grown(double by) const {
        Extent result = *this;
        for (double& x : result.low) x -= by;
        for (double& x : result.high) x += by;
        return result;
    }
    [[nodiscard]] bool overlaps(const Extent& other) const {
        unsigned overlap = 1;
        for (std::size_t k = 0; k < 3; ++k) {
            overlap &= static_cast<unsigned>(low[k] <= other.high[k]) & static_cast<unsigned>(other.low[k] <= high[k]);
        }
        return overlap != 0;
    }
};

/// Conversion of points to float: (x − origin) · scale, each operation rounded to nearest, none fused. Each is
/// monotone, so overlapping boxes still overlap, whatever precision is lost far from the origin. Overflow gives
/// infinity, never NaN.
struct FloatFrame {
    std::array<double, 3> origin{0.0, 0.0, 0.0};  ///< m
    double scale = 1.0;                           ///< a power of two, 1/m
};

/// A point in a FloatFrame; the fourth number is ignored.
struct alignas(16) FloatPoint {
    std::array<float, 4> x;
};

struct FloatBox {
    std::array<float, 3> low;
    std::array<float, 3> high;
    [[nodiscard]] float size() const { return high[0] - low[0] + (high[1] - low[1]) + (high[2] - low[2]); }
};

struct VertexKernels {
    /// Box of `count` >= 1 consecutive points (x y z …). Returns false when a number is not finite.
    bool (*box_of_run)(const double* points, Index count, Extent& result);
    /// Box of the points `number`[0 … count-1], count >= 1, of which none exceeds the last. The kernel may read `known`
    /// >= count numbers to prefetch later points.
    bool (*box_of_some)(const double* position, const Index* number, Index count, Index known, Extent& result);
    /// Boxes of `count` runs of consecutive points; run k is points begin[k] … begin[k + 1] - 1. Stops at the first run
    /// whose first point equals first[k] bit for bit and returns its number, else `count`. The runs before it are boxed
    /// and their first points stored. `finite` becomes false when one of their numbers is not.
    Index (*boxes_of_moved_runs)(const double* points, const Index* begin, Index count, std::array<double, 3>* first,
                                 Extent* boxes, bool& finite);
    /// Box around the `count` boxes with these numbers.
    void (*box_of_boxes)(const Extent* boxes, const Index* number, Index count, Extent& result);
    /// Converts the points `number`[0 … count-1], count >= 1, of which none exceeds the last, to a FloatFrame; also
    /// their box.
    void (*to_floats)(const double* position, const Index* number, Index count, const FloatFrame& frame,
                      FloatPoint* result, FloatBox& box);
    const char* target;  ///< instruction set, as Highway names it
};

/// One per instruction set that was built and that this CPU has, best first, scalar last.
const std::vector<VertexKernels>& vertex_kernels();

}  // namespace trocar
