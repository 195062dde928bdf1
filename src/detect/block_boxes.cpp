#include "detect/block_boxes.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>

namespace trocar {
namespace {

/// Bit for bit, so that a NaN equals itself and every change counts.
bool same(const void* a, const void* b, std::size_t bytes) { return std::memcmp(a, b, bytes) == 0; }

/// Mark of a block that was not read yet: no readable frame has such a vertex.
constexpr std::array<double, 3> unread{std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0};

}  // namespace

BlockBoxes::BlockBoxes(const ClusteredBody& clusters, const VertexKernels& kernels)
    : clusters_(clusters), kernels_(kernels) {
    const auto blocks = static_cast<std::size_t>(clusters.block_count);
    const auto regions = static_cast<std::size_t>(clusters.region_count);
    block_.resize(blocks);
    block_moved_at_.assign(blocks, 0);
    copied_.assign(blocks, 0);
    first_.assign(blocks, unread);
    // Not initialised, so that blocks that always move never take memory pages.
    copy_ = std::make_unique_for_overwrite<double[]>(3 * static_cast<std::size_t>(clusters.vertices.count));
    region_.resize(regions);
    region_moved_at_.assign(regions, 0);
    moved_regions_.reserve(regions);
    moved_blocks_.reserve(blocks);
    asked_.reserve(blocks);
    asked_at_.assign(blocks, -1);
}

bool BlockBoxes::read_all(const Frame& frame, std::int64_t now) {
    bool finite = true;
    Index block = 0;
    if (clusters_.vertex_order.empty()) {
        // A deforming body moves in all its blocks; single blocks are then not recorded.
        block = kernels_.boxes_of_moved_runs(
            frame.position.data() + 3 * static_cast<std::size_t>(clusters_.vertices.first),
            clusters_.block_begin.data(), clusters_.block_count, first_.data(), block_.data(), finite);
        std::fill_n(copied_.begin(), block, std::uint8_t{0});
        if (block == clusters_.block_count) return finish(finite, true, now);
        for (Index moved = 0; moved < block; ++moved) note_moved(moved, now);
    }
    for (; block < clusters_.block_count; ++block) finite &= read_block(frame, block, now);
    return finish(finite, moved_blocks_.size() == block_.size(), now);
}

bool BlockBoxes::read_swept(const Frame& frame, bool path, std::int64_t now) {
    bool finite = true;
    for (Index block = 0; block < clusters_.block_count; ++block) {
        const auto b = static_cast<std::size_t>(block);
        finite &= box_block(frame.position.data(), block, block_[b]);
        if (path) {
            Extent before;
            finite &= box_block(frame.previous.data(), block, before);
            block_[b].add(before);
        }
    }
    return finish(finite, true, now);
}

/// Box of a block; false when a number is not finite.
bool BlockBoxes::box_block(const double* position, Index block, Extent& box) const {
    const Index begin = clusters_.block_begin[static_cast<std::size_t>(block)];
    const Index count = clusters_.block_begin[static_cast<std::size_t>(block) + 1] - begin;
    if (clusters_.vertex_order.empty()) {
        const Index first = clusters_.vertices.first + begin;
        return kernels_.box_of_run(position + 3 * static_cast<std::size_t>(first), count, box);
    }
    return kernels_.box_of_some(position, clusters_.vertex_order.data() + begin, count,
                                clusters_.vertices.count - begin, box);
}

std::int64_t BlockBoxes::ask(std::span<const Range> ranges, std::int64_t now) {
    asked_.clear();
    std::int64_t vertices = 0;
    const auto ask = [this, now, &vertices](Index block) {
        const auto b = static_cast<std::size_t>(block);
        if (std::exchange(asked_at_[b], now) == now) return;
        asked_.push_back(block);
        vertices += clusters_.block_begin[b + 1] - clusters_.block_begin[b];
    };
    const Range& own = clusters_.vertices;
    for (const Range& range : ranges) {
        const Index first = std::max(range.first, own.first) - own.first;
        const Index end = std::min(range.end(), own.end()) - own.first;
        if (first >= end) continue;
        if (clusters_.vertex_order.empty()) {
            const Index last = clusters_.block_of[static_cast<std::size_t>(end) - 1];
            for (Index block = clusters_.block_of[static_cast<std::size_t>(first)]; block <= last; ++block) ask(block);
        } else {
            for (Index v = first; v < end; ++v) ask(clusters_.block_of[static_cast<std::size_t>(v)]);
        }
    }
    return vertices;
}

bool BlockBoxes::read_asked(const Frame& frame, std::int64_t now) {
    bool finite = true;
    for (const Index block : asked_) finite &= read_block(frame, block, now);
    return finish(finite, moved_blocks_.size() == block_.size(), now);
}

/// A block whose first vertex moved has moved, so a deforming body pays only for that test. Otherwise the block is
/// compared with a copy of the last read.
bool BlockBoxes::read_block(const Frame& frame, Index block, std::int64_t now) {
    const auto b = static_cast<std::size_t>(block);
    const Index begin = clusters_.block_begin[static_cast<std::size_t>(block)];
    const Index count = clusters_.block_begin[static_cast<std::size_t>(block) + 1] - begin;
    const double* const position = frame.position.data();
    const bool run = clusters_.vertex_order.empty();
    const Index* const order = run ? nullptr : clusters_.vertex_order.data() + begin;
    const auto point = [&](Index k) {
        return position + 3 * static_cast<std::size_t>(run ? clusters_.vertices.first + begin + k : order[k]);
    };
    double* const copy = copy_.get() + 3 * static_cast<std::size_t>(begin);
    constexpr std::size_t point_bytes = 3 * sizeof(double);
    const auto run_bytes = static_cast<std::size_t>(count) * point_bytes;

    if (!same(first_[b].data(), point(0), point_bytes)) {
        std::memcpy(first_[b].data(), point(0), point_bytes);
        copied_[b] = 0;
    } else {
        if (copied_[b] != 0) {
            bool rests = true;
            if (run) {
                rests = same(copy, point(0), run_bytes);
            } else {
                for (Index k = 0; k < count && rests; ++k) rests = same(copy + 3 * k, point(k), point_bytes);
            }
            if (rests) return true;
        }
        if (run) {
            std::memcpy(copy, point(0), run_bytes);
        } else {
            for (Index k = 0; k < count; ++k) std::memcpy(copy + 3 * k, point(k), point_bytes);
        }
        copied_[b] = 1;
    }
    note_moved(block, now);
    return run ? kernels_.box_of_run(point(0), count, block_[b])
               : kernels_.box_of_some(position, order, count, clusters_.vertices.count - begin, block_[b]);
}

void BlockBoxes::note_moved(Index block, std::int64_t now) {
    block_moved_at_[static_cast<std::size_t>(block)] = now;
    moved_blocks_.push_back(block);
}

/// Updates the regions of the moved blocks: of all, or of moved_blocks_.
bool BlockBoxes::finish(bool finite, bool all, std::int64_t now) {
    moved_regions_.clear();
    last_read_ = now;
    if (!finite) {
        std::fill(first_.begin(), first_.end(), unread);
        std::fill(copied_.begin(), copied_.end(), std::uint8_t{0});
        moved_blocks_.clear();
        return false;
    }
    const auto has_moved = [this, now](Index region) {
        if (std::exchange(region_moved_at_[static_cast<std::size_t>(region)], now) != now) {
            moved_regions_.push_back(region);
        }
    };
    if (all) {
        all_moved_at_ = now;
        for (Index region = 0; region < clusters_.region_count; ++region) has_moved(region);
    } else {
        for (const Index block : moved_blocks_) {
            const Lists<Index>& regions = clusters_.regions_of_block;
            std::for_each(regions.begin(block), regions.end(block), has_moved);
        }
    }
    moved_blocks_.clear();
    for (const Index region : moved_regions_) {
        region_[static_cast<std::size_t>(region)] = around(clusters_.blocks_of_region, region);
    }
    return true;
}

std::int64_t BlockBoxes::group_moved_at(Index group) const {
    std::int64_t latest = all_moved_at_;
    if (latest == last_read_) return latest;
    for (const Index* b = clusters_.blocks_of_group.begin(group); b != clusters_.blocks_of_group.end(group); ++b) {
        latest = std::max(latest, block_moved_at_[static_cast<std::size_t>(*b)]);
    }
    return latest;
}

}  // namespace trocar
