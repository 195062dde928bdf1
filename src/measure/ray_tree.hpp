// Bounding-box tree over the triangles of one body, for truth: finds those above a point or along a segment. Its memory
// is proportional to their number, however long and thin they are. No method uses it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "geometry/triangle_sides.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// Cost of queries, for tests of its growth.
struct RayWork {
    std::int64_t nodes = 0;
    std::int64_t triangles = 0;
    std::int64_t rim_edges = 0;
};

class RayTree {
public:
    /// Builds the tree for the triangles of the range at `position`, in place of an earlier one. Without
    /// `counts_crossings` only visit_along may be called.
    void prepare(const Triangles& triangles, Range range, const Matrix3X& position, bool counts_crossings = true);
    /// Adapts the boxes to moved vertices.
    void refit(const Triangles& triangles, const Matrix3X& position);

    /// Signed crossings of the upward ray from p with the surface. Exact. A subtree that lies entirely above p is
    /// evaluated by its rim, where that is shorter. The winding number of the rim seen from p is the subtree's number
    /// of signed crossings (Jacobson, Kavan and Sorkine-Hornung 2013, by their tree).
    [[nodiscard]] int crossings(const Triangles& triangles, const Matrix3X& position, const Vector3& p,
                                RayWork* work = nullptr) const;

    [[nodiscard]] const Box& box() const { return box_; }

    /// Calls act(triangle) once for every triangle that the segment from p to q meets or passes within 1e-9 of the
    /// overall size. Some other triangles are visited too.
    template <typename Act>
    void visit_along(const Vector3& p, const Vector3& q, const Act& act, RayWork* work = nullptr) const {
        visit(Segment::between(p, q, *this), 3, act, work);
    }
    /// The same in the projection onto the xy plane.
    template <typename Act>
    void visit_along_from_above(const Vector3& p, const Vector3& q, const Act& act) const {
        visit(Segment::between(p, q, *this), 2, act, nullptr);
    }

    /// Stored elements, for tests of the growth of memory.
    [[nodiscard]] std::size_t node_count() const { return nodes_.size(); }
    [[nodiscard]] std::size_t rim_edge_count() const { return rim_edges_.size(); }

private:
    struct Node {
        Box box;
        Index first = 0;       ///< into order_
        Index count = 0;       ///< triangles of the subtree
        Index second = -1;     ///< right child; the left one follows its parent; -1: a leaf
        Index rim_first = -1;  ///< into rim_edges_; -1: the rim is not kept
        Index rim_count = 0;
        Index slanted = -1;  ///< into slanted_
    };
    /// Oriented bounding box of a long thin node, which may be much smaller than its axis-aligned box.
    struct Slanted {
        Index node = -1;
        std::array<Index, 3> vertex{-1, -1, -1};  ///< the first two lie along it, the third is farthest from their line
        Matrix3 axes = Matrix3::Zero();           ///< unit rows; a zero row is unbounded
        Vector3 low = Vector3::Zero();            ///< relative to middle_
        Vector3 high = Vector3::Zero();
    };
    /// Straight segment from a point, relative to middle_.
    struct Segment {
        Vector3 from;
        Vector3 along;
        double end;     ///< of the parameter, which starts at 0
        double margin;  ///< m, far above rounding
        static Segment between(const Vector3& p, const Vector3& q, const RayTree& tree) {
            return {p - tree.middle_, q - p, 1.0, tree.margin_at(p) + tree.margin_at(q)};
        }
    };

    [[nodiscard]] double margin_at(const Vector3& p) const { return 2e-9 * size_ + 1e-12 * (p - middle_).norm(); }
    /// Clips the segment to the slab between two planes; false where nothing is left.
    static bool clip(double from, double along, double low, double high, double& begin, double& end) {
        if (along == 0.0) return low <= from && from <= high;
        const double one = (low - from) / along;
        const double other = (high - from) / along;
        begin = std::max(begin, std::min(one, other));
        end = std::min(end, std::max(one, other));
        return begin <= end;
    }
    [[nodiscard]] bool may_meet(const Segment& path, const Slanted& slanted, double begin, double end) const;
    [[nodiscard]] bool may_meet(const Segment& path, const Node& node, int axes) const {
        double begin = 0.0;
        double end = path.end;
        for (int axis = 0; axis < axes; ++axis) {
            const double low = node.box.min[axis] - middle_[axis] - path.margin;
            const double high = node.box.max[axis] - middle_[axis] + path.margin;
            if (!clip(path.from[axis], path.along[axis], low, high, begin, end)) return false;
        }
        return axes < 3 || node.slanted < 0 ||
               may_meet(path, slanted_[static_cast<std::size_t>(node.slanted)], begin, end);
    }
    template <typename Act>
    void visit(const Segment& path, int axes, const Act& act, RayWork* work) const {
        if (nodes_.empty()) return;
        Waiting waiting;
        waiting.push(0);
        while (!waiting.empty()) {
            const Index at = waiting.pop();
            const Node& node = nodes_[static_cast<std::size_t>(at)];
            if (work != nullptr) ++work->nodes;
            if (!may_meet(path, node, axes)) continue;
            if (node.second >= 0) {
                waiting.push(node.second);
                waiting.push(at + 1);
                continue;
            }
            if (work != nullptr) work->triangles += node.count;
            for (Index i = node.first; i < node.first + node.count; ++i) act(order_[static_cast<std::size_t>(i)]);
        }
    }
    /// Stack of nodes to visit. A tree over 2^31 triangles is at most 31 deep, and each level leaves at most one
    /// sibling on it.
    class Waiting {
    public:
        [[nodiscard]] bool empty() const { return count_ == 0; }
        void push(Index node) { nodes_[count_++] = node; }
        Index pop() { return nodes_[--count_]; }

    private:
        std::array<Index, 64> nodes_;  // NOLINT(cppcoreguidelines-pro-type-member-init): read up to count_ only
        std::size_t count_ = 0;
    };

    struct Build;
    Index build(Build& build, Index first, Index count, std::vector<RimEdge>& rim);
    void find_slanted(const Triangles& triangles, const Matrix3X& position, Index node);
    void fit(const Triangles& triangles, const Matrix3X& position, Slanted& slanted) const;
    template <typename Act>
    void each_corner(const Triangles& triangles, const Node& node, const Act& act) const;
    [[nodiscard]] int turns_of_rim(const Matrix3X& position, const Node& node, const Vector3& p) const;

    Box box_;
    Vector3 middle_ = Vector3::Zero();
    double size_ = 0.0;  ///< m, across the box
    std::vector<Index> order_;
    std::vector<Node> nodes_;  ///< parents before their children
    std::vector<RimEdge> rim_edges_;
    std::vector<Slanted> slanted_;
};

}  // namespace trocar
