#include "measure/surface_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

double squared_distance_to_segment(const Vector3& a, const Vector3& b, const Vector3& p) {
    const Vector3 along = b - a;
    const double length = along.squaredNorm();
    const double t = length > 0.0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0.0;
    return (p - (a + t * along)).squaredNorm();
}

/// The least of the squared distances (m²) taken so far. The search ends once one is within `enough` (m).
class NearestSearch {
public:
    explicit NearestSearch(double enough) : squared_enough_(enough * enough) {}
    /// What the tree prunes by.
    double take(double squared) {
        least_ = std::min(least_, squared);
        return least_ <= squared_enough_ ? 0.0 : least_;  // no box is nearer than 0
    }
    [[nodiscard]] double distance() const { return std::sqrt(least_); }

private:
    double squared_enough_;
    double least_ = std::numeric_limits<double>::infinity();
};

}  // namespace

double squared_distance_to_triangle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& p) {
    const Vector3 normal = (b - a).cross(c - a);
    const double square = normal.squaredNorm();
    // Inside the prism over the face the plane decides, elsewhere the nearest edge.
    if (square > 0.0 && (b - a).cross(p - a).dot(normal) >= 0.0 && (c - b).cross(p - b).dot(normal) >= 0.0 &&
        (a - c).cross(p - c).dot(normal) >= 0.0) {
        const double height = (p - a).dot(normal);
        return height * height / square;
    }
    return std::min({squared_distance_to_segment(a, b, p), squared_distance_to_segment(b, c, p),
                     squared_distance_to_segment(c, a, p)});
}

double SurfaceDistance::distance(const Triangles& triangles, const Matrix3X& position, const Vector3& p,
                                 double enough) const {
    NearestSearch nearest(enough);
    visit_near(p, [&](Index t) {
        const Corners c = corners_of(triangles, position, t);
        return nearest.take(squared_distance_to_triangle(c[0], c[1], c[2], p));
    });
    return nearest.distance();
}

double SurfaceDistance::bound_along(const Triangles& triangles, const Matrix3X& position, const Vector3& p,
                                    const Vector3& q, double enough) const {
    NearestSearch nearest(enough);
    visit_near_both(p, q, [&](Index t) {
        const Corners c = corners_of(triangles, position, t);
        return nearest.take(std::max(squared_distance_to_triangle(c[0], c[1], c[2], p),
                                     squared_distance_to_triangle(c[0], c[1], c[2], q)));
    });
    return nearest.distance();
}

}  // namespace trocar
