#include "reference/signed_distance.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "reference/closest_points.hpp"

namespace trocar {
namespace {

constexpr Index leaf_size = 4;

}  // namespace

Index SignedDistance::build(const std::vector<Vector3>& centres, Index first, Index count) {
    const auto node = static_cast<Index>(nodes_.size());
    nodes_.emplace_back();
    if (count <= leaf_size) {
        nodes_.back().first = first;
        nodes_.back().count = count;
        return node;
    }
    Box box;
    for (Index i = first; i < first + count; ++i) box.add(centres[at(order_[at(i)] - range_.first)]);
    int axis = 0;
    (box.max - box.min).maxCoeff(&axis);
    const Index half = count / 2;
    const auto begin = order_.begin() + first;
    std::nth_element(begin, begin + half, begin + count, [&](Index i, Index j) {
        const double x_i = centres[at(i - range_.first)][axis];
        const double x_j = centres[at(j - range_.first)][axis];
        return x_i < x_j || (x_i == x_j && i < j);
    });
    build(centres, first, half);
    const Index second = build(centres, first + half, count - half);
    nodes_[at(node)].second = second;
    return node;
}

void SignedDistance::prepare(const Triangles& triangles, Range range, const Matrix3X& position) {
    range_ = range;
    order_.clear();
    nodes_.clear();
    if (range.count == 0) return;
    std::vector<Vector3> centres;
    std::map<std::array<Index, 2>, std::array<Index, 2>> edge_owner;  // directed edge -> triangle, corner
    first_vertex_ = triangles.middleCols(range.first, range.count).minCoeff();
    const Index last_vertex = triangles.middleCols(range.first, range.count).maxCoeff();
    for (Index t = range.first; t < range.end(); ++t) {
        order_.push_back(t);
        centres.emplace_back(
            (position.col(triangles(0, t)) + position.col(triangles(1, t)) + position.col(triangles(2, t))) / 3.0);
        for (int c = 0; c < 3; ++c) edge_owner[{triangles(c, t), triangles((c + 1) % 3, t)}] = {t, c};
    }
    neighbour_.assign(at(range.count), {-1, -1, -1});
    on_rim_.assign(at(last_vertex - first_vertex_ + 1), 0);
    for (Index t = range.first; t < range.end(); ++t) {
        for (int c = 0; c < 3; ++c) {
            const Index a = triangles(c, t);
            const Index b = triangles((c + 1) % 3, t);
            const auto found = edge_owner.find({b, a});
            if (found != edge_owner.end()) {
                neighbour_[at(t - range.first)][static_cast<std::size_t>(c)] = found->second[0];
            } else {
                on_rim_[at(a - first_vertex_)] = 1;
                on_rim_[at(b - first_vertex_)] = 1;
            }
        }
    }
    build(centres, 0, range.count);
    refit(triangles, position);
}

void SignedDistance::refit(const Triangles& triangles, const Matrix3X& position) {
    for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
        node->box = Box{};
        if (node->count == 0) {
            node->box = (node - 1)->box;
            node->box.add(nodes_[at(node->second)].box);
            continue;
        }
        for (Index i = node->first; i < node->first + node->count; ++i) {
            for (int c = 0; c < 3; ++c) node->box.add(position.col(triangles(c, order_[at(i)])));
        }
    }
    face_normal_.resize(3, range_.count);
    vertex_normal_.setZero(3, static_cast<Eigen::Index>(on_rim_.size()));
    for (Index t = range_.first; t < range_.end(); ++t) {
        const auto corner = triangles.col(t);
        const Vector3 normal = (position.col(corner[1]) - position.col(corner[0]))
                                   .cross(position.col(corner[2]) - position.col(corner[0]))
                                   .normalized();
        face_normal_.col(t - range_.first) = normal;
        for (int c = 0; c < 3; ++c) {
            const Vector3 u = position.col(corner[(c + 1) % 3]) - position.col(corner[c]);
            const Vector3 v = position.col(corner[(c + 2) % 3]) - position.col(corner[c]);
            const double angle = std::atan2(u.cross(v).norm(), u.dot(v));
            vertex_normal_.col(corner[c] - first_vertex_) += angle * normal;
        }
    }
}

SurfacePoint SignedDistance::nearest(const Triangles& triangles, const Matrix3X& position, const Vector3& p) const {
    SurfacePoint best;
    double best_square = std::numeric_limits<double>::infinity();
    if (nodes_.empty()) return best;
    std::array<Index, 64> waiting{};
    std::size_t count = 0;
    waiting[count++] = 0;
    while (count > 0) {
        const Index here = waiting[--count];
        const Node& node = nodes_[at(here)];
        if (node.box.squared_distance(p) >= best_square) continue;
        if (node.count > 0) {
            for (Index i = node.first; i < node.first + node.count; ++i) {
                const Index t = order_[at(i)];
                const Vector3 a = position.col(triangles(0, t));
                const Vector3 b = position.col(triangles(1, t));
                const Vector3 c = position.col(triangles(2, t));
                const Vector3 w = closest_weights(p, a, b, c);
                const double square = (p - w[0] * a - w[1] * b - w[2] * c).squaredNorm();
                if (square >= best_square) continue;
                best_square = square;
                best.triangle = t;
                best.weights = w;
            }
            continue;
        }
        const Index left = here + 1;
        const bool left_first =
            nodes_[at(left)].box.squared_distance(p) <= nodes_[at(node.second)].box.squared_distance(p);
        waiting[count++] = left_first ? node.second : left;
        waiting[count++] = left_first ? left : node.second;
    }
    if (best.triangle < 0) return best;
    const auto corner = triangles.col(best.triangle);
    const auto& w = best.weights;
    const Index local = best.triangle - range_.first;
    Vector3 pseudonormal = face_normal_.col(local);
    for (int c = 0; c < 3; ++c) {
        if (w[c] == 1.0) {
            pseudonormal = vertex_normal_.col(corner[c] - first_vertex_);
            best.beyond_rim = on_rim_[at(corner[c] - first_vertex_)] != 0;
        } else if (w[c] == 0.0 && w[(c + 1) % 3] < 1.0 && w[(c + 2) % 3] < 1.0) {
            // On the edge from corner c + 1 to corner c + 2.
            const Index other = neighbour_[at(local)][static_cast<std::size_t>((c + 1) % 3)];
            if (other < 0) {
                best.beyond_rim = true;
            } else {
                pseudonormal += face_normal_.col(other - range_.first);
            }
        }
    }
    const Vector3 foot =
        w[0] * position.col(corner[0]) + w[1] * position.col(corner[1]) + w[2] * position.col(corner[2]);
    const Vector3 off = p - foot;
    const double sign = off.dot(pseudonormal) >= 0.0 ? 1.0 : -1.0;
    const double distance = std::sqrt(best_square);
    best.signed_distance = sign * distance;
    best.normal = distance > 1e-12 ? Vector3(sign / distance * off) : Vector3(pseudonormal.normalized());
    return best;
}

}  // namespace trocar
