#include "respond/surface_blocks.hpp"

#include <algorithm>

namespace trocar {
namespace {

constexpr Index block_size = 64;  ///< triangles

bool meets(const Box& box, const std::vector<Box>& others) {
    return std::any_of(others.begin(), others.end(), [&](const Box& other) { return box.overlaps(other); });
}

}  // namespace

void SurfaceBlocks::prepare(const Topology& topology, Range triangles) {
    triangles_ = triangles;
    first_.assign(1, 0);
    vertex_.clear();
    std::vector<Index> here;
    for (Index start = triangles.first; start < triangles.end(); start += block_size) {
        here.clear();
        for (Index t = start; t < std::min(start + block_size, triangles.end()); ++t) {
            for (int i = 0; i < 3; ++i) here.push_back(topology.triangles(i, t));
        }
        std::sort(here.begin(), here.end());
        vertex_.insert(vertex_.end(), here.begin(), std::unique(here.begin(), here.end()));
        first_.push_back(static_cast<std::uint32_t>(vertex_.size()));
    }
    box_.assign(first_.size() - 1, Box{});
    stale_.assign(box_.size(), 0);
    first_block_.assign(static_cast<std::size_t>(topology.vertex_count) + 1, 0);
    for (const Index v : vertex_) ++first_block_[static_cast<std::size_t>(v) + 1];
    for (std::size_t v = 1; v < first_block_.size(); ++v) first_block_[v] += first_block_[v - 1];
    block_.resize(vertex_.size());
    std::vector<std::uint32_t> next(first_block_.begin(), first_block_.end() - 1);
    for (std::uint32_t b = 0; b < box_.size(); ++b) {
        for (std::uint32_t e = first_[b]; e < first_[b + 1]; ++e) {
            block_[next[static_cast<std::size_t>(vertex_[e])]++] = b;
        }
    }
}

void SurfaceBlocks::refresh_block(const Matrix3X& position, std::size_t block) {
    Box box;
    for (std::uint32_t e = first_[block]; e < first_[block + 1]; ++e) {
        const auto p = position.col(vertex_[e]);
        // A comparison with NaN is false: the bounds stay those of the numbers.
        for (int axis = 0; axis < 3; ++axis) {
            box.min[axis] = p[axis] < box.min[axis] ? p[axis] : box.min[axis];
            box.max[axis] = p[axis] > box.max[axis] ? p[axis] : box.max[axis];
        }
    }
    box_[block] = box;
}

void SurfaceBlocks::refresh_all(const Matrix3X& position) {
    for (std::size_t b = 0; b < box_.size(); ++b) refresh_block(position, b);
}

void SurfaceBlocks::refresh(const Matrix3X& position, const std::vector<Range>& moved) {
    for (const Range& range : moved) {
        const std::uint32_t end = first_block_[static_cast<std::size_t>(range.end())];
        for (std::uint32_t e = first_block_[static_cast<std::size_t>(range.first)]; e < end; ++e) stale_[block_[e]] = 1;
    }
    for (std::size_t b = 0; b < box_.size(); ++b) {
        if (stale_[b] == 0) continue;
        stale_[b] = 0;
        refresh_block(position, b);
    }
}

void SurfaceBlocks::collect(const Topology& topology, const Matrix3X& position, const std::vector<Box>& boxes,
                            std::vector<Index>& near) const {
    near.clear();
    for (std::size_t b = 0; b < box_.size(); ++b) {
        if (!meets(box_[b], boxes)) continue;
        const Index start = triangles_.first + static_cast<Index>(b) * block_size;
        for (Index t = start; t < std::min(start + block_size, triangles_.end()); ++t) {
            Box box;
            for (int i = 0; i < 3; ++i) box.add(position.col(topology.triangles(i, t)));
            if (meets(box, boxes)) near.push_back(t);
        }
    }
}

}  // namespace trocar
