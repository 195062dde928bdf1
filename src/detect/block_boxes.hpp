// What moved, and where it is now: the first half of ohc_clustered. Boxes of a body's vertex blocks and regions follow
// the frame; blocks that did not move since they were last read cost a look and no more.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "detect/clusters.hpp"
#include "detect/vertex_kernels.hpp"

namespace trocar {

/// Boxes of one body. Times are counted in reads, as the caller numbers them.
class BlockBoxes {
public:
    BlockBoxes(const ClusteredBody& clusters, const VertexKernels& kernels);

    /// Examines all vertices. Returns false when a number is not finite; then nothing counts as read.
    bool read_all(const Frame& frame, std::int64_t now);
    /// Examines all vertices and counts all as moved. `path`: boxes hold them at the frame before too, which is finite.
    bool read_swept(const Frame& frame, bool path, std::int64_t now);
    /// Which blocks hold vertices of `ranges` (of the frame): how many vertices read_asked will examine.
    std::int64_t ask(std::span<const Range> ranges, std::int64_t now);
    /// Examines those blocks, all others are as they were.
    bool read_asked(const Frame& frame, std::int64_t now);

    /// Box around the blocks of a group.
    [[nodiscard]] Extent group(Index group) const { return around(clusters_.blocks_of_group, group); }
    /// Box around the blocks of a region.
    [[nodiscard]] const Extent& region(Index region) const { return region_[static_cast<std::size_t>(region)]; }
    /// When a vertex of the region last moved, counting one of its blocks as a whole.
    [[nodiscard]] std::int64_t region_moved_at(Index region) const {
        return region_moved_at_[static_cast<std::size_t>(region)];
    }
    [[nodiscard]] std::int64_t group_moved_at(Index group) const;
    /// When all blocks last moved in one read.
    [[nodiscard]] std::int64_t all_moved_at() const { return all_moved_at_; }
    /// Regions whose boxes the last read changed.
    [[nodiscard]] std::span<const Index> moved_regions() const { return moved_regions_; }

private:
    bool read_block(const Frame& frame, Index block, std::int64_t now);
    bool box_block(const double* position, Index block, Extent& box) const;
    void note_moved(Index block, std::int64_t now);
    bool finish(bool finite, bool all, std::int64_t now);
    [[nodiscard]] Extent around(const Lists<Index>& blocks, Index list) const {
        Extent box;
        kernels_.box_of_boxes(block_.data(), blocks.begin(list), blocks.count(list), box);
        return box;
    }

    const ClusteredBody& clusters_;
    const VertexKernels& kernels_;
    std::vector<Extent> block_;
    std::vector<std::int64_t> block_moved_at_;
    std::vector<std::array<double, 3>> first_;  ///< each block's first vertex as last read, a NaN before
    std::unique_ptr<double[]> copy_;            ///< its vertices as last read, where copied_ says so
    std::vector<std::uint8_t> copied_;
    std::vector<Extent> region_;
    std::vector<std::int64_t> region_moved_at_;
    std::vector<Index> moved_regions_;
    std::vector<Index> moved_blocks_;
    std::int64_t last_read_ = -1;
    std::int64_t all_moved_at_ = 0;
    std::vector<Index> asked_;  ///< blocks of moved ranges
    std::vector<std::int64_t> asked_at_;
};

}  // namespace trocar
