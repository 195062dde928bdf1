// Output of detection: pairs of intersecting triangles, and contacts that add geometry to a pair. Unset fields are NaN
// or -1, so that an unset value never passes for a result.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "geometry/types.hpp"

namespace trocar {

/// Global triangle numbers, a < b. The list that holds the pair says whether the triangles meet or are near.
struct TrianglePair {
    Index a = -1;
    Index b = -1;
    auto operator<=>(const TrianglePair&) const = default;
};

/// Overlap of two triangles, classified by the order of their intervals on the common line (METHODS §3.1).
enum class ContactCase : std::uint8_t {
    unset,
    a_enters_b,   ///< a vertex of a pierces face b: a's interval lies inside b's
    b_enters_a,   ///< a vertex of b pierces face a (also the tie of equal intervals)
    edges_cross,  ///< the intervals overlap partly
    touch,        ///< overlap and depth both at most 1 nm: no response
    coplanar,     ///< same plane: no response, counted
    degenerate,   ///< a triangle with an altitude below 1 µm: no response, counted
    point_face,   ///< generators `proximity` and `tracked_proximity`: a vertex and its nearest point on a face
    edge_edge     ///< the same generators: closest points of two edges
};

/// Names of ContactCase in its order, as files have them.
inline constexpr std::array contact_case_words{"unset",    "a_enters_b", "b_enters_a", "edges_cross", "touch",
                                               "coplanar", "degenerate", "point_face", "edge_edge"};

/// First contact of a pair between two frames.
enum class SweptKind : std::uint8_t { unset, vertex_face, edge_edge };

/// Two triangles that are disjoint in the previous frame and meet during linear motion of the vertices to this one.
/// `ContactSet::pairs` reports whether they still intersect at its end.
struct SweptContact {
    Index a = -1;  ///< a < b, global triangle numbers; -1 where a library reports the bodies only
    Index b = -1;
    Index body_a = -1;  ///< body_a < body_b
    Index body_b = -1;
    double time = std::numeric_limits<double>::quiet_NaN();  ///< fraction of the tick at first contact, in [0, 1]
    SweptKind kind = SweptKind::unset;
};

/// Largest vertex number; -1 if no entry is set. Any entry may be unset.
inline Index any_vertex(const std::array<Index, 3>& vertices) {
    return *std::max_element(vertices.begin(), vertices.end());
}

/// Point of a body: weighted sum of up to three vertices, weights sum to 1. Unused entries, at any position, are -1
/// with weight 0.
struct ContactPoint {
    std::array<Index, 3> vertices{-1, -1, -1};
    std::array<double, 3> weights{0.0, 0.0, 0.0};
    static ContactPoint at_vertex(Index vertex) { return {{vertex, -1, -1}, {1.0, 0.0, 0.0}}; }
    /// Keeps corners of zero weight, since the point may move there within the tick.
    static ContactPoint in_triangle(const Triangles& triangles, Index triangle, const Vector3& weights) {
        return {{triangles(0, triangle), triangles(1, triangle), triangles(2, triangle)},
                {weights[0], weights[1], weights[2]}};
    }
    /// Vertex of the largest weight, the first of equals.
    [[nodiscard]] Index heaviest() const {
        return vertices[at(std::max_element(weights.begin(), weights.end()) - weights.begin())];
    }
    /// Weighted sum of of(vertex), a vector.
    template <typename Of>
    [[nodiscard]] Vector3 blend_of(const Of& of) const {
        Vector3 sum = Vector3::Zero();
        for (std::size_t i = 0; i < 3; ++i) {
            if (vertices[i] >= 0 && weights[i] != 0.0) sum += weights[i] * of(vertices[i]);
        }
        return sum;
    }
    /// Weighted sum of columns of a 3×N matrix (positions or velocities).
    [[nodiscard]] Vector3 blend(const Matrix3X& columns) const {
        return blend_of([&columns](Index vertex) { return columns.col(vertex); });
    }
};

/// Geometry of one contact. A library's native contact may leave any field unset.
struct Contact {
    static constexpr double unset = std::numeric_limits<double>::quiet_NaN();
    Index a = -1;
    Index b = -1;
    ContactCase kind = ContactCase::unset;
    Vector3 point = Vector3::Constant(unset);   ///< m, world
    Vector3 normal = Vector3::Constant(unset);  ///< unit, from a to b
    double depth = unset;                       ///< m, >= 0; plane depth of the entering vertex (cases *_enters_*)
    double interval_length = unset;             ///< m, overlap of the two intervals on the common line
    Vector3 interval_direction =
        Vector3::Constant(unset);  ///< unit; moving b along it by interval_length separates the pair
    Index vertex_a = -1;           ///< A1: global vertex of a (entering, or nearest to vertex_b)
    Index vertex_b = -1;           ///< A2: global vertex of b (entering, or nearest to vertex_a)

    // State at the start of the tick, set by every contact generator: kinematic bodies before this tick's motion,
    // tissue as in the frame.
    Index body_a = -1;  ///< body_a < body_b
    Index body_b = -1;
    ContactPoint on_a;
    ContactPoint on_b;
    double gap = unset;       ///< m along normal from on_a to on_b, negative inside
    double approach = unset;  ///< m, change of the gap by scripted motion within the tick, negative when closing
    /// point_face and edge_edge: 1 on the allowed side, -1 after crossing.
    int side = 0;
    std::uint64_t id = 0;  ///< identifies the two features across ticks; 0: none
};

}  // namespace trocar
