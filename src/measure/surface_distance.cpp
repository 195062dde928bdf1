#include "measure/surface_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace trocar {
namespace {

double squared_distance_to_segment(const Vector3& a, const Vector3& b, const Vector3& p) {
    const Vector3 along = b - a;
    const double length = along.squaredNorm();
    const double t = length > 0.0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0.0;
    return (p - (a + t * along)).squaredNorm();
}

constexpr Index leaf_size = 4;

}  // namespace

double squared_distance_to_triangle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& p) {
    const Vector3 normal = (b - a).cross(c - a);
    const double square = normal.squaredNorm();
    // Inside the prism over the face the plane decides, elsewhere the nearest edge.
    if (square > 0.0 && (b - a).cross(p - a).dot(normal) >= 0.0 && (c - b).cross(p - b).dot(normal) >= 0.0 &&
        (a - c).cross(p - c).dot(normal) >= 0.0) {
        const double height = (p - a).dot(normal);
        return height * height / square;
    }
    return std::min({squared_distance_to_segment(a, b, p), squared_distance_to_segment(b, c, p),
                     squared_distance_to_segment(c, a, p)});
}

Index SurfaceDistance::build(const std::vector<Vector3>& centres, Index base, Index first, Index count) {
    const auto node = static_cast<Index>(nodes_.size());
    nodes_.push_back({});
    if (count <= leaf_size) {
        nodes_.back().first = first;
        nodes_.back().count = count;
        return node;
    }
    const auto begin = order_.begin() + first;
    Box box;
    for (auto i = begin; i != begin + count; ++i) box.add(centres[static_cast<std::size_t>(*i - base)]);
    int axis = 0;
    (box.max - box.min).maxCoeff(&axis);
    const Index half = count / 2;
    std::nth_element(begin, begin + half, begin + count, [&](Index i, Index j) {
        const double at_i = centres[static_cast<std::size_t>(i - base)][axis];
        const double at_j = centres[static_cast<std::size_t>(j - base)][axis];
        return at_i < at_j || (at_i == at_j && i < j);
    });
    build(centres, base, first, half);
    const Index second = build(centres, base, first + half, count - half);
    nodes_[static_cast<std::size_t>(node)].second = second;
    return node;
}

void SurfaceDistance::prepare(const Triangles& triangles, Range range, const Matrix3X& position) {
    order_.clear();
    nodes_.clear();
    std::vector<Vector3> centres;
    for (Index t = range.first; t < range.end(); ++t) {
        order_.push_back(t);
        centres.emplace_back(
            (position.col(triangles(0, t)) + position.col(triangles(1, t)) + position.col(triangles(2, t))) / 3.0);
    }
    if (!order_.empty()) build(centres, range.first, 0, range.count);
    refit(triangles, position);
}

void SurfaceDistance::refit(const Triangles& triangles, const Matrix3X& position) {
    for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
        node->box = Box{};
        if (node->count == 0) {
            node->box = (node - 1)->box;
            node->box.add(nodes_[static_cast<std::size_t>(node->second)].box);
            continue;
        }
        for (Index i = node->first; i < node->first + node->count; ++i) {
            const auto corners = triangles.col(order_[static_cast<std::size_t>(i)]);
            for (int corner = 0; corner < 3; ++corner) node->box.add(position.col(corners[corner]));
        }
    }
}

double SurfaceDistance::distance(const Triangles& triangles, const Matrix3X& position, const Vector3& p) const {
    double best = std::numeric_limits<double>::infinity();
    if (nodes_.empty()) return best;
    // A tree over 2^31 triangles is at most 31 deep, and each level leaves at most one sibling waiting.
    std::array<Index, 64> waiting{};
    std::size_t count = 0;
    waiting[count++] = 0;
    while (count > 0) {
        const Index at = waiting[--count];
        const Node& node = nodes_[static_cast<std::size_t>(at)];
        if (node.box.squared_distance(p) >= best) continue;
        if (node.count > 0) {
            for (Index i = node.first; i < node.first + node.count; ++i) {
                const auto corners = triangles.col(order_[static_cast<std::size_t>(i)]);
                best = std::min(best, squared_distance_to_triangle(position.col(corners[0]), position.col(corners[1]),
                                                                   position.col(corners[2]), p));
            }
            continue;
        }
        const Index left = at + 1;
        const Index right = node.second;
        const bool left_first = nodes_[static_cast<std::size_t>(left)].box.squared_distance(p) <=
                                nodes_[static_cast<std::size_t>(right)].box.squared_distance(p);
        waiting[count++] = left_first ? right : left;
        waiting[count++] = left_first ? left : right;
    }
    return std::sqrt(best);
}

}  // namespace trocar
