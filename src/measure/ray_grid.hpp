// The triangles of one body sorted into cells of the xy plane, so that truth finds those over a point or along a
// segment without looking at all of them. Shared with no contestant.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/types.hpp"
#include "measure/vertical_crossings.hpp"

namespace trocar {

class RayGrid {
public:
    /// `box` holds the triangles of the range. What was built before is replaced. Triangles that are beside `asked`,
    /// seen from above, are left out: where nobody will ask.
    void build(const Triangles& triangles, Range range, const Matrix3X& position, const Box& box, const Box& asked);

    /// Signed crossings of the upward ray from p with the surface. Exact.
    [[nodiscard]] int crossings(const Triangles& triangles, const Matrix3X& position, const Vector3& p) const;

    [[nodiscard]] const Box& box() const { return box_; }
    [[nodiscard]] const Box& box_of(Index triangle) const {
        return boxes_[static_cast<std::size_t>(triangle - first_)];
    }

    /// Calls act(triangle) at least once for every triangle that the segment from p to q meets, and for some others.
    template <typename Act>
    void visit_along(const Vector3& p, const Vector3& q, const Act& act) const {
        const Vector3 low = p.cwiseMin(q);
        const Vector3 high = p.cwiseMax(q);
        if (!Box{low, high}.overlaps(box_)) return;
        const Vector3 way = q - p;
        for (Index y = index(low.y(), 1); y <= index(high.y(), 1); ++y) {
            const auto [from, to] = within_row(p, way, y);
            const double x0 = std::clamp(p.x() + from * way.x(), low.x(), high.x());
            const double x1 = std::clamp(p.x() + to * way.x(), low.x(), high.x());
            // A cell more on either side takes what rounding may have cut off.
            const Index first = std::max<Index>(index(std::min(x0, x1), 0) - 1, 0);
            const Index last = std::min<Index>(index(std::max(x0, x1), 0) + 1, cells_ - 1);
            for (Index x = first; x <= last; ++x) {
                const std::size_t cell = cell_at(x, y);
                for (Index i = starts_[cell]; i < starts_[cell + 1]; ++i) act(entries_[static_cast<std::size_t>(i)]);
            }
        }
    }

private:
    struct Stretch {
        double from = 0.0;
        double to = 1.0;
    };
    /// Shares of the way from p that lie in one row of cells; the outer rows have no end.
    [[nodiscard]] Stretch within_row(const Vector3& p, const Vector3& way, Index row) const;
    /// Monotone in the coordinate: a point within a triangle's range of coordinates is within its range of cells.
    [[nodiscard]] Index index(double coordinate, int axis) const {
        const double cell = (coordinate - box_.min[axis]) * scale_[axis];
        return static_cast<Index>(std::clamp(cell, 0.0, static_cast<double>(cells_ - 1)));
    }
    [[nodiscard]] std::size_t cell_at(Index x, Index y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(cells_) + static_cast<std::size_t>(x);
    }
    template <typename Visit>
    void for_each_cell(const Visit& visit) const {
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            const Box& box = boxes_[i];
            if (apart_seen_from_above(box, asked_)) continue;
            for (Index y = index(box.min.y(), 1); y <= index(box.max.y(), 1); ++y) {
                for (Index x = index(box.min.x(), 0); x <= index(box.max.x(), 0); ++x) {
                    visit(cell_at(x, y), first_ + static_cast<Index>(i));
                }
            }
        }
    }

    Box asked_;
    Index first_ = 0;         ///< triangle
    std::vector<Box> boxes_;  ///< per triangle
    Box box_;
    Index cells_ = 0;
    Eigen::Vector2d scale_ = Eigen::Vector2d::Zero();
    std::vector<Index> starts_;
    std::vector<Index> fill_;
    std::vector<Index> entries_;
};

}  // namespace trocar
