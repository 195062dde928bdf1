#include "geometry/pairs_apart.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/box_pairs.hpp"
#include "geometry/exact.hpp"

namespace trocar {
namespace {

/// A node gets an oriented box when its second-longest extent is at most this fraction of its longest.
constexpr double thin_part = 0.125;

bool holds(const std::array<Index, 3>& vertices, Index v) {
    return v >= 0 && std::find(vertices.begin(), vertices.end(), v) != vertices.end();
}

Vector3 unit_or_zero(const Vector3& v) {
    const double length = v.norm();
    return length > 1e-150 && std::isfinite(length) ? Vector3(v / length) : Vector3(Vector3::Zero());
}

/// Three points on one line, exactly: so are their projections to every coordinate plane.
bool on_one_line(const Vector3& a, const Vector3& b, const Vector3& c) {
    for (const Vector3& aside : {Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1)}) {
        Vector3 p = a;
        Vector3 q = b;
        Vector3 r = c;
        for (Vector3* point : {&p, &q, &r}) *point -= aside.cwiseProduct(*point);
        if (orientation_sign(p, q, r, Vector3(p + aside)) != 0) return false;
    }
    return true;
}

}  // namespace

PairsApart::PairsApart(const Matrix3X& vertices, const Triangles& triangles)
    : vertices_(vertices), triangles_(triangles) {
    triangle_boxes(vertices, triangles, boxes_);
    order_.resize(static_cast<std::size_t>(triangles.cols()));
    std::iota(order_.begin(), order_.end(), Index{0});
    if (order_.empty()) return;
    Box whole;
    for (const Box& box : boxes_) whole.add(box);
    middle_ = 0.5 * whole.min + 0.5 * whole.max;
    size_ = (whole.max - whole.min).norm();
    build(0, static_cast<Index>(order_.size()));
}

Vector3 PairsApart::centre(Index triangle) const {
    const Box& box = boxes_[static_cast<std::size_t>(triangle)];
    return 0.5 * box.min + 0.5 * box.max;
}

/// Splits at the median of the boxes' centres along the longest side of their union. Depth is log2 of the count.
Index PairsApart::build(Index begin, Index end) {
    const auto number = static_cast<Index>(nodes_.size());
    nodes_.emplace_back();
    nodes_.back().first = begin;
    nodes_.back().count = end - begin;
    if (end - begin == 1) {
        const Index t = order_[static_cast<std::size_t>(begin)];
        Node& leaf = nodes_.back();
        leaf.box = boxes_[static_cast<std::size_t>(t)];
        leaf.common = {triangles_(0, t), triangles_(1, t), triangles_(2, t)};
        const bool line =
            on_one_line(vertices_.col(leaf.common[0]), vertices_.col(leaf.common[1]), vertices_.col(leaf.common[2]));
        leaf.plane = line ? -1 : t;
        find_slanted(leaf);
        return number;
    }
    Box centres;
    for (Index k = begin; k < end; ++k) centres.add(centre(order_[static_cast<std::size_t>(k)]));
    Eigen::Index axis = 0;
    (centres.max - centres.min).maxCoeff(&axis);
    const Index middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [this, axis](Index s, Index t) { return centre(s)[axis] < centre(t)[axis]; });
    const Index low = build(begin, middle);
    const Index high = build(middle, end);
    Node& made = nodes_[static_cast<std::size_t>(number)];
    made.second = high;
    made.box = node(low).box;
    made.box.add(node(high).box);
    for (std::size_t k = 0; k < 3; ++k) {
        const Index v = node(low).common[k];
        made.common[k] = holds(node(high).common, v) ? v : -1;
    }
    // Three points not on a line define a plane: one triangle represents all of its half.
    if (node(low).plane >= 0 && node(high).plane >= 0 && in_one_plane(node(low).plane, node(high).plane)) {
        made.plane = node(low).plane;
    }
    find_slanted(made);
    return number;
}

bool PairsApart::in_one_plane(Index face, Index other) const {
    for (int corner = 0; corner < 3; ++corner) {
        if (orientation_sign(vertices_.col(triangles_(0, face)), vertices_.col(triangles_(1, face)),
                             vertices_.col(triangles_(2, face)), vertices_.col(triangles_(corner, other))) != 0) {
            return false;
        }
    }
    return true;
}

/// Oriented along the longest side of a triangle.
PairsApart::Slanted PairsApart::box_along(const Node& of, Index t) const {
    Vector3 along = Vector3::Zero();
    for (int corner = 0; corner < 3; ++corner) {
        const Vector3 side = vertices_.col(triangles_((corner + 1) % 3, t)) - vertices_.col(triangles_(corner, t));
        if (side.squaredNorm() > along.squaredNorm()) along = side;
    }
    along = unit_or_zero(along);
    const Vector3 origin = vertices_.col(triangles_(0, t));
    Vector3 out = Vector3::Zero();
    const auto each_corner = [&](const auto& act) {
        for (Index k = of.first; k < of.first + of.count; ++k) {
            const auto corners = triangles_.col(order_[static_cast<std::size_t>(k)]);
            for (int corner = 0; corner < 3; ++corner) act(Vector3(vertices_.col(corners[corner])));
        }
    };
    each_corner([&](const Vector3& p) {
        const Vector3 away = (p - origin) - along.dot(p - origin) * along;
        if (away.squaredNorm() > out.squaredNorm()) out = away;
    });
    Slanted slanted;
    const Vector3 beside = unit_or_zero(out);
    slanted.axes.row(0) = along;
    slanted.axes.row(1) = beside;
    slanted.axes.row(2) = unit_or_zero(along.cross(beside));
    Box places;
    each_corner([&](const Vector3& p) { places.add(Vector3(slanted.axes * (p - middle_))); });
    slanted.half = 0.5 * (places.max - places.min);
    slanted.middle = slanted.axes.transpose() * (0.5 * (places.min + places.max));
    return slanted;
}

void PairsApart::find_slanted(Node& made) {
    const Index t = order_[static_cast<std::size_t>(made.first)];
    const Box& box = boxes_[static_cast<std::size_t>(t)];
    // Cheap exit for most nodes: their first triangle is short relative to the node.
    if ((box.max - box.min).maxCoeff() < 0.25 * (made.box.max - made.box.min).maxCoeff()) return;
    const Slanted slanted = box_along(made, t);
    if (std::max(slanted.half[1], slanted.half[2]) > thin_part * slanted.half[0]) return;
    // Axes that are zero or not orthogonal bound nothing.
    if (!(slanted.axes * slanted.axes.transpose()).isApprox(Matrix3::Identity(), 1e-12)) return;
    made.slanted = static_cast<Index>(slanted_.size());
    slanted_.push_back(slanted);
}

PairsApart::Slanted PairsApart::own_box(const Node& of) const {
    if (of.slanted >= 0) return slanted_[static_cast<std::size_t>(of.slanted)];
    return {Matrix3::Identity(), 0.5 * of.box.min + 0.5 * of.box.max - middle_, 0.5 * (of.box.max - of.box.min)};
}

/// Separation by the face directions of both boxes (Gottschalk, Lin and Manocha 1996 without their edges).
bool PairsApart::apart_along_own_axes(const Node& first, const Node& second) const {
    const Slanted a = own_box(first);
    const Slanted b = own_box(second);
    // Far above the rounding of differences within the mesh.
    const double margin = 1e-12 * size_;
    if (!(margin > 1e-280)) return false;
    for (const Matrix3* axes : {&a.axes, &b.axes}) {
        const Vector3 between = (*axes * (b.middle - a.middle)).cwiseAbs();
        const Vector3 query_distance =
            (*axes * a.axes.transpose()).cwiseAbs() * a.half + (*axes * b.axes.transpose()).cwiseAbs() * b.half;
        if (((between - query_distance).array() > margin).any()) return true;
    }
    return false;
}

bool PairsApart::passed_over(Index a, Index b, bool one_plane_too) const {
    const Node& first = node(a);
    const Node& second = node(b);
    if (!first.box.overlaps(second.box)) return true;
    if (holds(second.common, first.common[0]) || holds(second.common, first.common[1]) ||
        holds(second.common, first.common[2])) {
        return true;
    }
    if (a == b) return !one_plane_too && first.plane >= 0;
    if ((first.slanted >= 0 || second.slanted >= 0) && apart_along_own_axes(first, second)) return true;
    return !one_plane_too && first.plane >= 0 && second.plane >= 0 && in_one_plane(first.plane, second.plane);
}

}  // namespace trocar
