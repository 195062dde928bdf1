#include "measure/vertical_crossings.hpp"

#include <cmath>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

int sign_of(double value) { return (value > 0.0) - (value < 0.0); }

/// Exact sign of the turn a → b → p seen from above: +1 left. Filter of Shewchuk 1997, (3 + 16 e) e with e = 2^-53.
int turn(const Vector3& a, const Vector3& b, const Vector3& p) {
    const double left = (a.x() - p.x()) * (b.y() - p.y());
    const double right = (a.y() - p.y()) * (b.x() - p.x());
    const double difference = left - right;
    const double bound = 3.3306690738754716e-16 * (std::abs(left) + std::abs(right));
    if (difference > bound && bound > 1e-280) return 1;
    if (difference < -bound && bound > 1e-280) return -1;
    // The 3-D predicate on the points dropped to z = 0, with the fourth one unit above p, is the same determinant.
    return -orientation_sign({a.x(), a.y(), 0.0}, {b.x(), b.y(), 0.0}, {p.x(), p.y(), 0.0}, {p.x(), p.y(), 1.0});
}

/// turn(p, q, u) with p and q moved by (e², e).
int turn_of_moved_line(const Vector3& p, const Vector3& q, const Vector3& u) {
    if (const int sign = turn(p, q, u); sign != 0) return sign;
    if (const int sign = sign_of(q.x() - p.x()); sign != 0) return -sign;
    return sign_of(q.y() - p.y());
}

}  // namespace

int side_of_line(const Vector3& u, const Vector3& v, const Vector3& p) {
    if (const int sign = turn(u, v, p); sign != 0) return sign;
    if (const int sign = sign_of(v.x() - u.x()); sign != 0) return sign;
    return -sign_of(v.y() - u.y());
}

int upward_crossing(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& p) {
    const int side = side_of_line(a, b, p);
    if (side == 0 || side_of_line(b, c, p) != side || side_of_line(c, a, p) != side) return 0;
    // p strictly below the plane; a p in the plane has been moved up out of it.
    return orientation_sign(a, b, c, p) == side ? side : 0;
}

int passing_to_the_right(const Vector3& u, const Vector3& v, const Vector3& p) {
    // p is moved by more along y than along x: an end at its height is below it.
    const bool rises = v.y() > p.y();
    if (rises == (u.y() > p.y())) return 0;
    const int side = rises ? 1 : -1;
    return side_of_line(u, v, p) == side ? side : 0;
}

int edge_passage(const Vector3& u, const Vector3& v, const Vector3& p, const Vector3& q) {
    const int before = side_of_line(u, v, p);
    const int after = side_of_line(u, v, q);
    if (before == after) return 0;
    if (turn_of_moved_line(p, q, u) == turn_of_moved_line(p, q, v)) return 0;
    return orientation_sign(p, q, u, v) == before ? after : 0;
}

}  // namespace trocar
