#include "geometry/signed_crossing.hpp"

#include <algorithm>

namespace trocar {
namespace {

/// +1 when x lies inside a positively oriented tetrahedron, -1 inside a negatively oriented one, 0 outside.
int inside_tetrahedron(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d, const Vector3& x) {
    const int whole = orientation_sign(a, b, c, d);
    if (whole == 0) return 0;
    if (orientation_sign(x, b, c, d) != whole || orientation_sign(a, x, c, d) != whole ||
        orientation_sign(a, b, x, d) != whole || orientation_sign(a, b, c, x) != whole) {
        return 0;
    }
    return whole;
}

}  // namespace

int segment_crossing(const Vector3& from, const Vector3& to, const Vector3& a, const Vector3& b, const Vector3& c) {
    const int start = orientation_sign(a, b, c, from);  // -1: in front
    const int end = orientation_sign(a, b, c, to);
    if (start == end) return 0;
    const int s1 = orientation_sign(from, to, a, b);
    const int s2 = orientation_sign(from, to, b, c);
    const int s3 = orientation_sign(from, to, c, a);
    // Not all three are 0: the line meets the plane in one point, which is on at most two of the edges' lines.
    if (s1 != s2 || s2 != s3) return 0;
    return start < end ? 1 : -1;
}

int sweep_crossing(const Vector3& x, const std::array<Index, 3>& number, const Corners& p, const Corners& q) {
    std::array<std::size_t, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return number[i] < number[j]; });
    Corners now = p;
    int sum = 0;
    for (const std::size_t i : order) {
        // The corner moves along now[i] → q[i], so the triangle sweeps this tetrahedron. It is positively oriented, in
        // the sense of orientation_sign, when the corner moves to the back of the triangle.
        const int sign = inside_tetrahedron(now[0], now[1], now[2], q[i], x);
        // Motion to the back (+1): the point was behind and is now in front, which counts -1.
        sum -= sign;
        now[i] = q[i];
    }
    return sum;
}

}  // namespace trocar
