#include "geometry/continuous_exclusion.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace trocar::continuous {
namespace {

/// gap(t, u, v) = base(t) + u · along_u(t) + v · along_v(t) over the unit cube: zero where the two sets touch. It is
/// linear in each variable, so its extremes over a box are at corners of the box.
struct Gap {
    MovingPoint base;
    MovingPoint along_u;
    MovingPoint along_v;
    bool triangle;           ///< only u + v <= 1 counts
    double tolerance = 0.0;  ///< bound on the rounding error of any value
};

/// True when the gap is certainly nowhere zero; false decides nothing. Examines at most `cell_limit` cells.
bool certainly_apart(const Gap& gap, int cell_limit) {
    struct Cell {
        std::array<double, 3> low;
        std::array<double, 3> size;
    };
    if (!(gap.tolerance < 1e280)) return false;  // sums might overflow
    constexpr std::size_t stack_size = 64;
    std::array<Cell, stack_size> stack;
    std::size_t depth = 0;
    stack[depth++] = {{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};
    for (int cells = 0; depth > 0; ++cells) {
        if (cells == cell_limit || depth + 2 > stack_size) return false;
        const Cell cell = stack[--depth];
        if (gap.triangle && cell.low[1] + cell.low[2] > 1.0) continue;
        std::array<Vector3, 8> value;
        for (std::size_t k = 0; k < 8; ++k) {
            const double t = cell.low[0] + ((k & 1U) != 0 ? cell.size[0] : 0.0);
            const double u = cell.low[1] + ((k & 2U) != 0 ? cell.size[1] : 0.0);
            const double v = cell.low[2] + ((k & 4U) != 0 ? cell.size[2] : 0.0);
            const auto at = [t](const MovingPoint& p) -> Vector3 { return (1.0 - t) * p.start + t * p.end; };
            value[k] = at(gap.base) + u * at(gap.along_u) + v * at(gap.along_v);
        }
        Vector3 low = value[0];
        Vector3 high = value[0];
        for (const Vector3& x : value) {
            low = low.cwiseMin(x);
            high = high.cwiseMax(x);
        }
        if ((low.array() > gap.tolerance).any() || (high.array() < -gap.tolerance).any()) continue;
        // Halve the variable that changes the gap most.
        std::array<double, 3> change{};
        for (std::size_t k = 0; k < 8; ++k) {
            for (std::size_t i = 0; i < 3; ++i) {
                const std::size_t bit = std::size_t{1} << i;
                if ((k & bit) == 0) {
                    change[i] = std::max(change[i], (value[k | bit] - value[k]).cwiseAbs().maxCoeff());
                }
            }
        }
        const auto widest = static_cast<std::size_t>(std::max_element(change.begin(), change.end()) - change.begin());
        if (!(change[widest] > gap.tolerance)) return false;  // as small as rounding: let integers decide
        Cell half = cell;
        half.size[widest] *= 0.5;
        stack[depth] = half;
        stack[depth].low[widest] += half.size[widest];
        stack[depth + 1] = half;
        depth += 2;
    }
    return true;
}

/// Sets the gap's tolerance. A difference of coordinates has one rounding error relative to its own size, so the
/// largest difference D bounds all later ones. Three of them, five roundings each, and the sum make less than 25 ·
/// 2^-53 D.
Gap with_tolerance(Gap gap) {
    double largest = 0.0;
    for (const MovingPoint* p : {&gap.base, &gap.along_u, &gap.along_v}) {
        largest = std::max({largest, p->start.cwiseAbs().maxCoeff(), p->end.cwiseAbs().maxCoeff()});
    }
    gap.tolerance = 1e-14 * largest + std::numeric_limits<double>::min();
    return gap;
}

}  // namespace

bool vertex_face_apart(const std::array<MovingPoint, 4>& points, int cell_limit) {
    return certainly_apart(with_tolerance({.base = points[1] - points[0],
                                           .along_u = points[2] - points[1],
                                           .along_v = points[3] - points[1],
                                           .triangle = true}),
                           cell_limit);
}
bool edge_edge_apart(const std::array<MovingPoint, 4>& points, int cell_limit) {
    return certainly_apart(with_tolerance({.base = points[0] - points[2],
                                           .along_u = points[1] - points[0],
                                           .along_v = points[2] - points[3],
                                           .triangle = false}),
                           cell_limit);
}

}  // namespace trocar::continuous
