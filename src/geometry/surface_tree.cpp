#include "geometry/surface_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry/signed_crossing.hpp"
#include "geometry/triangle_distance.hpp"

namespace trocar {
namespace {

constexpr Index leaf_size = 8;

}  // namespace

SurfaceTree::SurfaceTree(const Triangles& triangles, std::vector<Index> chosen, const Matrix3X& position)
    : triangles_(triangles), position_(position), order_(std::move(chosen)) {
    build(0, static_cast<Index>(order_.size()));
}

void SurfaceTree::build(Index first, Index count) {
    const auto sum_of_corners = [this](Index triangle) {
        const Corners c = corners_of(triangles_, position_, triangle);
        return Vector3(c[0] + c[1] + c[2]);
    };
    Box box;
    Box middles;
    for (Index i = first; i < first + count; ++i) {
        box.add(box_of(corners_of(triangles_, position_, order_[at(i)])));
        middles.add(sum_of_corners(order_[at(i)]));
    }
    const std::size_t number = nodes_.size();
    nodes_.push_back({.box = box, .first = first, .count = count});
    if (count <= leaf_size) return;
    Eigen::Index axis = 0;
    (middles.max - middles.min).maxCoeff(&axis);
    const auto begin = order_.begin() + first;
    const Index half = count / 2;
    std::nth_element(begin, begin + half, begin + count, [&](Index s, Index t) {
        const double at_s = sum_of_corners(s)[axis];
        const double at_t = sum_of_corners(t)[axis];
        return at_s != at_t ? at_s < at_t : s < t;
    });
    build(first, half);
    nodes_[number].second = static_cast<Index>(nodes_.size());
    build(first + half, count - half);
}

template <typename Act>
void SurfaceTree::visit(const Box& box, const double& squared_query_distance, const Act& act) const {
    struct Open {
        Index node;
        double squared_gap;
    };
    std::vector<Open> open{{0, nodes_.front().box.squared_distance(box)}};
    while (!open.empty()) {
        const auto [number, gap] = open.back();
        open.pop_back();
        // By rounding, a triangle can be slightly nearer than its box.
        if (gap > squared_query_distance * (1.0 + 1e-12)) continue;
        const Node& node = nodes_[at(number)];
        if (node.second >= 0) {
            Open near{number + 1, nodes_[at(number + 1)].box.squared_distance(box)};
            Open far{node.second, nodes_[at(node.second)].box.squared_distance(box)};
            if (far.squared_gap < near.squared_gap) std::swap(near, far);
            open.push_back(far);
            open.push_back(near);
            continue;
        }
        for (Index i = node.first; i < node.first + node.count; ++i) {
            const Corners c = corners_of(triangles_, position_, order_[at(i)]);
            if (box_of(c).squared_distance(box) <= squared_query_distance * (1.0 + 1e-12)) act(order_[at(i)], c);
        }
    }
}

int SurfaceTree::crossings(const Vector3& from, const Vector3& to) const {
    int sum = 0;
    visit(box_of(from, to), 0.0, [&](Index, const Corners& c) { sum += segment_crossing(from, to, c[0], c[1], c[2]); });
    return sum;
}

Index SurfaceTree::nearest(const Vector3& x) const {
    Index best = -1;
    double least = std::numeric_limits<double>::infinity();
    visit(box_of(x, x), least, [&](Index triangle, const Corners& c) {
        const double distance = (point_at(c, closest_point_on_triangle(c, x)) - x).squaredNorm();
        if (distance < least || (distance == least && triangle < best)) {
            least = distance;
            best = triangle;
        }
    });
    return best;
}

double SurfaceTree::distance_to(const Corners& triangle, double query_distance) const {
    double least = query_distance * query_distance;
    visit(box_of(triangle), least,
          [&](Index, const Corners& c) { least = std::min(least, triangle_distance(triangle, c).squared_distance); });
    return least < query_distance * query_distance ? std::sqrt(least) : query_distance;
}

}  // namespace trocar
