// The triangles of one body in a tree of boxes, so that truth finds those over a point or along a segment without
// examining all of them. Its memory is that of the triangles, however long and thin they are. Shared with no
// method.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// What questions have cost, for tests of how that grows.
struct RayWork {
    std::int64_t nodes = 0;
    std::int64_t triangles = 0;
    std::int64_t rim_edges = 0;
};

class RayTree {
public:
    /// Orders the triangles of the range once, by their places in this frame, and stands at it. What was prepared
    /// before is replaced. Without `counts_crossings` only visit_along may be asked.
    void prepare(const Triangles& triangles, Range range, const Matrix3X& position, bool counts_crossings = true);
    /// Follows moved vertices.
    void refit(const Triangles& triangles, const Matrix3X& position);

    /// Signed crossings of the upward ray from p with the surface. Exact. Of triangles that all lie above p only the
    /// rim of what they make together is examined, where that is shorter: seen from p their signed crossings are the
    /// number of times that the rim goes round (Jacobson, Kavan and Sorkine-Hornung 2013, by their tree).
    [[nodiscard]] int crossings(const Triangles& triangles, const Matrix3X& position, const Vector3& p,
                                RayWork* work = nullptr) const;

    /// Of the triangles.
    [[nodiscard]] const Box& box() const { return box_; }

    /// Calls act(triangle) once for every triangle that the segment from p to q meets or passes within 1e-9 of the
    /// size of the whole, and for some others.
    template <typename Act>
    void visit_along(const Vector3& p, const Vector3& q, const Act& act, RayWork* work = nullptr) const {
        visit(Way::between(p, q, *this), 3, act, work);
    }
    /// The same with everything seen from above.
    template <typename Act>
    void visit_along_from_above(const Vector3& p, const Vector3& q, const Act& act) const {
        visit(Way::between(p, q, *this), 2, act, nullptr);
    }

    /// Numbers that are held, for tests of how memory grows.
    [[nodiscard]] std::size_t node_count() const { return nodes_.size(); }
    [[nodiscard]] std::size_t rim_edge_count() const { return rim_edges_.size(); }

private:
    struct Node {
        Box box;
        Index first = 0;       ///< into order_
        Index count = 0;       ///< triangles of it and of all below
        Index second = -1;     ///< right child; the left one follows its parent; -1: a leaf
        Index rim_first = -1;  ///< into rim_edges_; -1: the rim is not kept
        Index rim_count = 0;
        Index slanted = -1;  ///< into slanted_
    };
    /// A directed edge of the boundary chain of a node's triangles.
    struct NetEdge {
        Index from = -1;
        Index to = -1;
        int count = 0;  ///< net number of times that triangles run along it
    };
    /// A box along its own axes around a node that is long and thin, and so may be much smaller than its box.
    struct Slanted {
        Index node = -1;
        std::array<Index, 3> vertex{-1, -1, -1};  ///< the first two lie along it, the third is farthest from their line
        Matrix3 axes = Matrix3::Zero();           ///< rows; a zero row bounds nothing
        Vector3 low = Vector3::Zero();            ///< from middle_
        Vector3 high = Vector3::Zero();
    };
    /// A straight way from a point on, relative to middle_.
    struct Way {
        Vector3 from;
        Vector3 along;
        double end;     ///< of the parameter that runs from 0
        double margin;  ///< m, far above what rounding may do
        static Way between(const Vector3& p, const Vector3& q, const RayTree& tree) {
            return {p - tree.middle_, q - p, 1.0, tree.margin_at(p) + tree.margin_at(q)};
        }
    };

    [[nodiscard]] double margin_at(const Vector3& p) const { return 2e-9 * size_ + 1e-12 * (p - middle_).norm(); }
    /// The part of the way that is left between two planes; false where none is.
    static bool clip(double from, double along, double low, double high, double& begin, double& end) {
        if (along == 0.0) return low <= from && from <= high;
        const double one = (low - from) / along;
        const double other = (high - from) / along;
        begin = std::max(begin, std::min(one, other));
        end = std::min(end, std::max(one, other));
        return begin <= end;
    }
    [[nodiscard]] bool may_meet(const Way& path, const Slanted& slanted, double begin, double end) const;
    [[nodiscard]] bool may_meet(const Way& path, const Node& node, int axes) const {
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
    void visit(const Way& path, int axes, const Act& act, RayWork* work) const {
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
    /// Nodes still to be examined. A tree over 2^31 triangles is at most 31 deep, and each level leaves at most one
    /// sibling waiting.
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
    Index build(Build& build, Index first, Index count, std::vector<NetEdge>& rim);
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
    std::vector<NetEdge> rim_edges_;
    std::vector<Slanted> slanted_;
};

}  // namespace trocar
