#include "geometry/exact.hpp"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdlib>
#include <span>
#include <tuple>

#include "geometry/expansion.hpp"

namespace trocar {
namespace {

using expansion::difference;
using expansion::Expansion;

constexpr double unit_roundoff = 0x1p-53;
/// Shewchuk's bounds for one 3×3 and one 2×2 determinant of differences, times the permanent.
constexpr double bound_3d = (7.0 + 56.0 * unit_roundoff) * unit_roundoff;
constexpr double bound_2d = (3.0 + 16.0 * unit_roundoff) * unit_roundoff;
/// Products below the smallest normal number lose up to 2^-1075 each. 2^-1000 times the later factors is far more. It
/// is a normal number, since arithmetic on subnormal ones is many times slower.
constexpr double underflow_unit = 0x1p-1000;

int sign_of(double value) { return (value > 0.0) - (value < 0.0); }

// ---- exact signs -----------------------------------------------------------------------------------------------

/// Expansions are exact while every coordinate is 0 or has a magnitude in [2^-300, 2^300). Products of three
/// differences then stay between 2^-1074 and 2^1023, lowest bits included.
constexpr int safe_exponent = 300;

enum class Range2 { safe, scaled, wide };

/// Scales the coordinates into the safe range by a common power of two, which changes no sign, if one exists.
Range2 make_safe(std::span<double> coordinates) {
    double largest = 0.0;
    double smallest = std::numeric_limits<double>::infinity();
    for (const double x : coordinates) {
        const double magnitude = std::abs(x);
        largest = std::max(largest, magnitude);
        if (magnitude > 0.0) smallest = std::min(smallest, magnitude);
    }
    if (largest == 0.0) return Range2::safe;
    const int top = std::ilogb(largest);
    const int bottom = std::ilogb(smallest);
    if (top < safe_exponent && bottom >= -safe_exponent) return Range2::safe;
    const int shift = safe_exponent - 1 - top;
    if (bottom + shift < -safe_exponent) return Range2::wide;
    for (double& x : coordinates) x = std::scalbn(x, shift);
    return Range2::scaled;
}

using Integer = boost::multiprecision::cpp_int;

/// x·2^1127 as an integer; every finite double is a multiple of 2^-1074.
Integer to_integer(double x) {
    int exponent = 0;
    const auto mantissa = static_cast<std::int64_t>(std::scalbn(std::frexp(x, &exponent), 53));
    return Integer(mantissa) << (exponent - 53 + 1127);
}

/// Sign of det[a-d; b-d; c-d], coordinates in the order a b c d.
int exact_sign_3d(std::array<double, 12> p) {
    if (make_safe(p) == Range2::wide) {
        std::array<Integer, 9> m;
        for (std::size_t i = 0; i < 9; ++i) m[i] = to_integer(p[i]) - to_integer(p[9 + i % 3]);
        const Integer determinant = m[2] * (m[3] * m[7] - m[4] * m[6]) + m[5] * (m[6] * m[1] - m[7] * m[0]) +
                                    m[8] * (m[0] * m[4] - m[1] * m[3]);
        return determinant.sign();
    }
    std::array<Expansion<2>, 9> m;
    for (std::size_t i = 0; i < 9; ++i) m[i] = difference(p[i], p[9 + i % 3]);
    const auto minor = [&m](std::size_t row, std::size_t next) {
        return m[row] * m[next + 1] + -(m[row + 1] * m[next]);
    };
    const auto determinant = (minor(3, 6) * m[2] + minor(6, 0) * m[5]) + minor(0, 3) * m[8];
    return determinant.sign();
}

/// Sign of det[a-c; b-c], coordinates in the order a b c.
int exact_sign_2d(std::array<double, 6> p) {
    if (make_safe(p) == Range2::wide) {
        const Integer ax = to_integer(p[0]) - to_integer(p[4]);
        const Integer ay = to_integer(p[1]) - to_integer(p[5]);
        const Integer bx = to_integer(p[2]) - to_integer(p[4]);
        const Integer by = to_integer(p[3]) - to_integer(p[5]);
        const Integer determinant = ax * by - ay * bx;
        return determinant.sign();
    }
    const auto determinant =
        difference(p[0], p[4]) * difference(p[3], p[5]) + -(difference(p[1], p[5]) * difference(p[2], p[4]));
    return determinant.sign();
}

int exact_orientation(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
    return exact_sign_3d({a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), c.x(), c.y(), c.z(), d.x(), d.y(), d.z()});
}

// ---- filtered signs --------------------------------------------------------------------------------------------

/// A triangle's plane in plain double, and the part of the error bound that is common to all points.
struct FilteredPlane {
    explicit FilteredPlane(const Corners& t) : corners(t) {
        const Vector3 u = t[1] - t[0];
        const Vector3 v = t[2] - t[0];
        normal = u.cross(v);
        const double extent = std::max(largest(u), largest(v));
        // The permanent has six products of at most `extent * extent` · |offset|; 2 % more covers its
        // own rounding.
        permanent_per_offset = 1.02 * 6.0 * (extent * extent);
    }

    static double largest(const Vector3& v) {
        return std::max(std::max(std::abs(v.x()), std::abs(v.y())), std::abs(v.z()));
    }

    /// Exact side: +1 above (seen from there the corners are counter-clockwise), -1 below, 0 in the plane.
    [[nodiscard]] int side(const Vector3& p) const {
        const Vector3 offset = p - corners[0];
        const double determinant = offset.x() * normal.x() + offset.y() * normal.y() + offset.z() * normal.z();
        const double extent = largest(offset);
        // In this order of factors the bound overflows, and so decides nothing, wherever the determinant might
        // overflow.
        const double bound = bound_3d * (permanent_per_offset * extent) + underflow_unit * (1.0 + extent);
        if (determinant > bound) return 1;
        if (determinant < -bound) return -1;
        return -orientation_sign(corners[0], corners[1], corners[2], p);  // a finer bound, then exact
    }

    const Corners& corners;
    Vector3 normal;  ///< not of unit length
    double permanent_per_offset;
};

/// Sign of det[a-c; b-c] without coordinate `axis`, the other two in cyclic order: +1 when a, b, c are
/// counter-clockwise.
int planar_orientation(const Vector3& a, const Vector3& b, const Vector3& c, int axis) {
    const int i = (axis + 1) % 3;
    const int j = (axis + 2) % 3;
    const double left = (a[i] - c[i]) * (b[j] - c[j]);
    const double right = (a[j] - c[j]) * (b[i] - c[i]);
    const double determinant = left - right;
    const double bound = bound_2d * (std::abs(left) + std::abs(right)) + underflow_unit;
    if (determinant > bound) return 1;
    if (determinant < -bound) return -1;
    return exact_sign_2d({a[i], a[j], b[i], b[j], c[i], c[j]});
}

// ---- triangles in general position -----------------------------------------------------------------------------

/// Corner numbers of a triangle that straddles or touches a plane, and the sides of its corners. Both other corners are
/// on the closed side opposite to `apex`, so the plane cuts the edges apex-left and apex-right.
struct Straddle {
    int apex;
    int left;
    int right;
    std::array<int, 3> side;

    [[nodiscard]] bool meets_in_point() const { return side[static_cast<std::size_t>(apex)] == 0; }
    [[nodiscard]] bool has_edge_in_plane() const {
        return side[static_cast<std::size_t>(left)] == 0 && side[static_cast<std::size_t>(right)] == 0;
    }
};

/// Precondition: the sides are neither all positive, all negative nor all 0. `apex_above`: the apex is on the positive
/// side (or in the plane with the others on the negative side).
Straddle straddle(const std::array<int, 3>& side, bool& apex_above) {
    int apex = 0;
    for (int i = 0; i < 3; ++i) {
        const int own = side[static_cast<std::size_t>(i)];
        const int next = side[static_cast<std::size_t>((i + 1) % 3)];
        const int last = side[static_cast<std::size_t>((i + 2) % 3)];
        const bool above = own >= 0 && next <= 0 && last <= 0 && (own > 0 || (next < 0 && last < 0));
        const bool below = own <= 0 && next >= 0 && last >= 0 && (own < 0 || (next > 0 && last > 0));
        if (above || below) {
            apex = i;
            apex_above = above;
            break;
        }
    }
    return {apex, (apex + 1) % 3, (apex + 2) % 3, side};
}

/// Signs that order the ends of the two intervals on the common line of two planes (METHODS §3.3). Both are >= 0 when
/// the intervals meet; one is 0 when they meet in an end.
struct IntervalOrder {
    Straddle first;
    Straddle second;
    int left;   ///< of the ends on the edges apex-left of both
    int right;  ///< of the ends on the edges apex-right of both
};

/// Devillers and Guigue 2002: orient both triangles so that each apex lies above the other's plane. Two orientations,
/// each of one edge of either triangle, then compare the interval ends. Precondition: each straddles the other's plane,
/// and the planes differ.
IntervalOrder order_intervals(const Corners& first, const std::array<int, 3>& first_side, const Corners& second,
                              const std::array<int, 3>& second_side) {
    bool first_above = false;
    bool second_above = false;
    IntervalOrder order{straddle(first_side, first_above), straddle(second_side, second_above), 0, 0};
    // Reversing a triangle's corner order flips its plane.
    if (!first_above) std::swap(order.second.left, order.second.right);
    if (!second_above) std::swap(order.first.left, order.first.right);
    const auto corner = [](const Corners& t, int i) -> const Vector3& { return t[static_cast<std::size_t>(i)]; };
    const Vector3& p1 = corner(first, order.first.apex);
    const Vector3& p2 = corner(second, order.second.apex);
    order.left = orientation_sign(p1, corner(first, order.first.left), p2, corner(second, order.second.left));
    if (order.left < 0) return order;
    order.right = orientation_sign(p1, corner(first, order.first.right), corner(second, order.second.right), p2);
    return order;
}

// ---- coplanar and degenerate -----------------------------------------------------------------------------------

bool collinear(const Vector3& a, const Vector3& b, const Vector3& c) {
    for (int axis = 0; axis < 3; ++axis) {
        if (planar_orientation(a, b, c, axis) != 0) return false;
    }
    return true;
}

/// A coordinate whose removal does not make these three points collinear, or -1 when they are collinear.
int projection_axis(const Vector3& a, const Vector3& b, const Vector3& c) {
    for (int axis = 0; axis < 3; ++axis) {
        if (planar_orientation(a, b, c, axis) != 0) return axis;
    }
    return -1;
}

bool lexicographically_less(const Vector3& a, const Vector3& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

/// End points of a triangle with collinear corners.
struct Segment {
    Vector3 from;
    Vector3 to;
};
Segment extent(const Corners& t) {
    const auto [low, high] = std::minmax_element(t.begin(), t.end(), lexicographically_less);
    return {*low, *high};
}

/// Whether p lies on the closed segment: on the line a, b (in the projection) and in its box.
bool between(const Vector3& p, const Vector3& a, const Vector3& b, int axis) {
    for (const int i : {(axis + 1) % 3, (axis + 2) % 3}) {
        if (p[i] < std::min(a[i], b[i]) || p[i] > std::max(a[i], b[i])) return false;
    }
    return true;
}

bool planar_segments_meet(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d, int axis) {
    const int c_side = planar_orientation(a, b, c, axis);
    const int d_side = planar_orientation(a, b, d, axis);
    const int a_side = planar_orientation(c, d, a, axis);
    const int b_side = planar_orientation(c, d, b, axis);
    if (c_side * d_side < 0 && a_side * b_side < 0) return true;
    return (c_side == 0 && between(c, a, b, axis)) || (d_side == 0 && between(d, a, b, axis)) ||
           (a_side == 0 && between(a, c, d, axis)) || (b_side == 0 && between(b, c, d, axis));
}

bool planar_inside(const Vector3& p, const Corners& t, int axis) {
    const int turn = planar_orientation(t[0], t[1], t[2], axis);
    if (turn == 0) return false;
    for (std::size_t i = 0; i < 3; ++i) {
        if (planar_orientation(t[i], t[(i + 1) % 3], p, axis) == -turn) return false;
    }
    return true;
}

/// For closed coplanar triangles, segments and points; the projection along `axis` must be one to one.
bool planar_triangles_meet(const Corners& first, const Corners& second, int axis) {
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            if (planar_segments_meet(first[i], first[(i + 1) % 3], second[j], second[(j + 1) % 3], axis)) return true;
        }
    }
    return planar_inside(first[0], second, axis) || planar_inside(second[0], first, axis);
}

/// `flat` is a segment or point, `triangle` has area.
bool triangle_meets_flat(const Corners& triangle, const Corners& flat) {
    const FilteredPlane plane(triangle);
    const Segment segment = extent(flat);
    const int from_side = plane.side(segment.from);
    const int to_side = plane.side(segment.to);
    if (from_side * to_side > 0) return false;
    if (from_side == 0 && to_side == 0) {
        return planar_triangles_meet(triangle, flat, projection_axis(triangle[0], triangle[1], triangle[2]));
    }
    bool left = false;
    bool right = false;
    for (std::size_t i = 0; i < 3; ++i) {
        const int turn = orientation_sign(segment.from, segment.to, triangle[i], triangle[(i + 1) % 3]);
        left = left || turn > 0;
        right = right || turn < 0;
    }
    return !(left && right);
}

bool flats_meet(const Corners& first, const Corners& second) {
    const Segment a = extent(first);
    const Segment b = extent(second);
    if (orientation_sign(a.from, a.to, b.from, b.to) != 0) return false;
    for (const auto& [p, q, r] : {std::tie(a.from, a.to, b.from), std::tie(a.from, a.to, b.to),
                                  std::tie(b.from, b.to, a.from), std::tie(b.from, b.to, a.to)}) {
        const int axis = projection_axis(p, q, r);
        if (axis >= 0) return planar_segments_meet(a.from, a.to, b.from, b.to, axis);
    }
    return !lexicographically_less(a.to, b.from) && !lexicographically_less(b.to, a.from);
}

/// For coplanar pairs, and pairs where a triangle has no plane of its own.
bool special_pair_meets(const Corners& first, const Corners& second) {
    const bool first_flat = collinear(first[0], first[1], first[2]);
    const bool second_flat = collinear(second[0], second[1], second[2]);
    if (first_flat && second_flat) return flats_meet(first, second);
    if (first_flat) return triangle_meets_flat(second, first);
    if (second_flat) return triangle_meets_flat(first, second);
    return planar_triangles_meet(first, second, projection_axis(first[0], first[1], first[2]));
}

bool all_equal(const std::array<int, 3>& side) { return side[0] == side[1] && side[1] == side[2]; }

/// Class of two coplanar triangles that share a point.
PairClass planar_class(const Corners& first, const Corners& second) {
    const int axis = projection_axis(first[0], first[1], first[2]);
    for (const auto& [t, other] : {std::tie(first, second), std::tie(second, first)}) {
        const int turn = planar_orientation(t[0], t[1], t[2], axis);
        for (std::size_t i = 0; i < 3; ++i) {
            const Vector3& from = t[i];
            const Vector3& to = t[(i + 1) % 3];
            std::array<const Vector3*, 3> on_line{};
            std::size_t on_line_count = 0;
            bool separates = true;
            for (const Vector3& corner : other) {
                const int side = planar_orientation(from, to, corner, axis) * turn;
                separates = separates && side <= 0;
                if (side == 0) on_line[on_line_count++] = &corner;
            }
            if (!separates) continue;
            if (on_line_count < 2) return PairClass::touch_vertex;
            const auto [low, high] = std::minmax(from, to, lexicographically_less);
            const auto [other_low, other_high] = std::minmax(*on_line[0], *on_line[1], lexicographically_less);
            const bool one_point = high == other_low || other_high == low;
            return one_point ? PairClass::touch_vertex : PairClass::touch_edge;
        }
    }
    return PairClass::coplanar_overlap;
}

}  // namespace

std::string_view name_of(PairClass pair_class) {
    constexpr std::array<std::string_view, 6> names{"disjoint",         "touch-vertex", "touch-edge",
                                                    "coplanar-overlap", "transversal",  "degenerate"};
    return names[static_cast<std::size_t>(pair_class)];
}

int orientation_sign(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
    const Vector3 ad = a - d;
    const Vector3 bd = b - d;
    const Vector3 cd = c - d;
    const double bc_left = bd.x() * cd.y();
    const double bc_right = bd.y() * cd.x();
    const double ca_left = cd.x() * ad.y();
    const double ca_right = cd.y() * ad.x();
    const double ab_left = ad.x() * bd.y();
    const double ab_right = ad.y() * bd.x();
    const double determinant =
        ad.z() * (bc_left - bc_right) + bd.z() * (ca_left - ca_right) + cd.z() * (ab_left - ab_right);
    const double az = std::abs(ad.z());
    const double bz = std::abs(bd.z());
    const double cz = std::abs(cd.z());
    const double bound =
        bound_3d * (az * (std::abs(bc_left) + std::abs(bc_right)) + bz * (std::abs(ca_left) + std::abs(ca_right)) +
                    cz * (std::abs(ab_left) + std::abs(ab_right))) +
        underflow_unit * (1.0 + az + bz + cz);
    if (determinant > bound || determinant < -bound) return sign_of(determinant);
    return exact_orientation(a, b, c, d);  // also when a product overflowed: inf and NaN pass no comparison
}

bool triangles_intersect(const Corners& first, const Corners& second) {
    const FilteredPlane first_plane(first);
    const std::array<int, 3> second_side{first_plane.side(second[0]), first_plane.side(second[1]),
                                         first_plane.side(second[2])};
    if (all_equal(second_side) && second_side[0] != 0) return false;
    const FilteredPlane second_plane(second);
    const std::array<int, 3> first_side{second_plane.side(first[0]), second_plane.side(first[1]),
                                        second_plane.side(first[2])};
    if (all_equal(first_side) && first_side[0] != 0) return false;
    if (all_equal(first_side) || all_equal(second_side)) return special_pair_meets(first, second);
    const IntervalOrder order = order_intervals(first, first_side, second, second_side);
    return order.left >= 0 && order.right >= 0;
}

PairClass classify_pair(const Corners& first, const Corners& second) {
    if (collinear(first[0], first[1], first[2]) || collinear(second[0], second[1], second[2])) {
        return PairClass::degenerate;
    }
    const FilteredPlane first_plane(first);
    const FilteredPlane second_plane(second);
    const std::array<int, 3> second_side{first_plane.side(second[0]), first_plane.side(second[1]),
                                         first_plane.side(second[2])};
    const std::array<int, 3> first_side{second_plane.side(first[0]), second_plane.side(first[1]),
                                        second_plane.side(first[2])};
    if ((all_equal(second_side) && second_side[0] != 0) || (all_equal(first_side) && first_side[0] != 0)) {
        return PairClass::disjoint;
    }
    if (all_equal(first_side)) {
        if (!planar_triangles_meet(first, second, projection_axis(first[0], first[1], first[2]))) {
            return PairClass::disjoint;
        }
        return planar_class(first, second);
    }
    const IntervalOrder order = order_intervals(first, first_side, second, second_side);
    if (order.left < 0 || order.right < 0) return PairClass::disjoint;
    if (order.first.meets_in_point() || order.second.meets_in_point()) return PairClass::touch_vertex;
    if (order.left == 0 || order.right == 0) {
        const auto ends_at_corner = [&order](const Straddle& s) {
            return s.side[static_cast<std::size_t>(order.left == 0 ? s.left : s.right)] == 0;
        };
        return ends_at_corner(order.first) || ends_at_corner(order.second) ? PairClass::touch_vertex
                                                                           : PairClass::touch_edge;
    }
    if (order.first.has_edge_in_plane() || order.second.has_edge_in_plane()) return PairClass::touch_edge;
    return PairClass::transversal;
}

}  // namespace trocar
