// Exact counting along the upward ray of a point: which triangles it crosses, and what an edge contributes that passes
// over it. The basis of every inside/outside decision of truth.
#pragma once

#include "geometry/types.hpp"

namespace trocar {

inline bool apart_seen_from_above(const Box& a, const Box& b) {
    return a.max.x() < b.min.x() || a.min.x() > b.max.x() || a.max.y() < b.min.y() || a.min.y() > b.max.y();
}

/// No upward ray that starts in `points` meets what is in `surface`.
inline bool rays_miss(const Box& points, const Box& surface) {
    return apart_seen_from_above(points, surface) || points.min.z() > surface.max.z();
}

/// Signed crossing of the ray from p in direction +z with triangle a, b, c: +1 where the triangle is counter-clockwise
/// seen from above, −1 where it is clockwise, 0 where the ray misses it. Exact; p is thought moved by the
/// infinitesimal step (e³, e², e), so that a ray through shared edges and corners still counts each surface once.
int upward_crossing(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& p);

/// How the directed edge u→v, seen from above, passes the line from p along +x: +1 when it goes from the right of that
/// line to its left, −1 the other way, 0 when it does not meet it. Summed over a closed chain this is the number of
/// times that the chain goes round p, and so the sum of upward_crossing over triangles above p that the chain bounds.
/// Exact; same thought step.
int passing_to_the_right(const Vector3& u, const Vector3& v, const Vector3& p);

/// Signed change of the upward ray's crossings that the directed edge u→v makes while the point moves from p to q in a
/// straight line: +1 when the ray passes the edge from its right to its left (seen from above), −1 the other way, 0
/// when it does not meet the edge. Same thought step as upward_crossing.
int edge_passage(const Vector3& u, const Vector3& v, const Vector3& p, const Vector3& q);

}  // namespace trocar
