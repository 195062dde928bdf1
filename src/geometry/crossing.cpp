#include "geometry/crossing.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trocar {
namespace {

constexpr double plane_tolerance = 1e-12;     ///< m (METHODS §3.3)
constexpr double interval_tolerance = 1e-12;  ///< m; gap up to which two intervals still touch
constexpr double case_tolerance = 1e-9;       ///< m; inclusion of intervals, touch (METHODS §3.1)
constexpr double smallest_altitude = 1e-6;    ///< m (METHODS §3.1)

/// Smallest altitude: twice the area over the longest edge; 0 for a point.
double altitude(const Corners& t, double normal_length) {
    const double longest =
        std::sqrt(std::max({(t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(), (t[0] - t[2]).squaredNorm()}));
    return longest > 0.0 ? normal_length / longest : 0.0;
}

/// Signed distances of `t` from the plane through `origin` with the given normal, m; those within the tolerance are 0.
std::array<double, 3> distances(const Corners& t, const Vector3& origin, const Vector3& normal, double normal_length) {
    std::array<double, 3> result{};
    if (normal_length == 0.0) return result;
    for (std::size_t i = 0; i < 3; ++i) {
        const double d = normal.dot(t[i] - origin) / normal_length;
        result[i] = std::abs(d) <= plane_tolerance ? 0.0 : d;
    }
    return result;
}

bool all_zero(const std::array<double, 3>& d) { return d[0] == 0.0 && d[1] == 0.0 && d[2] == 0.0; }
bool one_side(const std::array<double, 3>& d) {
    return (d[0] > 0.0 && d[1] > 0.0 && d[2] > 0.0) || (d[0] < 0.0 && d[1] < 0.0 && d[2] < 0.0);
}

/// The corner whose two others are on the other closed side of the plane; exists unless one_side or all_zero.
int apex_of(const std::array<double, 3>& d) {
    for (int i = 0; i < 3; ++i) {
        const double own = d[static_cast<std::size_t>(i)];
        const double next = d[static_cast<std::size_t>((i + 1) % 3)];
        const double last = d[static_cast<std::size_t>((i + 2) % 3)];
        if (own > 0.0 && next <= 0.0 && last <= 0.0) return i;
        if (own < 0.0 && next >= 0.0 && last >= 0.0) return i;
        if (own == 0.0 && next * last > 0.0) return i;
    }
    return -1;
}

/// Intersection of a triangle with the other's plane.
struct Interval {
    std::array<double, 2> at{};  ///< m, along the line, ascending
    std::array<CrossingEnd, 2> end{};
};

Interval interval_of(const Corners& t, int triangle, const std::array<double, 3>& d, const Vector3& line) {
    const int apex = apex_of(d);
    Interval interval;
    for (std::size_t k = 0; k < 2; ++k) {
        const auto from = static_cast<std::size_t>(apex);
        const auto to = static_cast<std::size_t>((apex + 1 + static_cast<int>(k)) % 3);
        const double fall = d[from] - d[to];
        const double share = fall == 0.0 ? 0.0 : d[from] / fall;
        CrossingEnd& end = interval.end[k];
        end.triangle = triangle;
        end.edge = k == 0 ? apex : static_cast<int>(to);
        end.point = share == 1.0 ? t[to] : Vector3(t[from] + share * (t[to] - t[from]));
        interval.at[k] = line.dot(end.point);
    }
    if (interval.at[0] > interval.at[1]) {
        std::swap(interval.at[0], interval.at[1]);
        std::swap(interval.end[0], interval.end[1]);
    }
    return interval;
}

/// Twice the signed area of a, b, c in the projection without coordinate `axis`.
double planar_area(const Vector3& a, const Vector3& b, const Vector3& c, int axis) {
    const int i = (axis + 1) % 3;
    const int j = (axis + 2) % 3;
    return (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
}

/// Overlap of two coplanar triangles by separating edges, each line widened by the tolerance.
bool planar_overlap(const Corners& first, const Corners& second, int axis) {
    for (const auto& [t, other] : {std::pair(&first, &second), std::pair(&second, &first)}) {
        const double turn = planar_area((*t)[0], (*t)[1], (*t)[2], axis) < 0.0 ? -1.0 : 1.0;
        for (std::size_t i = 0; i < 3; ++i) {
            const Vector3& from = (*t)[i];
            const Vector3& to = (*t)[(i + 1) % 3];
            const double tolerance = plane_tolerance * (to - from).norm();
            double highest = -std::numeric_limits<double>::infinity();
            for (const Vector3& corner : *other) {
                highest = std::max(highest, turn * planar_area(from, to, corner, axis));
            }
            if (highest < -tolerance) return false;
        }
    }
    return true;
}

Crossing interval_test(const Corners& world_first, const Corners& world_second,
                       std::array<double, 2>& smallest_altitudes);

/// The test where products of lengths overflow: the triangles are scaled down by a power of two, which changes no
/// significant bit. A pair with non-finite coordinates does not meet.
Crossing shrunk_interval_test(const Corners& first, const Corners& second, std::array<double, 2>& smallest_altitudes) {
    double largest = 0.0;
    for (const Corners& t : {first, second}) {
        for (const Vector3& corner : t) largest = std::fmax(largest, corner.cwiseAbs().maxCoeff());
    }
    constexpr int exponent = 230;  // some 1e69: lengths to the fourth power are below the largest double
    const int excess = std::isfinite(largest) && largest > 0.0 ? std::ilogb(largest) - exponent : 0;
    if (excess <= 0) return {};
    const auto shrunk = [excess](const Corners& t) {
        const double factor = std::ldexp(1.0, -excess);
        return Corners{factor * t[0], factor * t[1], factor * t[2]};
    };
    Crossing result = interval_test(shrunk(first), shrunk(second), smallest_altitudes);
    const double back = std::ldexp(1.0, excess);
    for (std::array<double, 3>* depths : {&result.first_depth, &result.second_depth}) {
        for (double& depth : *depths) depth *= back;
    }
    for (std::array<double, 2>* lengths : {&result.first_interval, &result.second_interval, &smallest_altitudes}) {
        for (double& length : *lengths) length *= back;
    }
    result.length *= back;
    for (CrossingEnd& end : result.ends) end.point *= back;
    return result;
}

/// The whole test without the altitude rule; returns the smallest altitude of either triangle for it.
Crossing interval_test(const Corners& world_first, const Corners& world_second,
                       std::array<double, 2>& smallest_altitudes) {
    const Vector3& shift = world_first[0];
    const Corners first{Vector3::Zero(), world_first[1] - shift, world_first[2] - shift};
    const Corners second{world_second[0] - shift, world_second[1] - shift, world_second[2] - shift};
    Crossing result;
    const Vector3 first_area = area_normal(first);
    const Vector3 second_area = area_normal(second);
    const double first_norm = first_area.norm();
    const double second_norm = second_area.norm();
    smallest_altitudes = {altitude(first, first_norm), altitude(second, second_norm)};

    const std::array<double, 3> second_distance = distances(second, first[0], first_area, first_norm);
    const std::array<double, 3> first_distance = distances(first, second[0], second_area, second_norm);
    double size = first_norm + second_norm;
    for (std::size_t i = 0; i < 3; ++i) size += std::abs(first_distance[i]) + std::abs(second_distance[i]);
    constexpr double largest_size = 1e150;  // beyond, and where it is NaN, something has overflowed or soon will
    if (!(size < largest_size)) return shrunk_interval_test(world_first, world_second, smallest_altitudes);
    for (std::size_t i = 0; i < 3; ++i) {
        result.first_depth[i] = -first_distance[i];
        result.second_depth[i] = -second_distance[i];
    }
    if (first_norm > 0.0) result.first_normal = first_area / first_norm;
    if (second_norm > 0.0) result.second_normal = second_area / second_norm;
    if (one_side(second_distance) || one_side(first_distance)) return result;

    const Vector3 line = (first_norm > 0.0 && second_norm > 0.0) ? result.first_normal.cross(result.second_normal)
                                                                 : Vector3(Vector3::Zero());
    const double sine = line.norm();
    if (all_zero(second_distance) || all_zero(first_distance) || sine == 0.0) {
        // A triangle without a plane takes the other's. Two such triangles never meet in this test.
        const Vector3& normal = first_norm >= second_norm ? first_area : second_area;
        int axis = 0;
        if (normal.cwiseAbs().maxCoeff(&axis) == 0.0) return result;
        const bool first_stabs = first_norm == 0.0 && !all_zero(first_distance);
        const bool second_stabs = second_norm == 0.0 && !all_zero(second_distance);
        if (first_stabs || second_stabs) {
            const Interval stab = first_stabs ? interval_of(first, 0, first_distance, line)
                                              : interval_of(second, 1, second_distance, line);
            const Vector3& point = stab.end[0].point;
            if (planar_overlap(first_stabs ? second : first, {point, point, point}, axis)) {
                result.kind = CrossingKind::crossing;
            }
            return result;
        }
        if (planar_overlap(first, second, axis)) result.kind = CrossingKind::coplanar;
        return result;
    }

    Vector3 direction = line / sine;
    Interval first_interval = interval_of(first, 0, first_distance, direction);
    Interval second_interval = interval_of(second, 1, second_distance, direction);
    const double first_middle = first_interval.at[0] + first_interval.at[1];
    const double second_middle = second_interval.at[0] + second_interval.at[1];
    if (!(second_middle > first_middle)) {
        direction = -direction;
        for (Interval* interval : {&first_interval, &second_interval}) {
            interval->at = {-interval->at[1], -interval->at[0]};
            std::swap(interval->end[0], interval->end[1]);
        }
    }
    const auto& [a1, b1] = first_interval.at;
    const auto& [a2, b2] = second_interval.at;
    const double overlap = std::min(b1, b2) - std::max(a1, a2);
    if (overlap < -interval_tolerance) return result;

    result.direction = direction;
    result.length = std::max(overlap, 0.0);
    result.first_interval = first_interval.at;
    result.second_interval = second_interval.at;
    const auto deepest = [](const std::array<double, 3>& depth) { return std::max({depth[0], depth[1], depth[2]}); };
    double depth = 0.0;
    if (a2 >= a1 - case_tolerance && b2 <= b1 + case_tolerance) {
        result.overlap_case = CrossingCase::second_enters_first;
        result.ends = second_interval.end;
        depth = deepest(result.second_depth);
    } else if (a1 >= a2 - case_tolerance && b1 <= b2 + case_tolerance) {
        result.overlap_case = CrossingCase::first_enters_second;
        result.ends = first_interval.end;
        depth = deepest(result.first_depth);
    } else {
        // The direction goes from first's middle to second's: the overlap begins with second and ends with first. Its
        // depth is at most its length.
        result.overlap_case = CrossingCase::edges_cross;
        result.ends = {second_interval.end[0], first_interval.end[1]};
    }
    for (CrossingEnd& end : result.ends) end.point += shift;
    const bool touch = result.length <= case_tolerance && depth <= case_tolerance;
    result.kind = touch ? CrossingKind::touch : CrossingKind::crossing;
    return result;
}

// ---- Möller's routine in float ---------------------------------------------------------------------------------

using FloatVector = Eigen::Vector3f;
using FloatCorners = std::array<FloatVector, 3>;

/// The corner that is alone on its side of the other's plane, in the published order of tests; 3 when all corners lie
/// in that plane.
std::size_t float_lone_corner(const std::array<float, 3>& distance) {
    if (distance[0] * distance[1] > 0.0F) return 2;
    if (distance[0] * distance[2] > 0.0F) return 1;
    if (distance[1] * distance[2] > 0.0F || distance[0] != 0.0F) return 0;
    if (distance[1] != 0.0F) return 1;
    return distance[2] != 0.0F ? 2 : 3;
}

/// The interval of a triangle on the common line of the planes, in the largest coordinate of the line's direction.
/// False: the triangle lies in the other's plane.
bool float_interval(const std::array<float, 3>& coordinate, const std::array<float, 3>& distance,
                    std::array<float, 2>& interval) {
    const std::size_t lone = float_lone_corner(distance);
    if (lone == 3) return false;
    for (std::size_t k = 0; k < 2; ++k) {
        const std::size_t other = (lone + 1 + k) % 3;
        interval[k] = coordinate[lone] +
                      (coordinate[other] - coordinate[lone]) * distance[lone] / (distance[lone] - distance[other]);
    }
    if (interval[0] > interval[1]) std::swap(interval[0], interval[1]);
    return true;
}

/// Closed segments a-b and c-d in the coordinates i, j; parallel ones never meet, as in the published routine.
bool float_edges_meet(const FloatVector& a, const FloatVector& b, const FloatVector& c, const FloatVector& d, int i,
                      int j) {
    const float ax = b[i] - a[i];
    const float ay = b[j] - a[j];
    const float bx = c[i] - d[i];
    const float by = c[j] - d[j];
    const float cx = a[i] - c[i];
    const float cy = a[j] - c[j];
    const float denominator = ay * bx - ax * by;
    const float on_first = by * cx - bx * cy;
    const float on_second = ax * cy - ay * cx;
    const auto within = [denominator](float value) {
        return (denominator > 0.0F && value >= 0.0F && value <= denominator) ||
               (denominator < 0.0F && value <= 0.0F && value >= denominator);
    };
    return within(on_first) && within(on_second);
}

bool float_strictly_inside(const FloatVector& p, const FloatCorners& t, int i, int j) {
    std::array<float, 3> side{};
    for (std::size_t k = 0; k < 3; ++k) {
        const FloatVector& from = t[k];
        const FloatVector& to = t[(k + 1) % 3];
        side[k] = (to[j] - from[j]) * (p[i] - from[i]) - (to[i] - from[i]) * (p[j] - from[j]);
    }
    return side[0] * side[1] > 0.0F && side[0] * side[2] > 0.0F;
}

bool float_coplanar(const FloatVector& normal, const FloatCorners& first, const FloatCorners& second) {
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    const int i = (axis + 1) % 3;
    const int j = (axis + 2) % 3;
    for (std::size_t m = 0; m < 3; ++m) {
        for (std::size_t n = 0; n < 3; ++n) {
            if (float_edges_meet(first[m], first[(m + 1) % 3], second[n], second[(n + 1) % 3], i, j)) return true;
        }
    }
    return float_strictly_inside(first[0], second, i, j) || float_strictly_inside(second[0], first, i, j);
}

}  // namespace

Crossing cross_triangles(const Corners& first, const Corners& second) {
    std::array<double, 2> altitudes{};
    Crossing result = interval_test(first, second, altitudes);
    if (altitudes[0] < smallest_altitude || altitudes[1] < smallest_altitude) {
        result = {};
        result.kind = CrossingKind::degenerate;
    }
    return result;
}

bool interval_intersect(const Corners& first, const Corners& second) {
    std::array<double, 2> altitudes{};
    return interval_test(first, second, altitudes).kind != CrossingKind::none;
}

bool moller_intersect(const Corners& first, const Corners& second) {
    constexpr double millimetres = 1000.0;
    constexpr float epsilon = 1e-6F;  // on an unnormalised distance: a length to the third power
    FloatCorners v;
    FloatCorners u;
    for (std::size_t i = 0; i < 3; ++i) {
        v[i] = (first[i] * millimetres).cast<float>();
        u[i] = (second[i] * millimetres).cast<float>();
    }
    const auto plane_distances = [](const FloatVector& normal, const FloatVector& origin, const FloatCorners& t) {
        const float offset = -normal.dot(origin);
        std::array<float, 3> distance{};
        for (std::size_t i = 0; i < 3; ++i) {
            distance[i] = normal.dot(t[i]) + offset;
            if (std::abs(distance[i]) < epsilon) distance[i] = 0.0F;
        }
        return distance;
    };
    const auto apart = [](const std::array<float, 3>& d) { return d[0] * d[1] > 0.0F && d[0] * d[2] > 0.0F; };

    const FloatVector v_normal = (v[1] - v[0]).cross(v[2] - v[0]);
    const std::array<float, 3> u_distance = plane_distances(v_normal, v[0], u);
    if (apart(u_distance)) return false;
    const FloatVector u_normal = (u[1] - u[0]).cross(u[2] - u[0]);
    const std::array<float, 3> v_distance = plane_distances(u_normal, u[0], v);
    if (apart(v_distance)) return false;

    int axis = 0;
    v_normal.cross(u_normal).cwiseAbs().maxCoeff(&axis);
    std::array<float, 2> v_interval{};
    std::array<float, 2> u_interval{};
    if (!float_interval({v[0][axis], v[1][axis], v[2][axis]}, v_distance, v_interval) ||
        !float_interval({u[0][axis], u[1][axis], u[2][axis]}, u_distance, u_interval)) {
        return float_coplanar(v_normal, v, u);
    }
    return !(v_interval[1] < u_interval[0] || u_interval[1] < v_interval[0]);
}

}  // namespace trocar
