// Box tree of triangles, for queries outside of a tick: initialisation of contact generators, and the closest place of
// two bodies. Truth has its own tree (measure/ray_tree.hpp), so that the two share no mistake.
#pragma once

#include <vector>

#include "geometry/exact.hpp"
#include "geometry/types.hpp"

namespace trocar {

class SurfaceTree {
public:
    /// Tree of the `chosen` triangles at `position`. `triangles` and `position` must outlive it. Precondition: finite
    /// corners.
    SurfaceTree(const Triangles& triangles, std::vector<Index> chosen, const Matrix3X& position);

    /// Box of all chosen triangles.
    [[nodiscard]] const Box& box() const { return nodes_.front().box; }
    /// Sum of signed crossings of the segment (segment_crossing of signed_crossing.hpp): +1 for each from front to
    /// back.
    [[nodiscard]] int crossings(const Vector3& from, const Vector3& to) const;
    /// The triangle nearest to x, the lowest number of several; -1 for an empty tree.
    [[nodiscard]] Index nearest(const Vector3& x) const;
    /// Distance (m) of `triangle` to the nearest one of the tree, at most `query_distance` (m). Precondition: it
    /// intersects none.
    [[nodiscard]] double distance_to(const Corners& triangle, double query_distance) const;

private:
    struct Node {
        Box box;
        Index first = 0;  ///< into order_
        Index count = 0;
        Index second = -1;  ///< the second child; the first one follows its parent; -1: a leaf
    };
    void build(Index first, Index count);
    /// Calls act(triangle, corners) for every triangle whose box is within the root of `squared_query_distance` (m²) of
    /// `box`, and for some others, near ones first. `squared_query_distance` is re-read before each call, so that `act`
    /// can lower it.
    template <typename Act>
    void visit(const Box& box, const double& squared_query_distance, const Act& act) const;

    const Triangles& triangles_;
    const Matrix3X& position_;
    std::vector<Index> order_;
    std::vector<Node> nodes_;
};

}  // namespace trocar
