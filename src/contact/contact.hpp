// What detection finds: pairs of intersecting triangles, and contacts that add geometry to a pair.
// Unset fields are poisoned (NaN, -1), so that "not filled" never resembles an answer.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "geometry/types.hpp"

namespace trocar {

/// Two triangles that meet, or that are near each other, as the list says; a < b, global triangle numbers.
struct TrianglePair {
    Index a = -1;
    Index b = -1;
    auto operator<=>(const TrianglePair&) const = default;
};

/// How two triangles overlap (METHODS §3.1): by the order of their intervals on the common line.
enum class ContactCase : std::uint8_t {
    unset,
    a_enters_b,   ///< a vertex of a pierces face b: a's interval lies inside b's
    b_enters_a,   ///< a vertex of b pierces face a (also the tie of equal intervals)
    edges_cross,  ///< the intervals overlap partly
    touch,        ///< overlap and depth both at most 1 nm: no response
    coplanar,     ///< same plane: no response, counted
    degenerate,   ///< a triangle with an altitude below 1 µm: no response, counted
    point_face,   ///< sources `proximity` and `tracked_proximity`: a vertex and the point of a face nearest to it
    edge_edge     ///< sources `proximity` and `tracked_proximity`: where two edges come closest
};

/// How a contact that begins between two frames begins.
enum class SweptKind : std::uint8_t { unset, vertex_face, edge_edge };

/// Two triangles that are apart at the frame before and meet on the way to this one, every vertex moving on a straight
/// line; whether they still intersect at the end is what the list of pairs reports.
struct SweptContact {
    Index a = -1;  ///< a < b, global triangle numbers; -1 where a library reports the bodies only
    Index b = -1;
    Index body_a = -1;  ///< body_a < body_b
    Index body_b = -1;
    double time = std::numeric_limits<double>::quiet_NaN();  ///< part of the tick, in [0, 1], at which they meet
    SweptKind kind = SweptKind::unset;
};

/// One of the vertices that are set; -1: none is. Any of the three may be unset.
inline Index any_vertex(const std::array<Index, 3>& vertices) {
    return *std::max_element(vertices.begin(), vertices.end());
}

/// A point of a body: up to three vertices with weights that sum to 1; unused entries, in any place, -1 with weight 0.
struct ContactPoint {
    std::array<Index, 3> vertices{-1, -1, -1};
    std::array<double, 3> weights{0.0, 0.0, 0.0};
    static ContactPoint at_vertex(Index vertex) { return {{vertex, -1, -1}, {1.0, 0.0, 0.0}}; }
    /// All three corners, with a weight or without: within the tick the point may get to where they have one.
    static ContactPoint in_triangle(const Triangles& triangles, Index triangle, const Vector3& weights) {
        return {{triangles(0, triangle), triangles(1, triangle), triangles(2, triangle)},
                {weights[0], weights[1], weights[2]}};
    }
    /// Weighted sum of the vertices' columns: positions, velocities.
    [[nodiscard]] Vector3 blend(const Matrix3X& columns) const {
        Vector3 sum = Vector3::Zero();
        for (std::size_t i = 0; i < 3; ++i) {
            if (vertices[i] >= 0 && weights[i] != 0.0) sum += weights[i] * columns.col(vertices[i]);
        }
        return sum;
    }
};

/// Geometry of one contact. Native contacts of a library may leave a, b or anything else unset.
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
        Vector3::Constant(unset);  ///< unit; moving b along it by interval_length parts the pair
    Index vertex_a = -1;           ///< A1: global vertex of a (entering, or nearest to vertex_b)
    Index vertex_b = -1;           ///< A2: global vertex of b (entering, or nearest to vertex_a)

    // What every source reports at the *start of the tick*: led bodies where the tick finds them, tissue as detected.
    Index body_a = -1;  ///< body_a < body_b
    Index body_b = -1;
    ContactPoint on_a;
    ContactPoint on_b;
    double gap = unset;       ///< m along normal from on_a to on_b, negative inside
    double approach = unset;  ///< m, change of the gap that the scripts alone bring within the tick; closing negative
    /// point_face and edge_edge: 1 where the feature is on the side where it belongs, -1 where it has crossed.
    int side = 0;
    std::uint64_t id = 0;  ///< names the two features, the same in every tick; 0: the source reports none
};

}  // namespace trocar
