// Box tree over triangles for those nearest to a point or overlapping a box, for truth and for the reference solver. No
// method uses it.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

class DistanceTree {
public:
    /// Builds the tree for the triangles of the range at `position`.
    void prepare(const Triangles& triangles, Range range, const Matrix3X& position);
    /// Adapts the boxes to moved vertices. With `before`, they hold the triangles at both places.
    void refit(const Triangles& triangles, const Matrix3X& position, const Matrix3X* before = nullptr);
    [[nodiscard]] bool empty() const { return nodes_.empty(); }
    /// Box of all triangles; empty without any.
    [[nodiscard]] Box box() const { return nodes_.empty() ? Box{} : nodes_.front().box; }

    /// Calls act(triangle) for every triangle that may be nearer to p than those before it. `act` returns the squared
    /// distance of the nearest one so far, m².
    template <typename Act>
    void visit_near(const Vector3& p, const Act& act) const {
        visit([&p](const Box& box) { return box.squared_distance(p); }, act);
    }

    /// The same for the distance of a triangle to the farther one of p and q.
    template <typename Act>
    void visit_near_both(const Vector3& p, const Vector3& q, const Act& act) const {
        visit([&p, &q](const Box& box) { return std::max(box.squared_distance(p), box.squared_distance(q)); }, act);
    }

    /// Calls act(triangle) for every triangle whose box overlaps `box`, and for some others.
    template <typename Act>
    void visit_overlapping(const Box& box, const Act& act) const {
        // A box apart is farther than any triangle that act has seen.
        visit([&box](const Box& node) { return node.overlaps(box) ? 0.0 : 1.0; },
              [&act](Index triangle) {
                  act(triangle);
                  return 1.0;
              });
    }

private:
    struct Node {
        Box box;
        Index first = 0;   ///< into order_, of a leaf
        Index count = 0;   ///< triangles of a leaf; 0 = inner node
        Index second = 0;  ///< right child; the left one follows its parent
    };
    /// squared_distance(box): no larger than that of any triangle in it, m².
    template <typename SquaredDistance, typename Act>
    void visit(const SquaredDistance& squared_distance, const Act& act) const {
        if (nodes_.empty()) return;
        double least = std::numeric_limits<double>::infinity();
        struct Waiting {
            Index node = -1;
            double squared_distance = 0.0;
        };
        // A tree over 2^31 triangles is at most 31 deep, and each level leaves at most one sibling waiting.
        std::array<Waiting, 64> waiting{};
        std::size_t count = 0;
        waiting[count++] = {0, 0.0};
        while (count > 0) {
            const Waiting here = waiting[--count];
            if (here.squared_distance >= least) continue;
            const Node& node = nodes_[at(here.node)];
            for (Index i = node.first; i < node.first + node.count; ++i) least = act(order_[at(i)]);
            if (node.count > 0) continue;
            const Waiting left{here.node + 1, squared_distance(nodes_[at(here.node + 1)].box)};
            const Waiting right{node.second, squared_distance(nodes_[at(node.second)].box)};
            const bool left_first = left.squared_distance <= right.squared_distance;
            waiting[count++] = left_first ? right : left;
            waiting[count++] = left_first ? left : right;
        }
    }

    /// centres[t - base] belongs to triangle t.
    Index build(const std::vector<Vector3>& centres, Index base, Index first, Index count);

    std::vector<Index> order_;
    std::vector<Node> nodes_;  ///< parents before their children
};

}  // namespace trocar
