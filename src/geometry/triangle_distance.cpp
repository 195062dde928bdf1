#include "geometry/triangle_distance.hpp"

#include <algorithm>
#include <limits>

namespace trocar {
namespace {

/// Place on the segment a b nearest to p, in [0, 1].
double place_on_segment(const Vector3& a, const Vector3& b, const Vector3& p) {
    const Vector3 along = b - a;
    const double length = along.squaredNorm();
    return length > 0.0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0.0;
}

/// The nearest point on the three edges: correct for any triangle whose face is not nearer.
Vector3 closest_point_on_edges(const Corners& triangle, const Vector3& point) {
    Vector3 best(1.0, 0.0, 0.0);
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        const int next = (k + 1) % 3;
        const Vector3& a = triangle[static_cast<std::size_t>(k)];
        const Vector3& b = triangle[static_cast<std::size_t>(next)];
        const double t = place_on_segment(a, b, point);
        const double here = (point - (t == 1.0 ? b : Vector3(a + t * (b - a)))).squaredNorm();
        if (here >= least) continue;
        least = here;
        best.setZero();
        best[k] = 1.0 - t;
        best[next] = t;
    }
    return best;
}

/// closest_point_on_triangle for badly shaped triangles. Weights come from areas: compared with products of
/// projections, rounding costs one power less of the smallest angle. Where an edge is nearer it costs nothing.
Vector3 closest_point_on_sliver(const Corners& triangle, const Vector3& point, const Vector3& normal) {
    const double square = normal.squaredNorm();
    Vector3 weights;
    for (int k = 0; k < 3; ++k) {
        const Vector3& a = triangle[static_cast<std::size_t>((k + 1) % 3)];
        const Vector3& b = triangle[static_cast<std::size_t>((k + 2) % 3)];
        weights[k] = (b - a).cross(point - a).dot(normal);
    }
    Vector3 on_edge = closest_point_on_edges(triangle, point);
    if (!(square > 0.0) || !(weights.minCoeff() > 0.0)) return on_edge;
    weights /= weights.sum();
    const auto squared_distance = [&](const Vector3& w) { return (point - point_at(triangle, w)).squaredNorm(); };
    return squared_distance(weights) < squared_distance(on_edge) ? weights : on_edge;
}

/// Places on two segments, in [0, 1] from their first end to their second.
struct SegmentPlaces {
    double first = 0.0;
    double second = 0.0;
};

/// Sets the closest points of the lines through two segments, when they are inside both.
bool cross_inside(const Vector3& p0, const Vector3& p, const Vector3& q0, const Vector3& q, const Vector3& normal,
                  SegmentPlaces& places) {
    // Uses the common normal, not a·e − b² (Lumelsky 1985; Ericson 5.1.9), which loses its digits for nearly parallel
    // lines. The remaining error moves the points along lines that hardly diverge.
    const double square = normal.squaredNorm();
    if (!(square > 0.0)) return false;
    const Vector3 between = q0 - p0;
    places.first = between.cross(q).dot(normal) / square;
    places.second = between.cross(p).dot(normal) / square;
    return places.first > 0.0 && places.first < 1.0 && places.second > 0.0 && places.second < 1.0;
}

/// The least distance of a corner to the other triangle.
TriangleDistance distance_of_corners(const Corners& first, const Corners& second) {
    TriangleDistance best{.squared_distance = std::numeric_limits<double>::infinity()};
    for (int k = 0; k < 3; ++k) {
        const Vector3& p = first[static_cast<std::size_t>(k)];
        const Vector3 weights = closest_point_on_triangle(second, p);
        const double here = (point_at(second, weights) - p).squaredNorm();
        if (here < best.squared_distance) best = {here, Vector3::Unit(k), weights};
    }
    for (int k = 0; k < 3; ++k) {
        const Vector3& p = second[static_cast<std::size_t>(k)];
        const Vector3 weights = closest_point_on_triangle(first, p);
        const double here = (point_at(first, weights) - p).squaredNorm();
        if (here < best.squared_distance) best = {here, weights, Vector3::Unit(k)};
    }
    return best;
}

/// Updates `best` with edge pairs that are closest inside both; an edge's ends are corners and already tested.
void take_edges(const Corners& first, const Corners& second, TriangleDistance& best) {
    for (int i = 0; i < 3; ++i) {
        const Vector3& p0 = first[static_cast<std::size_t>(i)];
        const Vector3 p = first[static_cast<std::size_t>((i + 1) % 3)] - p0;
        for (int j = 0; j < 3; ++j) {
            const Vector3& q0 = second[static_cast<std::size_t>(j)];
            const Vector3 q = second[static_cast<std::size_t>((j + 1) % 3)] - q0;
            SegmentPlaces places;
            if (!cross_inside(p0, p, q0, q, p.cross(q), places)) continue;
            const double here = (p0 + places.first * p - q0 - places.second * q).squaredNorm();
            if (here >= best.squared_distance) continue;
            best = {here, Vector3::Zero(), Vector3::Zero()};
            best.first[i] = 1.0 - places.first;
            best.first[(i + 1) % 3] = places.first;
            best.second[j] = 1.0 - places.second;
            best.second[(j + 1) % 3] = places.second;
        }
    }
}

/// True when the triangles are certainly more than `query_distance` apart along an axis of any length.
bool axis_parts(const Vector3& axis, const Corners& first, const Corners& second, double query_distance) {
    struct Shadow {
        double low = std::numeric_limits<double>::infinity();
        double high = -std::numeric_limits<double>::infinity();
        void add(double place) {
            low = std::min(low, place);
            high = std::max(high, place);
        }
    };
    Shadow one;
    Shadow other;
    double size = 0.0;
    const auto take = [&](const Vector3& corner, Shadow& shadow) {
        const Vector3 from = corner - first[0];
        size = std::max(size, from.cwiseAbs().maxCoeff());
        shadow.add(axis.dot(from));
    };
    for (const Vector3& corner : first) take(corner, one);
    for (const Vector3& corner : second) take(corner, other);
    // More than five roundings of the bound and of the places.
    constexpr double surely = 1.0 + 1e-14;
    const double bound = (surely * query_distance + 1e-14 * size) * axis.norm();
    return other.low - one.high > bound || one.low - other.high > bound;
}

bool plane_parts(const Corners& triangle, const Corners& other, double query_distance) {
    return axis_parts((triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]), triangle, other, query_distance);
}

}  // namespace

Vector3 projection_on_plane(const Corners& triangle, const Vector3& point) {
    const Vector3 ab = triangle[1] - triangle[0];
    const Vector3 ac = triangle[2] - triangle[0];
    const Vector3 ap = point - triangle[0];
    const Vector3 normal = ab.cross(ac);
    const double square = normal.squaredNorm();
    const double b = ap.cross(ac).dot(normal) / square;
    const double c = ab.cross(ap).dot(normal) / square;
    return {1.0 - b - c, b, c};
}

Vector3 closest_point_on_triangle(const Corners& triangle, const Vector3& point) {
    const Vector3 ab = triangle[1] - triangle[0];
    const Vector3 ac = triangle[2] - triangle[0];
    const Vector3 normal = ab.cross(ac);
    const double longest = std::max(ab.squaredNorm(), ac.squaredNorm());
    constexpr double well_shaped = 1e-3;  // an equilateral triangle has 0.75, one of aspect 1:30 about this
    if (!(normal.squaredNorm() > well_shaped * longest * longest)) {
        return closest_point_on_sliver(triangle, point, normal);
    }
    // Regions of the plane by the signs of projections on the edges (Ericson, Real-Time Collision Detection, 5.1.5).
    const Vector3 ap = point - triangle[0];
    const double d1 = ab.dot(ap);
    const double d2 = ac.dot(ap);
    if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0};
    const Vector3 bp = point - triangle[1];
    const double d3 = ab.dot(bp);
    const double d4 = ac.dot(bp);
    if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0};
    const double weight_c = d1 * d4 - d3 * d2;
    if (weight_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
        const double t = d1 / (d1 - d3);
        return {1.0 - t, t, 0.0};
    }
    const Vector3 cp = point - triangle[2];
    const double d5 = ab.dot(cp);
    const double d6 = ac.dot(cp);
    if (d6 >= 0.0 && d5 <= d6) return {0.0, 0.0, 1.0};
    const double weight_b = d5 * d2 - d1 * d6;
    if (weight_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
        const double t = d2 / (d2 - d6);
        return {1.0 - t, 0.0, t};
    }
    const double weight_a = d3 * d6 - d5 * d4;
    if (weight_a <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
        const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {0.0, 1.0 - t, t};
    }
    const double sum = weight_a + weight_b + weight_c;
    return {weight_a / sum, weight_b / sum, weight_c / sum};
}

TriangleDistance triangle_distance(const Corners& first, const Corners& second) {
    TriangleDistance best = distance_of_corners(first, second);
    take_edges(first, second, best);
    return best;
}

bool is_within_query_distance(const Corners& first, const Corners& second, double query_distance) {
    const double square = query_distance * query_distance;
    constexpr double surely = 1.0 + 1e-14;
    if (box_of(first).squared_distance(box_of(second)) > surely * square) return false;
    if (plane_parts(first, second, query_distance) || plane_parts(second, first, query_distance)) return false;
    TriangleDistance best = distance_of_corners(first, second);
    if (best.squared_distance <= square) return true;
    // No edges are closer when the triangles are further apart than `query_distance` along the line between the closest
    // points so far. This is the stopping test of PQP's TriDist (Larsen et al. 1999).
    if (axis_parts(point_at(second, best.second) - point_at(first, best.first), first, second, query_distance))
        return false;
    take_edges(first, second, best);
    return best.squared_distance <= square;
}

}  // namespace trocar
