// Triangles in a tree of boxes, for questions outside of a tick: what a source asks at the start of a run, and where
// two bodies came nearest. With two organs of seventy thousand triangles each, asking every vertex or triangle of the
// one about every triangle of the other took half a minute. Truth has a tree of its own (measure/ray_tree.hpp), so that
// no mistake is shared.
#pragma once

#include <vector>

#include "geometry/exact.hpp"
#include "geometry/types.hpp"

namespace trocar {

[[nodiscard]] Box box_of(const Corners& corners);
/// m² between two boxes; 0 where they overlap, infinite for an empty one.
[[nodiscard]] double squared_gap(const Box& a, const Box& b);

class SurfaceTree {
public:
    /// Of the chosen triangles where they are in `position`; `triangles` and `position` have to stay. Their corners are
    /// finite.
    SurfaceTree(const Triangles& triangles, std::vector<Index> chosen, const Matrix3X& position);

    /// Of all its triangles.
    [[nodiscard]] const Box& box() const { return nodes_.front().box; }
    /// Sum of signed crossings of the segment (segment_crossing of signed_crossing.hpp): +1 for each from front to
    /// back.
    [[nodiscard]] int crossings(const Vector3& from, const Vector3& to) const;
    /// The triangle nearest to x; of several the one with the least number; -1 where there is none.
    [[nodiscard]] Index nearest(const Vector3& x) const;
    /// Distance (m) of a triangle that meets none of these to the nearest of them; `query_distance` where none is
    /// nearer.
    [[nodiscard]] double distance_to(const Corners& triangle, double query_distance) const;

private:
    struct Node {
        Box box;
        Index first = 0;  ///< into order_
        Index count = 0;
        Index second = -1;  ///< the other child, the first one follows its parent; -1: a leaf
    };
    [[nodiscard]] Corners corners(Index triangle) const;
    void build(Index first, Index count);
    /// act(triangle, corners) for every triangle whose box comes within the root of `squared_query_distance` (m²) of
    /// this box, and for some others, near ones first. `squared_query_distance` is read anew each time.
    template <typename Act>
    void visit(const Box& box, const double& squared_query_distance, const Act& act) const;

    const Triangles& triangles_;
    const Matrix3X& position_;
    std::vector<Index> order_;
    std::vector<Node> nodes_;
};

}  // namespace trocar
