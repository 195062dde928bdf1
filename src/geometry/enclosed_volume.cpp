#include "geometry/enclosed_volume.hpp"

#include "geometry/triangle_sides.hpp"

namespace trocar {

double enclosed_volume(const Triangles& triangles, const Points& position) {
    if (triangles.cols() == 0) return 0.0;
    // Relative to a point of the surface, so that a distant origin costs no digits.
    const Vector3 origin = position.col(triangles(0, 0));
    double volume = 0.0;
    for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
        const Vector3 a = position.col(triangles(0, t)) - origin;
        const Vector3 b = position.col(triangles(1, t)) - origin;
        const Vector3 c = position.col(triangles(2, t)) - origin;
        volume += a.dot(b.cross(c));
    }
    return volume / 6.0;
}

void add_volume_gradient(const Triangles& triangles, const Points& position, double factor, PointsOut sum) {
    for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
        const Vector3 a = position.col(triangles(0, t));
        const Vector3 b = position.col(triangles(1, t));
        const Vector3 c = position.col(triangles(2, t));
        const Vector3 share = factor / 6.0 * (b - a).cross(c - a);
        for (int corner = 0; corner < 3; ++corner) sum.col(triangles(corner, t)) += share;
    }
}

Index open_edges(const Triangles& triangles) { return static_cast<Index>(rim_of(sorted_sides(triangles)).size()); }

}  // namespace trocar
