#include "measure/ray_tree.hpp"

#include <cmath>
#include <limits>
#include <tuple>

#include "geometry/exact.hpp"
#include "measure/vertical_crossings.hpp"

namespace trocar {
namespace {

constexpr Index leaf_crossings = 4;
/// Triangles under a node that is worth a rim of its own.
constexpr Index least_for_a_rim = 8;
/// A node whose second-longest extent is at most this part of its longest gets a box along its own axes.
constexpr double thin = 0.125;

Box box_of_triangle(const Triangles& triangles, const Matrix3X& position, Index t) {
    return box_of(corners_of(triangles, position, t));
}

}  // namespace

/// What building needs and nobody after it.
struct RayTree::Build {
    const Triangles& triangles;
    Index base;  ///< first triangle of the range
    std::vector<Vector3> centres;
    bool keeps_rims;

    [[nodiscard]] const Vector3& centre(Index t) const { return centres[at(t - base)]; }

    static bool before(const RimEdge& x, const RimEdge& y) { return std::tie(x.from, x.to) < std::tie(y.from, y.to); }
    /// What is left of both when edges of opposite directions have cancelled.
    static void join(const std::vector<RimEdge>& one, const std::vector<RimEdge>& other, std::vector<RimEdge>& sum) {
        sum.clear();
        for (std::size_t i = 0, j = 0; i < one.size() || j < other.size();) {
            if (j == other.size() || (i < one.size() && before(one[i], other[j]))) {
                sum.push_back(one[i++]);
            } else if (i == one.size() || before(other[j], one[i])) {
                sum.push_back(other[j++]);
            } else {
                const RimEdge net{one[i].from, one[i].to, one[i].count + other[j].count};
                if (net.count != 0) sum.push_back(net);
                ++i;
                ++j;
            }
        }
    }
};

Index RayTree::build(Build& build, Index first, Index count, std::vector<RimEdge>& rim) {
    const auto node = static_cast<Index>(nodes_.size());
    nodes_.emplace_back();
    nodes_.back().first = first;
    nodes_.back().count = count;
    if (count <= leaf_crossings) {
        if (build.keeps_rims) {
            const std::span<const Index> chosen(order_);
            rim = rim_of(sorted_sides(build.triangles, chosen.subspan(at(first), at(count))));
        }
        return node;
    }
    const auto begin = order_.begin() + first;
    Box box;
    for (auto i = begin; i != begin + count; ++i) box.add(build.centre(*i));
    int axis = 0;
    (box.max - box.min).maxCoeff(&axis);
    const Index half = count / 2;
    std::nth_element(begin, begin + half, begin + count, [&](Index i, Index j) {
        const double at_i = build.centre(i)[axis];
        const double at_j = build.centre(j)[axis];
        return at_i < at_j || (at_i == at_j && i < j);
    });
    std::vector<RimEdge> lower;
    std::vector<RimEdge> upper;
    this->build(build, first, half, lower);
    nodes_[at(node)].second = this->build(build, first + half, count - half, upper);
    if (!build.keeps_rims) return node;
    Build::join(lower, upper, rim);
    // On each level of the tree the rims that are kept have at most half as many edges as there are triangles.
    if (count >= least_for_a_rim && rim.size() <= at(count / 2)) {
        nodes_[at(node)].rim_first = static_cast<Index>(rim_edges_.size());
        nodes_[at(node)].rim_count = static_cast<Index>(rim.size());
        rim_edges_.insert(rim_edges_.end(), rim.begin(), rim.end());
    }
    return node;
}

void RayTree::prepare(const Triangles& triangles, Range range, const Matrix3X& position, bool counts_crossings) {
    order_.clear();
    nodes_.clear();
    rim_edges_.clear();
    slanted_.clear();
    Build building{triangles, range.first, {}, counts_crossings};
    order_.reserve(at(range.count));
    building.centres.reserve(at(range.count));
    for (Index t = range.first; t < range.end(); ++t) {
        order_.push_back(t);
        const Box box = box_of_triangle(triangles, position, t);
        building.centres.emplace_back(0.5 * box.min + 0.5 * box.max);
    }
    std::vector<RimEdge> rim;
    if (!order_.empty()) build(building, 0, range.count, rim);
    refit(triangles, position);
    for (Index node = 0; node < static_cast<Index>(nodes_.size()); ++node) find_slanted(triangles, position, node);
}

template <typename Act>
void RayTree::each_corner(const Triangles& triangles, const Node& node, const Act& act) const {
    for (Index i = node.first; i < node.first + node.count; ++i) {
        const auto corners = triangles.col(order_[at(i)]);
        for (int corner = 0; corner < 3; ++corner) act(corners[corner]);
    }
}

/// Along its longest side.
void RayTree::find_slanted(const Triangles& triangles, const Matrix3X& position, Index number) {
    Node& node = nodes_[at(number)];
    const Index t = order_[at(node.first)];
    Slanted slanted;
    slanted.node = number;
    double longest = 0.0;
    for (int corner = 0; corner < 3; ++corner) {
        const Index u = triangles(corner, t);
        const Index v = triangles((corner + 1) % 3, t);
        const double length = (position.col(v) - position.col(u)).norm();
        if (length <= longest) continue;
        longest = length;
        slanted.vertex = {u, v, -1};
    }
    // For most nodes the first triangle decides: it is not long for the node.
    if (longest == 0.0 || longest < 0.25 * (node.box.max - node.box.min).maxCoeff()) return;
    const Vector3 origin = position.col(slanted.vertex[0]);
    const Vector3 along = (position.col(slanted.vertex[1]) - origin) / longest;
    double farthest = -1.0;
    each_corner(triangles, node, [&](Index v) {
        const double away = along.cross(position.col(v) - origin).squaredNorm();
        if (away <= farthest) return;
        farthest = away;
        slanted.vertex[2] = v;
    });
    fit(triangles, position, slanted);
    const Vector3 extent = slanted.high - slanted.low;
    if (std::max(extent[1], extent[2]) > thin * extent[0]) return;
    node.slanted = static_cast<Index>(slanted_.size());
    slanted_.push_back(slanted);
}

void RayTree::fit(const Triangles& triangles, const Matrix3X& position, Slanted& slanted) const {
    const Vector3 origin = position.col(slanted.vertex[0]);
    const auto direction = [](const Vector3& v) {
        const double length = v.norm();
        return length > 1e-150 && std::isfinite(length) ? Vector3(v / length) : Vector3(Vector3::Zero());
    };
    const Vector3 along = direction(position.col(slanted.vertex[1]) - origin);
    const Vector3 out = position.col(slanted.vertex[2]) - origin;
    const Vector3 beside = direction(out - along.dot(out) * along);
    slanted.axes.row(0) = along;
    slanted.axes.row(1) = beside;
    slanted.axes.row(2) = direction(along.cross(beside));
    slanted.low.setConstant(std::numeric_limits<double>::infinity());
    slanted.high.setConstant(-std::numeric_limits<double>::infinity());
    each_corner(triangles, nodes_[at(slanted.node)], [&](Index v) {
        const Vector3 place = slanted.axes * (position.col(v) - middle_);
        slanted.low = slanted.low.cwiseMin(place);
        slanted.high = slanted.high.cwiseMax(place);
    });
}

void RayTree::refit(const Triangles& triangles, const Matrix3X& position) {
    for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
        if (node->second < 0) {
            node->box = Box{};
            each_corner(triangles, *node, [&](Index v) { node->box.add(position.col(v)); });
            continue;
        }
        node->box = (node - 1)->box;
        node->box.add(nodes_[at(node->second)].box);
    }
    box_ = nodes_.empty() ? Box{} : nodes_.front().box;
    middle_ = nodes_.empty() ? Vector3(Vector3::Zero()) : Vector3(0.5 * box_.min + 0.5 * box_.max);
    size_ = nodes_.empty() ? 0.0 : (box_.max - box_.min).norm();
    for (Slanted& slanted : slanted_) fit(triangles, position, slanted);
}

bool RayTree::may_meet(const Segment& path, const Slanted& slanted, double begin, double end) const {
    // Where sizes are so small that a margin is none, nothing is passed over.
    if (!(path.margin > 1e-280)) return true;
    for (int axis = 0; axis < 3; ++axis) {
        const double from = slanted.axes.row(axis).dot(path.from);
        const double along = slanted.axes.row(axis).dot(path.along);
        if (!clip(from, along, slanted.low[axis] - path.margin, slanted.high[axis] + path.margin, begin, end)) {
            return false;
        }
    }
    return true;
}

/// How often the rim goes round p, counter-clockwise seen from above, by the edges that a line from p along +x meets.
int RayTree::turns_of_rim(const Matrix3X& position, const Node& node, const Vector3& p) const {
    int sum = 0;
    for (Index i = node.rim_first; i < node.rim_first + node.rim_count; ++i) {
        const RimEdge& edge = rim_edges_[at(i)];
        sum += edge.count * passing_to_the_right(position.col(edge.from), position.col(edge.to), p);
    }
    return sum;
}

int RayTree::crossings(const Triangles& triangles, const Matrix3X& position, const Vector3& p, RayWork* work) const {
    if (nodes_.empty()) return 0;
    const Box point{p, p};
    const Segment up{p - middle_, Vector3::UnitZ(), std::numeric_limits<double>::infinity(), margin_at(p)};
    int sum = 0;
    Waiting waiting;
    waiting.push(0);
    while (!waiting.empty()) {
        const Index number = waiting.pop();
        const Node& node = nodes_[at(number)];
        if (work != nullptr) ++work->nodes;
        if (rays_miss(point, node.box)) continue;
        if (node.slanted >= 0 && !may_meet(up, slanted_[at(node.slanted)], 0.0, up.end)) continue;
        if (node.rim_first >= 0 && p.z() < node.box.min.z()) {
            if (work != nullptr) work->rim_edges += node.rim_count;
            sum += turns_of_rim(position, node, p);
            continue;
        }
        if (node.second >= 0) {
            waiting.push(node.second);
            waiting.push(number + 1);
            continue;
        }
        if (work != nullptr) work->triangles += node.count;
        for (Index i = node.first; i < node.first + node.count; ++i) {
            const Index t = order_[at(i)];
            if (rays_miss(point, box_of_triangle(triangles, position, t))) continue;
            sum += upward_crossing(position.col(triangles(0, t)), position.col(triangles(1, t)),
                                   position.col(triangles(2, t)), p);
        }
    }
    return sum;
}

}  // namespace trocar
