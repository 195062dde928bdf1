// Uniform grid of ohc: maps a coordinate to a cell by one monotone expression. Monotonicity proves that no pair is
// lost: overlapping boxes have overlapping index ranges on every axis.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "geometry/types.hpp"

namespace trocar {

/// Cell numbers along x, y, z; the fourth entry is unused (it fills a 16-byte register).
using Cell = std::int32_t __attribute__((vector_size(16)));

/// Two coordinates in one 16-byte register.
using Two = double __attribute__((vector_size(16)));

inline Cell cell_min(Cell a, Cell b) { return a < b ? a : b; }
inline Cell cell_max(Cell a, Cell b) { return a > b ? a : b; }

/// Inclusive range of cells on each axis.
struct CellRange {
    Cell low;
    Cell high;
    /// Number of cells, as a double because three 32-bit lengths can overflow 64 bits.
    [[nodiscard]] double cell_count() const {
        return (static_cast<double>(high[0]) - low[0] + 1.0) * (static_cast<double>(high[1]) - low[1] + 1.0) *
               (static_cast<double>(high[2]) - low[2] + 1.0);
    }
    /// True when no axis holds more than `most` + 1 cells. (Cell numbers stay below 2^30, so differences fit.)
    [[nodiscard]] bool within(std::int32_t most) const {
        const Cell wider = (high - low) > most;
        return ((wider[0] | wider[1]) | wider[2]) == 0;
    }
    [[nodiscard]] bool overlaps(const CellRange& other) const {
        return low[0] <= other.high[0] && other.low[0] <= high[0] && low[1] <= other.high[1] &&
               other.low[1] <= high[1] && low[2] <= other.high[2] && other.low[2] <= high[2];
    }
    [[nodiscard]] bool contains(const CellRange& other) const {
        return low[0] <= other.low[0] && low[1] <= other.low[1] && low[2] <= other.low[2] && other.high[0] <= high[0] &&
               other.high[1] <= high[1] && other.high[2] <= high[2];
    }
    bool operator==(const CellRange& other) const {
        return low[0] == other.low[0] && low[1] == other.low[1] && low[2] == other.low[2] && high[0] == other.high[0] &&
               high[1] == other.high[1] && high[2] == other.high[2];
    }
};

/// Maps coordinates to cell numbers: q(x) = round(x / h − base), clamped below 2^30 in size. Multiplication,
/// subtraction, rounding and clamping are each monotone, so q is. Coordinates beyond the clamp share the border cell,
/// which costs time and loses no pair. `base` keeps the numbers small wherever the scene lies (1e4 m or 1e-6 m).
class Lattice {
public:
    /// `edge`: cell edge h, m, > 0. `corner`: a point near which numbers are small, m.
    void set(double edge, const Vector3& corner) {
        inverse_ = std::min(1.0 / edge, 1e300);
        for (int axis = 0; axis < 3; ++axis) {
            base_[axis] = std::clamp(std::floor(corner[axis] * inverse_), -1e300, 1e300);
        }
    }
    [[nodiscard]] std::int32_t number(double x, int axis) const {
        double t = x * inverse_ - base_[axis];
        t = t < limit ? t : limit;  // in this form a NaN becomes the limit
        t = t > -limit ? t : -limit;
        // Adding 1.5 × 2^52 rounds to the nearest integer and leaves it in the low bits, without call or branch.
        return static_cast<std::int32_t>(std::bit_cast<std::int64_t>(t + 6755399441055744.0));
    }
    [[nodiscard]] Cell cell(const Vector3& x) const {
        return Cell{number(x[0], 0), number(x[1], 1), number(x[2], 2), 0};
    }
    /// Cells of the corners of a box, two numbers at a time.
    [[nodiscard]] CellRange range(Two low_xy, Two high_xy, Two low_high_z) const {
        const Two base_xy{base_[0], base_[1]};
        const Cell low = numbers(low_xy, base_xy);
        const Cell high = numbers(high_xy, base_xy);
        const Cell z = numbers(low_high_z, Two{base_[2], base_[2]});
        return {__builtin_shufflevector(low, z, 0, 2, 4, 7), __builtin_shufflevector(high, z, 0, 2, 6, 7)};
    }

    /// True when a cell number is at the clamp, so that another corner is needed.
    static bool at_limit(const CellRange& range) {
        constexpr auto most = static_cast<std::int32_t>(limit);
        for (int axis = 0; axis < 3; ++axis) {
            if (range.low[axis] <= -most || range.high[axis] >= most) return true;
        }
        return false;
    }
    [[nodiscard]] double edge() const { return 1.0 / inverse_; }
    [[nodiscard]] double inverse() const { return inverse_; }
    [[nodiscard]] double base(int axis) const { return base_[axis]; }
    static constexpr double limit = 1073741823.0;  ///< largest cell number, 2^30 - 1

private:
    /// As `number`; the result is in lanes 0 and 2.
    [[nodiscard]] Cell numbers(Two x, Two base) const {
        const Two most{limit, limit};
        Two t = x * inverse_ - base;
        t = t < most ? t : most;
        t = t > -most ? t : -most;
        return std::bit_cast<Cell>(t + 6755399441055744.0);
    }
    double inverse_ = 1.0;
    double base_[3] = {0.0, 0.0, 0.0};
};

}  // namespace trocar
