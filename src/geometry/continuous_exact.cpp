#include "geometry/continuous_exact.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "geometry/continuous_exclusion.hpp"
#include "geometry/exact.hpp"

namespace trocar::continuous {
namespace {

using PolynomialVector = std::array<Polynomial, 3>;

PolynomialVector operator-(const PolynomialVector& a, const PolynomialVector& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Polynomial dot(const PolynomialVector& a, const PolynomialVector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
PolynomialVector cross(const PolynomialVector& a, const PolynomialVector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// All coordinates times the power of two that makes them integer, as polynomials in time.
std::array<PolynomialVector, 4> on_grid(const std::array<MovingPoint, 4>& points) {
    int lowest = std::numeric_limits<int>::max();
    const auto unit_of = [](double x) { return std::ilogb(x) - 52; };
    for (const MovingPoint& p : points) {
        for (const Vector3* x : {&p.start, &p.end}) {
            for (int i = 0; i < 3; ++i) {
                if ((*x)[i] != 0.0) lowest = std::min(lowest, unit_of((*x)[i]));
            }
        }
    }
    const auto whole = [&](double x) {
        if (x == 0.0) return Big(0);
        const Big mantissa = static_cast<std::int64_t>(std::scalbn(x, -unit_of(x)));
        return Big(mantissa << static_cast<unsigned>(unit_of(x) - lowest));
    };
    std::array<PolynomialVector, 4> result;
    for (std::size_t k = 0; k < 4; ++k) {
        for (std::size_t i = 0; i < 3; ++i) {
            const Big start = whole(points[k].start[static_cast<Eigen::Index>(i)]);
            const Big end = whole(points[k].end[static_cast<Eigen::Index>(i)]);
            result[k][i].coefficient = {start, end - start};
            result[k][i].trim();
        }
    }
    return result;
}

/// A component that does not vanish at the root, or -1.
int nonzero_component(Root& root, const PolynomialVector& v) {
    for (int i = 0; i < 3; ++i) {
        if (root.sign_of(v[static_cast<std::size_t>(i)]) != 0) return i;
    }
    return -1;
}

bool on_segment(Root& root, const PolynomialVector& p, const PolynomialVector& a, const PolynomialVector& b) {
    return nonzero_component(root, cross(b - a, p - a)) < 0 && root.sign_of(dot(a - p, b - p)) <= 0;
}

/// Meeting of a point and a segment in any motion.
std::optional<double> point_meets_segment(const PolynomialVector& p, const PolynomialVector& a,
                                          const PolynomialVector& b) {
    const PolynomialVector off_line = cross(b - a, p - a);
    const Polynomial between = dot(a - p, b - p);  // <= 0 where p on the line lies between the ends
    Polynomial common;
    for (const Polynomial& component : off_line) common = greatest_common_divisor(common, component);
    if (common.is_zero()) {
        // On one line all the time.
        if (sign_at(between, {0, 0}) <= 0) return 0.0;
        return Roots(between).first([](Root& /*root*/) { return true; });
    }
    return Roots(common).first([&](Root& root) { return root.sign_of(between) <= 0; });
}

std::optional<double> decide_vertex_face(const std::array<MovingPoint, 4>& points) {
    const std::array<PolynomialVector, 4> grid = on_grid(points);
    const PolynomialVector& p = grid[0];
    const PolynomialVector& a = grid[1];
    const PolynomialVector& b = grid[2];
    const PolynomialVector& c = grid[3];
    const PolynomialVector normal = cross(b - a, c - a);
    const Polynomial volume = dot(p - a, normal);
    if (volume.is_zero()) {
        // In one plane all the time: inside at the start, or entering through an edge.
        const Vector3& start = points[0].start;
        if (triangles_intersect({start, start, start}, {points[1].start, points[2].start, points[3].start})) return 0.0;
        return earlier(earlier(point_meets_segment(p, a, b), point_meets_segment(p, b, c)),
                       point_meets_segment(p, c, a));
    }
    return Roots(volume).first([&](Root& root) {
        const int axis = nonzero_component(root, normal);
        if (axis < 0) return on_segment(root, p, a, b) || on_segment(root, p, b, c) || on_segment(root, p, c, a);
        const auto k = static_cast<std::size_t>(axis);
        const int turn = root.sign_of(normal[k]);
        for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &c), std::pair(&c, &a)}) {
            if (root.sign_of(cross(*to - *from, p - *from)[k]) * turn < 0) return false;
        }
        return true;
    });
}

std::optional<double> decide_edge_edge(const std::array<MovingPoint, 4>& points) {
    const std::array<PolynomialVector, 4> grid = on_grid(points);
    const PolynomialVector& a = grid[0];
    const PolynomialVector& b = grid[1];
    const PolynomialVector& c = grid[2];
    const PolynomialVector& d = grid[3];
    const PolynomialVector normal = cross(b - a, d - c);
    const Polynomial volume = dot(c - a, normal);
    if (volume.is_zero()) {
        // In one plane all the time: crossing at the start, or from the moment an end arrives.
        if (triangles_intersect({points[0].start, points[1].start, points[1].start},
                                {points[2].start, points[3].start, points[3].start})) {
            return 0.0;
        }
        return earlier(earlier(point_meets_segment(a, c, d), point_meets_segment(b, c, d)),
                       earlier(point_meets_segment(c, a, b), point_meets_segment(d, a, b)));
    }
    return Roots(volume).first([&](Root& root) {
        const int axis = nonzero_component(root, normal);
        if (axis < 0) {
            return on_segment(root, a, c, d) || on_segment(root, b, c, d) || on_segment(root, c, a, b) ||
                   on_segment(root, d, a, b);
        }
        const auto k = static_cast<std::size_t>(axis);
        const auto side = [&](const PolynomialVector& from, const PolynomialVector& to, const PolynomialVector& x) {
            return root.sign_of(cross(to - from, x - from)[k]);
        };
        return side(a, b, c) * side(a, b, d) <= 0 && side(c, d, a) * side(c, d, b) <= 0;
    });
}

}  // namespace

std::optional<double> earlier(std::optional<double> a, std::optional<double> b) {
    if (a && b) return std::min(*a, *b);
    return a ? a : b;
}

Polynomial volume_of(const std::array<MovingPoint, 4>& points, bool edges) {
    const std::array<PolynomialVector, 4> grid = on_grid(points);
    return edges ? dot(grid[2] - grid[0], cross(grid[1] - grid[0], grid[3] - grid[2]))
                 : dot(grid[0] - grid[1], cross(grid[2] - grid[1], grid[3] - grid[1]));
}

std::optional<double> exact_vertex_face(const std::array<MovingPoint, 4>& points) {
    return vertex_face_apart(points, many_cells) ? std::nullopt : decide_vertex_face(points);
}

std::optional<double> exact_edge_edge(const std::array<MovingPoint, 4>& points) {
    return edge_edge_apart(points, many_cells) ? std::nullopt : decide_edge_edge(points);
}

}  // namespace trocar::continuous
