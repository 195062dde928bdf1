// Signed distance of a point to a triangle surface by the pseudonormal at the closest point (Bærentzen & Aanæs 2005).
// Used by the elastic foundation of the reference.
#pragma once

#include <array>
#include <vector>

#include "geometry/distance_tree.hpp"

namespace trocar {

struct SurfacePoint {
    Index triangle = -1;
    Vector3 weights = Vector3::Zero();                                 ///< barycentric weights of the closest point
    double signed_distance = std::numeric_limits<double>::infinity();  ///< m, positive outside
    Vector3 normal = Vector3::Zero();  ///< unit gradient of the signed distance at the point
    bool beyond_rim = false;           ///< the closest point lies on a rim edge of an open surface
};

class SignedDistance {
public:
    /// Builds the tree and the adjacency of the range's triangles; once.
    void prepare(const Triangles& triangles, Range range, const Matrix3X& position);
    /// Refits boxes and normals to moved vertices.
    void refit(const Triangles& triangles, const Matrix3X& position);
    [[nodiscard]] bool empty() const { return tree_.empty(); }
    [[nodiscard]] Box box() const { return tree_.box(); }
    [[nodiscard]] SurfacePoint nearest(const Triangles& triangles, const Matrix3X& position, const Vector3& p) const;

private:
    Range range_;
    DistanceTree tree_;
    /// per triangle and edge (corner, corner + 1): triangle across it, -1 rim
    std::vector<std::array<Index, 3>> neighbour_;
    Index first_vertex_ = 0;
    Matrix3X face_normal_;    ///< unit
    Matrix3X vertex_normal_;  ///< sum of face normals weighted by corner angle
    std::vector<std::uint8_t> on_rim_;
};

}  // namespace trocar
