// Truth about triangle pairs; shares no code with exact.cpp on purpose. It constructs the common point set in rational
// numbers (big integers over a common denominator) and classifies it. Only pairs that a crude floating-point bound
// decides with a wide margin skip the construction.
#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <optional>
#include <vector>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

using Big = boost::multiprecision::cpp_int;
using BigVector = std::array<Big, 3>;

BigVector operator-(const BigVector& a, const BigVector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Big dot(const BigVector& a, const BigVector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
BigVector cross(const BigVector& a, const BigVector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
bool is_zero(const BigVector& a) { return a[0] == 0 && a[1] == 0 && a[2] == 0; }

struct BigTriangle {
    std::array<BigVector, 3> corner;
    BigVector normal;
};

/// Both triangles on one integer grid: scaled by the power of two that makes every coordinate integer.
std::array<BigTriangle, 2> on_grid(const Corners& first, const Corners& second) {
    int lowest = std::numeric_limits<int>::max();
    for (const Corners* t : {&first, &second}) {
        for (const Vector3& p : *t) {
            for (int i = 0; i < 3; ++i) {
                if (p[i] != 0.0) lowest = std::min(lowest, std::ilogb(p[i]) - 52);
            }
        }
    }
    std::array<BigTriangle, 2> result;
    for (std::size_t k = 0; k < 2; ++k) {
        for (std::size_t c = 0; c < 3; ++c) {
            for (int i = 0; i < 3; ++i) {
                const double x = (k == 0 ? first : second)[c][i];
                if (x == 0.0) continue;
                const int unit = std::ilogb(x) - 52;
                Big whole = static_cast<std::int64_t>(std::scalbn(x, -unit));
                whole <<= static_cast<unsigned>(unit - lowest);
                result[k].corner[c][static_cast<std::size_t>(i)] = std::move(whole);
            }
        }
        const auto& corner = result[k].corner;
        result[k].normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
    }
    return result;
}

/// numerator / denominator, denominator > 0.
struct Point {
    BigVector numerator;
    Big denominator = 1;
};
bool same_place(const Point& a, const Point& b) {
    for (std::size_t i = 0; i < 3; ++i) {
        if (a.numerator[i] * b.denominator != b.numerator[i] * a.denominator) return false;
    }
    return true;
}

/// Half space normal·x <= offset, or the plane itself.
struct Bound {
    BigVector normal;
    Big offset;
    bool plane = false;
};
/// normal·x - offset, times the positive denominator.
Big excess(const Bound& bound, const Point& p) { return dot(bound.normal, p.numerator) - bound.offset * p.denominator; }

/// Convex hull of `points` (in ring order) cut with the bound; Sutherland and Hodgman 1974.
std::vector<Point> cut(const std::vector<Point>& points, const Bound& bound) {
    std::vector<Point> kept;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Point& here = points[i];
        const Point& next = points[(i + 1) % points.size()];
        const Big a = excess(bound, here);
        const Big b = excess(bound, next);
        if (a == 0 || (a < 0 && !bound.plane)) kept.push_back(here);
        if ((a < 0 && b > 0) || (a > 0 && b < 0)) {
            // a and b include their points' denominators, so they are weights of the numerators.
            Point crossing;
            crossing.denominator = a * next.denominator - b * here.denominator;
            for (std::size_t k = 0; k < 3; ++k) crossing.numerator[k] = a * next.numerator[k] - b * here.numerator[k];
            if (crossing.denominator < 0) {
                crossing.denominator = -crossing.denominator;
                for (Big& x : crossing.numerator) x = -x;
            }
            kept.push_back(std::move(crossing));
        }
    }
    return kept;
}

std::vector<Point> ring(const BigTriangle& t) { return {{t.corner[0], 1}, {t.corner[1], 1}, {t.corner[2], 1}}; }

/// Common points of `cutter` (with area) and any other triangle: corners of a convex set, possibly repeated.
std::vector<Point> common_points(const BigTriangle& cutter, const BigTriangle& other) {
    std::vector<Point> points = cut(ring(other), {cutter.normal, dot(cutter.normal, cutter.corner[0]), true});
    for (std::size_t i = 0; i < 3; ++i) {
        const BigVector& from = cutter.corner[i];
        const BigVector outward = cross(cutter.corner[(i + 1) % 3] - from, cutter.normal);
        points = cut(points, {outward, dot(outward, from), false});
    }
    return points;
}

/// The longest side; it contains a triangle without area.
std::array<BigVector, 2> longest_side(const BigTriangle& t) {
    std::size_t best = 0;
    Big best_length = -1;
    for (std::size_t i = 0; i < 3; ++i) {
        const BigVector d = t.corner[(i + 1) % 3] - t.corner[i];
        Big length = dot(d, d);
        if (length > best_length) {
            best = i;
            best_length = std::move(length);
        }
    }
    return {t.corner[best], t.corner[(best + 1) % 3]};
}

bool point_on_segment(const BigVector& p, const std::array<BigVector, 2>& s) {
    return is_zero(cross(s[1] - s[0], p - s[0])) && dot(s[0] - p, s[1] - p) <= 0;
}

bool segments_meet(const std::array<BigVector, 2>& s, const std::array<BigVector, 2>& t) {
    if (point_on_segment(s[0], t) || point_on_segment(s[1], t) || point_on_segment(t[0], s) ||
        point_on_segment(t[1], s)) {
        return true;
    }
    const BigVector u = s[1] - s[0];
    const BigVector v = t[1] - t[0];
    const BigVector gap = t[0] - s[0];
    const BigVector normal = cross(u, v);
    if (is_zero(normal) || dot(gap, normal) != 0) return false;
    // s0 + a u = t0 + b v with a = (gap × v)·n / n·n, b = (gap × u)·n / n·n.
    const Big scale = dot(normal, normal);
    const Big a = dot(cross(gap, v), normal);
    const Big b = dot(cross(gap, u), normal);
    return a >= 0 && a <= scale && b >= 0 && b <= scale;
}

bool on_edge(const Point& p, const BigTriangle& t, std::size_t edge) {
    const Big& w = p.denominator;
    const BigVector& from = t.corner[edge];
    const BigVector& to = t.corner[(edge + 1) % 3];
    const auto minus = [&](const BigVector& corner) {
        return BigVector{p.numerator[0] - corner[0] * w, p.numerator[1] - corner[1] * w,
                         p.numerator[2] - corner[2] * w};
    };
    return is_zero(cross(to - from, minus(from)));
}

PairClass class_of(const std::vector<Point>& points, const BigTriangle& first, const BigTriangle& second) {
    if (points.empty()) return PairClass::disjoint;
    std::vector<Point> distinct;
    for (const Point& p : points) {
        if (std::none_of(distinct.begin(), distinct.end(), [&p](const Point& q) { return same_place(p, q); })) {
            distinct.push_back(p);
        }
    }
    if (distinct.size() == 1) {
        for (const BigTriangle* t : {&first, &second}) {
            for (const BigVector& corner : t->corner) {
                if (same_place(distinct[0], {corner, 1})) return PairClass::touch_vertex;
            }
        }
        return PairClass::touch_edge;
    }
    for (const BigTriangle* t : {&first, &second}) {
        for (std::size_t edge = 0; edge < 3; ++edge) {
            if (std::all_of(distinct.begin(), distinct.end(), [&](const Point& p) { return on_edge(p, *t, edge); })) {
                return PairClass::touch_edge;
            }
        }
    }
    return is_zero(cross(first.normal, second.normal)) ? PairClass::coplanar_overlap : PairClass::transversal;
}

// ---- floating-point bound, generous by three orders of magnitude ------------------------------------------------

double determinant(const Vector3& a, const Vector3& b, const Vector3& c) { return a.dot(b.cross(c)); }

/// PairClass::disjoint or transversal where double arithmetic is certain, else empty. A determinant of three corner
/// differences, each at most `extent` in every coordinate, has 6 terms of at most `extent`³. Its error
/// is below 1e-14·`extent`³; the test requires ten times that.
std::optional<PairClass> obvious_class(const Corners& first, const Corners& second) {
    Box box = box_of(first);
    box.add(box_of(second));
    const double extent = (box.max - box.min).maxCoeff();
    if (!(extent > 1e-90 && extent < 1e90)) return std::nullopt;
    const double doubt = 1e-13 * extent * extent * extent;
    const std::array<const Corners*, 2> triangle{&first, &second};
    for (std::size_t k = 0; k < 2; ++k) {
        // A normal component is certainly not zero: the triangle has an area.
        const Corners& t = *triangle[k];
        if ((t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs().maxCoeff() <= 1e-13 * extent * extent) return std::nullopt;
    }
    std::array<std::array<double, 3>, 2> height{};
    for (std::size_t k = 0; k < 2; ++k) {
        const Corners& plane = *triangle[1 - k];
        int above = 0;
        int below = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            const double h = determinant((*triangle[k])[i] - plane[0], plane[1] - plane[0], plane[2] - plane[0]);
            height[k][i] = h;
            above += h > doubt ? 1 : 0;
            below += h < -doubt ? 1 : 0;
        }
        if (above == 3 || below == 3) return PairClass::disjoint;
    }
    // An edge that passes through the inside of the other triangle.
    for (std::size_t k = 0; k < 2; ++k) {
        const Corners& t = *triangle[k];
        const Corners& face = *triangle[1 - k];
        for (std::size_t i = 0; i < 3; ++i) {
            const std::size_t j = (i + 1) % 3;
            const bool through =
                (height[k][i] > doubt && height[k][j] < -doubt) || (height[k][i] < -doubt && height[k][j] > doubt);
            if (!through) continue;
            int left = 0;
            int right = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double turn = determinant(t[j] - t[i], face[c] - t[i], face[(c + 1) % 3] - t[i]);
                left += turn > doubt ? 1 : 0;
                right += turn < -doubt ? 1 : 0;
            }
            if (left == 3 || right == 3) return PairClass::transversal;
        }
    }
    // Separating plane with normal e×f, which contains the directions of one edge of each triangle.
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const Vector3 axis = (first[(i + 1) % 3] - first[i]).cross(second[(j + 1) % 3] - second[j]);
            double first_low = std::numeric_limits<double>::infinity();
            double first_high = -first_low;
            double second_low = first_low;
            double second_high = -first_low;
            for (std::size_t c = 0; c < 3; ++c) {
                const double a = axis.dot(first[c] - first[i]);
                const double b = axis.dot(second[c] - first[i]);
                first_low = std::min(first_low, a);
                first_high = std::max(first_high, a);
                second_low = std::min(second_low, b);
                second_high = std::max(second_high, b);
            }
            if (first_low > second_high + doubt || second_low > first_high + doubt) return PairClass::disjoint;
        }
    }
    return std::nullopt;
}

}  // namespace

PairClass oracle_class(const Corners& first, const Corners& second) {
    if (const std::optional<PairClass> known = obvious_class(first, second)) return *known;
    const auto [a, b] = on_grid(first, second);
    if (is_zero(a.normal) || is_zero(b.normal)) return PairClass::degenerate;
    return class_of(common_points(a, b), a, b);
}

bool oracle_intersect(const Corners& first, const Corners& second) {
    if (const std::optional<PairClass> known = obvious_class(first, second)) return *known != PairClass::disjoint;
    const auto [a, b] = on_grid(first, second);
    if (!is_zero(a.normal)) return !common_points(a, b).empty();
    if (!is_zero(b.normal)) return !common_points(b, a).empty();
    return segments_meet(longest_side(a), longest_side(b));
}

}  // namespace trocar
