// Closest points of point and triangle and of two edges, as weights on the four vertices: the gap functions of the
// reference solver. Independent of the geometry code of all methods under test.
#pragma once

#include <array>

#include "geometry/types.hpp"

namespace trocar {

/// Barycentric weights (>= 0, sum 1) of the point of triangle a, b, c that is closest to p.
Vector3 closest_weights(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

/// Parameters s, t in [0, 1] of the closest points on the edges a0 a1 and b0 b1; not unique for parallel edges.
std::array<double, 2> closest_places(const Vector3& a0, const Vector3& a1, const Vector3& b0, const Vector3& b1);

/// Four vertices of a distance query: vertex and face, or edge and edge.
struct FeaturePair {
    enum class Kind : std::uint8_t { vertex_face, edge_edge };
    Kind kind = Kind::vertex_face;
    std::array<Index, 4> vertex{-1, -1, -1, -1};  ///< vertex, then face; or first edge, then second
    bool operator==(const FeaturePair&) const = default;
};

/// Distance of a feature pair and its gradient: d = |Σ weight_i x_i|, ∂d/∂x_i = weight_i · normal. Exact where the
/// closest points are unique.
struct FeatureDistance {
    double distance = 0.0;             ///< m
    Vector3 normal = Vector3::Zero();  ///< unit, from the second feature to the first; zero at distance 0
    std::array<double, 4> weight{};    ///< + on the first feature, - on the second
};
FeatureDistance distance_of(const FeaturePair& pair, const std::array<Vector3, 4>& points);

/// Largest t in [0, 1] such that along points + t motion the distance stays above a tenth of its initial value.
/// Additive continuous collision detection (Li, Kaufman, Jiang 2021), conservative.
double safe_part_of_motion(const FeaturePair& pair, const std::array<Vector3, 4>& points,
                           const std::array<Vector3, 4>& motion);

}  // namespace trocar
