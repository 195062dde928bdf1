// Exact crossings of the upward ray from a point: with triangles, and by edges that pass over the point. Every
// inside/outside decision of truth is based on them.
#pragma once

#include "geometry/types.hpp"

namespace trocar {

inline bool apart_seen_from_above(const Box& a, const Box& b) {
    return a.max.x() < b.min.x() || a.min.x() > b.max.x() || a.max.y() < b.min.y() || a.min.y() > b.max.y();
}

/// True where no upward ray that starts in `points` meets `surface`.
inline bool rays_miss(const Box& points, const Box& surface) {
    return apart_seen_from_above(points, surface) || points.min.z() > surface.max.z();
}

/// Side of the directed edge u→v on which the vertical line through p passes, seen from above. +1: left; −1: right; 0:
/// u and v coincide seen from above. Exact; the same infinitesimal step as upward_crossing. A line through a closed
/// surface therefore leaves it as often as it enters.
int side_of_line(const Vector3& u, const Vector3& v, const Vector3& p);

/// Signed crossing of the ray from p in direction +z with triangle a, b, c. +1: counter-clockwise seen from above; −1:
/// clockwise; 0: the ray misses it. Exact. p is shifted by the infinitesimal step (e³, e², e), so that a ray through
/// shared edges and corners counts each surface once.
int upward_crossing(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& p);

/// Signed passage of the directed edge u→v over the line from p along +x, seen from above. +1: from the right of that
/// line to its left; −1: the reverse; 0: no passage. The sum over a closed chain is its winding number about that
/// point. It equals the sum of upward_crossing over triangles above p that the chain bounds. Exact; the same
/// infinitesimal step.
int passing_to_the_right(const Vector3& u, const Vector3& v, const Vector3& p);

/// Signed change of the upward ray's crossings by the directed edge u→v while the point moves straight from p to q. +1:
/// the ray passes the edge from its right to its left, seen from above; −1: the reverse; 0: no passage. The same
/// infinitesimal step as upward_crossing.
int edge_passage(const Vector3& u, const Vector3& v, const Vector3& p, const Vector3& q);

}  // namespace trocar
