// First half of ohc_clustered: updates the boxes of a body's vertex blocks and regions for each frame, and records what
// moved. A block that did not move is only compared with its last read.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "detect/clusters.hpp"
#include "detect/vertex_kernels.hpp"

namespace trocar {

/// Boxes of one body. Time is the number of the read, as the caller counts it.
class BlockBoxes {
public:
    BlockBoxes(const ClusteredBody& clusters, const VertexKernels& kernels);

    /// Reads all vertices. Returns false when a number is not finite; then nothing counts as read.
    bool read_all(const Frame& frame, std::int64_t now);
    /// Reads all vertices and counts all as moved. `path`: boxes also hold the frame before, which must be finite.
    bool read_swept(const Frame& frame, bool path, std::int64_t now);
    /// Selects the blocks that hold vertices of `ranges` (frame numbers) and returns how many vertices read_asked
    /// reads.
    std::int64_t ask(std::span<const Range> ranges, std::int64_t now);
    /// Reads the selected blocks; all others count as unchanged.
    bool read_asked(const Frame& frame, std::int64_t now);

    /// Box around the blocks of a group.
    [[nodiscard]] Extent group(Index group) const { return around(clusters_.blocks_of_group, group); }
    /// Box around the blocks of a region.
    [[nodiscard]] const Extent& region(Index region) const { return region_[static_cast<std::size_t>(region)]; }
    /// Last read in which the region moved; it moves when any of its blocks does.
    [[nodiscard]] std::int64_t region_moved_at(Index region) const {
        return region_moved_at_[static_cast<std::size_t>(region)];
    }
    [[nodiscard]] std::int64_t group_moved_at(Index group) const;
    /// Last read in which all blocks moved.
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
    std::vector<std::array<double, 3>> first_;  ///< each block's first vertex as last read; NaN before the first read
    std::unique_ptr<double[]> copy_;            ///< each block's vertices as last read, valid where copied_ is set
    std::vector<std::uint8_t> copied_;
    std::vector<Extent> region_;
    std::vector<std::int64_t> region_moved_at_;
    std::vector<Index> moved_regions_;
    std::vector<Index> moved_blocks_;
    std::int64_t last_read_ = -1;
    std::int64_t all_moved_at_ = 0;
    std::vector<Index> asked_;  ///< blocks selected by `ask`
    std::vector<std::int64_t> asked_at_;
};

}  // namespace trocar
