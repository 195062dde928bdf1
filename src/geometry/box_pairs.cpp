#include "geometry/box_pairs.hpp"

#include <algorithm>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

struct Entry {
    double low;
    double high;
    Index index;
    bool operator<(const Entry& other) const { return low < other.low || (low == other.low && index < other.index); }
};

Box union_of(const std::vector<Box>& boxes, Range range) {
    Box all;
    for (Index i = range.first; i < range.end(); ++i) all.add(boxes[at(i)]);
    return all;
}

/// Boxes of `range` that overlap `region`, sorted by their lower end along `axis`. Empty boxes overlap nothing.
void collect(const std::vector<Box>& boxes, Range range, const Box& region, int axis, std::vector<Entry>& entries) {
    entries.clear();
    for (Index i = range.first; i < range.end(); ++i) {
        const Box& box = boxes[static_cast<std::size_t>(i)];
        if (box.overlaps(region)) entries.push_back({box.min[axis], box.max[axis], i});
    }
    std::sort(entries.begin(), entries.end());
}

}  // namespace

void triangle_boxes(const Matrix3X& position, const Triangles& triangles, std::vector<Box>& boxes) {
    boxes.resize(static_cast<std::size_t>(triangles.cols()));
    for (Index t = 0; t < triangles.cols(); ++t) {
        const Corners corners = corners_of(triangles, position, t);
        const bool finite = std::all_of(corners.begin(), corners.end(), [](const Vector3& c) { return c.allFinite(); });
        boxes[at(t)] = finite ? box_of(corners) : Box{};
    }
}

void overlapping_boxes(const std::vector<Box>& boxes, Range first, Range second, std::vector<IndexPair>& pairs) {
    pairs.clear();
    const Box first_union = union_of(boxes, first);
    const Box second_union = union_of(boxes, second);
    if (!first_union.overlaps(second_union)) return;
    const Box common{first_union.min.cwiseMax(second_union.min), first_union.max.cwiseMin(second_union.max)};
    int axis = 0;
    (common.max - common.min).maxCoeff(&axis);

    // Kept between calls, so that a caller inside a tick does not allocate after warm-up.
    thread_local std::vector<Entry> a;
    thread_local std::vector<Entry> b;
    collect(boxes, first, common, axis, a);
    collect(boxes, second, common, axis, b);
    const auto test = [&](Index i, Index j) {
        if (boxes[static_cast<std::size_t>(i)].overlaps(boxes[static_cast<std::size_t>(j)])) pairs.push_back({i, j});
    };
    // The box that begins first along the axis finds the other one.
    for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
        if (a[i].low <= b[j].low) {
            for (std::size_t k = j; k < b.size() && b[k].low <= a[i].high; ++k) test(a[i].index, b[k].index);
            ++i;
        } else {
            for (std::size_t k = i; k < a.size() && a[k].low <= b[j].high; ++k) test(a[k].index, b[j].index);
            ++j;
        }
    }
    std::sort(pairs.begin(), pairs.end());
}

}  // namespace trocar
