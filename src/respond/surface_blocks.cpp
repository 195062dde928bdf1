#include "respond/surface_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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
    travelled_at_.assign(box_.size(), -std::numeric_limits<double>::infinity());
    travelled_ = 0.0;
}

void SurfaceBlocks::refresh(const Matrix3X& position, std::size_t block) {
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
    travelled_at_[block] = travelled_;
}

void SurfaceBlocks::refresh_all(const Matrix3X& position) {
    for (std::size_t b = 0; b < box_.size(); ++b) refresh(position, b);
}

void SurfaceBlocks::move(double furthest) {
    if (std::isfinite(furthest)) {
        travelled_ += furthest;
    } else {
        std::fill(travelled_at_.begin(), travelled_at_.end(), -std::numeric_limits<double>::infinity());
    }
}

/// False only where no vertex can have come near since the box was renewed.
bool SurfaceBlocks::may_meet(std::size_t block, const std::vector<Box>& boxes) const {
    constexpr double rounding = 1e-9;  // of all moves
    const double way = (travelled_ - travelled_at_[block]) + rounding * travelled_;
    if (!std::isfinite(way)) return true;
    const Vector3 around = Vector3::Constant(way);
    return meets({.min = box_[block].min - around, .max = box_[block].max + around}, boxes);
}

void SurfaceBlocks::collect(const Topology& topology, const Matrix3X& position, const std::vector<Box>& boxes,
                            std::vector<Index>& near) {
    near.clear();
    for (std::size_t b = 0; b < box_.size(); ++b) {
        if (!may_meet(b, boxes)) continue;
        if (travelled_at_[b] != travelled_) refresh(position, b);
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
