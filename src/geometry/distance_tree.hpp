// Box tree over triangles for the nearest ones to a point, for truth and for the reference solver. No method uses it.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

class DistanceTree {
public:
    /// Builds the tree for the triangles of the range at `position`.
    void prepare(const Triangles& triangles, Range range, const Matrix3X& position);
    /// Adapts the boxes to moved vertices.
    void refit(const Triangles& triangles, const Matrix3X& position);
    [[nodiscard]] bool empty() const { return nodes_.empty(); }
    /// Box of all triangles; empty without any.
    [[nodiscard]] Box box() const { return nodes_.empty() ? Box{} : nodes_.front().box; }

    /// Calls act(triangle) for every triangle that may be nearer to p than those before it. `act` returns the squared
    /// distance of the nearest one so far, m².
    template <typename Act>
    void visit_near(const Vector3& p, const Act& act) const {
        if (nodes_.empty()) return;
        double least = std::numeric_limits<double>::infinity();
        // A tree over 2^31 triangles is at most 31 deep, and each level leaves at most one sibling waiting.
        std::array<Index, 64> waiting{};
        std::size_t count = 0;
        waiting[count++] = 0;
        while (count > 0) {
            const Index here = waiting[--count];
            const Node& node = nodes_[at(here)];
            if (node.box.squared_distance(p) >= least) continue;
            for (Index i = node.first; i < node.first + node.count; ++i) least = act(order_[at(i)]);
            if (node.count > 0) continue;
            const Index left = here + 1;
            const bool left_first =
                nodes_[at(left)].box.squared_distance(p) <= nodes_[at(node.second)].box.squared_distance(p);
            waiting[count++] = left_first ? node.second : left;
            waiting[count++] = left_first ? left : node.second;
        }
    }

private:
    struct Node {
        Box box;
        Index first = 0;   ///< into order_, of a leaf
        Index count = 0;   ///< triangles of a leaf; 0 = inner node
        Index second = 0;  ///< right child; the left one follows its parent
    };
    /// centres[t - base] belongs to triangle t.
    Index build(const std::vector<Vector3>& centres, Index base, Index first, Index count);

    std::vector<Index> order_;
    std::vector<Node> nodes_;  ///< parents before their children
};

}  // namespace trocar
