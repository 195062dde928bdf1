#include "measure/ray_grid.hpp"

namespace trocar {

void RayGrid::build(const Triangles& triangles, Range range, const Matrix3X& position, const Box& box,
                    const Box& asked) {
    box_ = box;
    asked_ = asked;
    first_ = range.first;
    boxes_.clear();
    boxes_.reserve(static_cast<std::size_t>(range.count));
    for (Index t = range.first; t < range.end(); ++t) {
        const Vector3 a = position.col(triangles(0, t));
        const Vector3 b = position.col(triangles(1, t));
        const Vector3 c = position.col(triangles(2, t));
        boxes_.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
    }
    cells_ = std::clamp<Index>(static_cast<Index>(std::sqrt(static_cast<double>(range.count))), 1, 1024);
    scale_ = Eigen::Vector2d(cells_ / std::max(box.max.x() - box.min.x(), 1e-300),
                             cells_ / std::max(box.max.y() - box.min.y(), 1e-300));
    starts_.assign(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_) + 1, 0);
    for_each_cell([this](std::size_t cell, Index) { ++starts_[cell + 1]; });
    for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
    fill_.assign(starts_.begin(), starts_.end() - 1);
    entries_.resize(static_cast<std::size_t>(starts_.back()));
    for_each_cell(
        [this](std::size_t cell, Index triangle) { entries_[static_cast<std::size_t>(fill_[cell]++)] = triangle; });
}

int RayGrid::crossings(const Triangles& triangles, const Matrix3X& position, const Vector3& p) const {
    const Box point{p, p};
    if (rays_miss(point, box_)) return 0;
    const std::size_t cell = cell_at(index(p.x(), 0), index(p.y(), 1));
    int sum = 0;
    for (Index i = starts_[cell]; i < starts_[cell + 1]; ++i) {
        const Index t = entries_[static_cast<std::size_t>(i)];
        if (rays_miss(point, box_of(t))) continue;
        sum += upward_crossing(position.col(triangles(0, t)), position.col(triangles(1, t)),
                               position.col(triangles(2, t)), p);
    }
    return sum;
}

RayGrid::Stretch RayGrid::within_row(const Vector3& p, const Vector3& way, Index row) const {
    if (way.y() == 0.0) return {};
    const auto share_at = [&](Index border) {
        return (box_.min.y() + static_cast<double>(border) / scale_.y() - p.y()) / way.y();
    };
    const bool rising = way.y() > 0.0;
    const double entry = share_at(rising ? row : row + 1);
    const double exit = share_at(rising ? row + 1 : row);
    const bool enters = rising ? row > 0 : row < cells_ - 1;
    const bool leaves = rising ? row < cells_ - 1 : row > 0;
    return {enters ? std::clamp(entry, 0.0, 1.0) : 0.0, leaves ? std::clamp(exit, 0.0, 1.0) : 1.0};
}

}  // namespace trocar
