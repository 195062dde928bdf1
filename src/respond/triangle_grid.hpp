// Which tissue triangles lie near a segment or a point: back-projection and the crossing ledger ask this for a few
// instrument vertices per tick. A hash grid that is refilled each tick and keeps its memory.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

class TriangleGrid {
public:
    /// Enters the triangles with these numbers, and only these, at these positions (3×N, m), in cells 1.5 mean edges
    /// wide. Non-finite triangles are left out.
    void fill(const Topology& topology, const Matrix3X& position, const std::vector<Index>& triangles);
    [[nodiscard]] const Box& bounds() const { return bounds_; }
    [[nodiscard]] double cell() const { return cell_; }

    /// Calls visit(triangle) once for every triangle whose box, at the positions of the last fill, meets the box.
    template <typename Visit>
    void visit(const Box& box, const Visit& visit) {
        if (!box.overlaps(bounds_)) return;
        ++stamp_;
        const Cell low = cell_of(box.min.cwiseMax(bounds_.min));
        const Cell high = cell_of(box.max.cwiseMin(bounds_.max));
        for (std::int32_t x = low[0]; x <= high[0]; ++x) {
            for (std::int32_t y = low[1]; y <= high[1]; ++y) {
                for (std::int32_t z = low[2]; z <= high[2]; ++z) {
                    const std::size_t slot = slot_of(x, y, z);
                    for (std::uint32_t e = first_[slot]; e < first_[slot + 1]; ++e) {
                        const std::uint32_t local = entry_[e];
                        if (seen_[local] == stamp_) continue;
                        seen_[local] = stamp_;
                        if (boxes_[local].overlaps(box)) visit(triangles_[local]);
                    }
                }
            }
        }
    }

private:
    void resize();

    using Cell = std::array<std::int32_t, 3>;
    struct Cells {
        Cell low{0, 0, 0};
        Cell high{-1, -1, -1};
    };
    /// Of a point within the bounds, so that cutting off the fraction is rounding down; at most 1e5 on an axis.
    [[nodiscard]] Cell cell_of(const Vector3& p) const {
        const Vector3 scaled = (p - bounds_.min) / cell_;
        return {static_cast<std::int32_t>(scaled.x()), static_cast<std::int32_t>(scaled.y()),
                static_cast<std::int32_t>(scaled.z())};
    }
    [[nodiscard]] std::size_t slot_of(std::int64_t x, std::int64_t y, std::int64_t z) const {
        const auto mixed = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15ULL ^
                           static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4FULL ^
                           static_cast<std::uint64_t>(z) * 0x165667B19E3779F9ULL;
        return static_cast<std::size_t>((mixed * 0x9E3779B97F4A7C15ULL) >> shift_);
    }

    std::vector<Index> triangles_;
    std::vector<Box> boxes_;    ///< of each triangle; empty where it is not finite
    std::vector<Cells> cells_;  ///< that each box meets
    Box bounds_;
    double cell_ = 1.0;
    int shift_ = 63;
    std::vector<std::uint32_t> first_;  ///< slots + 1
    std::vector<std::uint32_t> entry_;  ///< positions in triangles_
    std::vector<std::uint32_t> next_;
    std::vector<std::uint64_t> seen_;
    std::uint64_t stamp_ = 0;
};

}  // namespace trocar
