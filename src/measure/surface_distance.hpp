// Distance of a point to a triangle surface: exhaustive search, pruned by its own box tree. Truth thus shares no
// acceleration structure with a method.
#pragma once

#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// Squared distance of p to the closed triangle a, b, c; degenerate triangles (segments, points) included; m².
double squared_distance_to_triangle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& p);

class SurfaceDistance {
public:
    /// Builds the tree for the triangles of the range at `position`.
    void prepare(const Triangles& triangles, Range range, const Matrix3X& position);
    /// Adapts the boxes to moved vertices.
    void refit(const Triangles& triangles, const Matrix3X& position);
    /// Distance of p to the surface as last refitted, m; infinite for an empty surface.
    [[nodiscard]] double distance(const Triangles& triangles, const Matrix3X& position, const Vector3& p) const;

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
