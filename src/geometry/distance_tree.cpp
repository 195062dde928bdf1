#include "geometry/distance_tree.hpp"

#include <algorithm>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

constexpr Index triangles_of_a_leaf = 4;

}  // namespace

Index DistanceTree::build(const std::vector<Vector3>& centres, Index base, Index first, Index count) {
    const auto node = static_cast<Index>(nodes_.size());
    nodes_.emplace_back();
    if (count <= triangles_of_a_leaf) {
        nodes_.back().first = first;
        nodes_.back().count = count;
        return node;
    }
    const auto begin = order_.begin() + first;
    Box box;
    for (auto i = begin; i != begin + count; ++i) box.add(centres[at(*i - base)]);
    int axis = 0;
    (box.max - box.min).maxCoeff(&axis);
    const Index half = count / 2;
    std::nth_element(begin, begin + half, begin + count, [&](Index i, Index j) {
        const double at_i = centres[at(i - base)][axis];
        const double at_j = centres[at(j - base)][axis];
        return at_i < at_j || (at_i == at_j && i < j);
    });
    build(centres, base, first, half);
    const Index second = build(centres, base, first + half, count - half);
    nodes_[at(node)].second = second;
    return node;
}

void DistanceTree::prepare(const Triangles& triangles, Range range, const Matrix3X& position) {
    order_.clear();
    nodes_.clear();
    std::vector<Vector3> centres;
    centres.reserve(at(range.count));
    for (Index t = range.first; t < range.end(); ++t) {
        order_.push_back(t);
        const Corners c = corners_of(triangles, position, t);
        centres.emplace_back((c[0] + c[1] + c[2]) / 3.0);
    }
    if (!order_.empty()) build(centres, range.first, 0, range.count);
    refit(triangles, position);
}

void DistanceTree::refit(const Triangles& triangles, const Matrix3X& position, const Matrix3X* before) {
    for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
        node->box = Box{};
        if (node->count == 0) {
            node->box = (node - 1)->box;
            node->box.add(nodes_[at(node->second)].box);
            continue;
        }
        for (Index i = node->first; i < node->first + node->count; ++i) {
            node->box.add(box_of(corners_of(triangles, position, order_[at(i)])));
            if (before != nullptr) node->box.add(box_of(corners_of(triangles, *before, order_[at(i)])));
        }
    }
}

}  // namespace trocar
