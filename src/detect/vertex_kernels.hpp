// The inner loops of ohc_clustered that read vertices, in the widest vectors the CPU has: boxes of vertex blocks, boxes
// around those, and the vertices of a group in float. A tick reads its whole frame once here, at the pace of memory.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// A box of three lows and three highs, m; empty until something is put in. The fourth numbers are never examined.
struct alignas(64) Extent {
    static constexpr double infinity = std::numeric_limits<double>::infinity();
    std::array<double, 4> low{infinity, infinity, infinity, infinity};
    std::array<double, 4> high{-infinity, -infinity, -infinity, -infinity};
    void add(const Extent& other) {
        for (std::size_t k = 0; k < 4; ++k) low[k] = other.low[k] < low[k] ? other.low[k] : low[k];
        for (std::size_t k = 0; k < 4; ++k) high[k] = other.high[k] > high[k] ? other.high[k] : high[k];
    }
    /// With `by` (m, >= 0) on all sides. Rounding is monotone: what is exactly that near still overlaps.
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

/// How points become floats: (x − origin) · scale, each operation rounded to nearest, no two of them fused. Each is
/// monotone, so the whole is: boxes that overlap still do, whatever is lost far from the origin. What does not fit
/// becomes infinite, never NaN.
struct FloatFrame {
    std::array<double, 3> origin{0.0, 0.0, 0.0};  ///< m
    double scale = 1.0;                           ///< a power of two, 1/m
};

/// A point in a FloatFrame; the fourth number is never examined.
struct alignas(16) FloatPoint {
    std::array<float, 4> x;
};

struct FloatBox {
    std::array<float, 3> low;
    std::array<float, 3> high;
    /// Sum of the three edges.
    [[nodiscard]] float size() const { return high[0] - low[0] + (high[1] - low[1]) + (high[2] - low[2]); }
};

struct VertexKernels {
    /// Box of `count` >= 1 consecutive points (x y z …). Returns false when a number is not finite.
    bool (*box_of_run)(const double* points, Index count, Extent& result);
    /// Box of the points with these `count` >= 1 numbers, of which none is larger than the last; `known` >= count
    /// numbers can be examined to foresee what will be asked next.
    bool (*box_of_some)(const double* position, const Index* number, Index count, Index known, Extent& result);
    /// Boxes of `count` runs of consecutive points, of which run k goes from point begin[k] to begin[k + 1], up to the
    /// first run whose first point is first[k], bit for bit: its number is returned, `count` if there is none. Those
    /// before it are boxed and their first points kept. `finite` becomes false when one of their numbers is not.
    Index (*boxes_of_moved_runs)(const double* points, const Index* begin, Index count, std::array<double, 3>* first,
                                 Extent* boxes, bool& finite);
    /// Box around the `count` boxes with these numbers.
    void (*box_of_boxes)(const Extent* boxes, const Index* number, Index count, Extent& result);
    /// The points with these `count` >= 1 numbers, of which none is larger than the last, in a FloatFrame, and their
    /// box.
    void (*to_floats)(const double* position, const Index* number, Index count, const FloatFrame& frame,
                      FloatPoint* result, FloatBox& box);
    const char* target;  ///< instruction set, as Highway names it
};

/// One for each instruction set that was built and that this CPU has, the best first, the plainest last.
const std::vector<VertexKernels>& vertex_kernels();

}  // namespace trocar
