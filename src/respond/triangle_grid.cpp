#include "respond/triangle_grid.hpp"

#include <algorithm>

namespace trocar {
namespace {

Box box_of(const Topology& topology, const Matrix3X& position, Index triangle) {
    Box box;
    for (int i = 0; i < 3; ++i) box.add(position.col(topology.triangles(i, triangle)));
    return box;
}

/// A triangle that has grown over more cells than this is cut short: the work of a tick stays bounded.
constexpr std::int64_t most_cells = 4096;

}  // namespace

/// Brings all arrays to the number of triangles.
void TriangleGrid::resize() {
    boxes_.resize(triangles_.size());
    cells_.resize(triangles_.size());
    seen_.assign(triangles_.size(), 0);
    stamp_ = 0;
    int bits = 4;
    while ((std::size_t{1} << bits) < 2 * triangles_.size() && bits < 24) ++bits;
    shift_ = 64 - bits;
    first_.assign((std::size_t{1} << bits) + 1, 0);
    next_.resize(first_.size());
}

void TriangleGrid::fill(const Topology& topology, const Matrix3X& position, const std::vector<Index>& triangles) {
    triangles_.assign(triangles.begin(), triangles.end());
    resize();
    bounds_ = Box{};
    double edges = 0.0;
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        const Index t = triangles_[i];
        Box& box = boxes_[i];
        box = box_of(topology, position, t);
        if (!box.min.allFinite() || !box.max.allFinite()) {
            box = Box{};
            continue;
        }
        bounds_.add(box.min);
        bounds_.add(box.max);
        edges += (position.col(topology.triangles(1, t)) - position.col(topology.triangles(0, t))).norm();
    }
    if (triangles_.empty() || !(bounds_.min.array() <= bounds_.max.array()).all()) return;
    const double extent = (bounds_.max - bounds_.min).maxCoeff();
    cell_ = std::max({1.5 * edges / static_cast<double>(triangles_.size()), extent * 1e-5, 1e-12});
    const auto each_slot = [&](std::size_t local, const auto& act) {
        const auto& [low, high] = cells_[local];
        std::int64_t visited = 0;
        for (std::int32_t x = low[0]; x <= high[0]; ++x) {
            for (std::int32_t y = low[1]; y <= high[1]; ++y) {
                for (std::int32_t z = low[2]; z <= high[2]; ++z) {
                    if (++visited > most_cells) return;
                    act(slot_of(x, y, z));
                }
            }
        }
    };
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        const bool finite = boxes_[i].min.x() <= boxes_[i].max.x();
        cells_[i] = finite ? Cells{cell_of(boxes_[i].min), cell_of(boxes_[i].max)} : Cells{};
        each_slot(i, [&](std::size_t slot) { ++first_[slot + 1]; });
    }
    for (std::size_t s = 1; s < first_.size(); ++s) first_[s] += first_[s - 1];
    if (entry_.size() < first_.back()) entry_.resize(first_.back());
    std::copy(first_.begin(), first_.end(), next_.begin());
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        each_slot(i, [&](std::size_t slot) { entry_[next_[slot]++] = static_cast<std::uint32_t>(i); });
    }
}

}  // namespace trocar
