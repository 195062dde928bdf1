// Report on the quality of one mesh: counts, holes, non-manifold edges and vertices, self-intersections. No detector
// uses it; it explains odd behaviour of a scene to its user.
#pragma once

#include <cstdint>
#include <string>

#include "geometry/mesh_file.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// A length unit and whether it was guessed from the size of the mesh.
struct LengthUnit {
    std::string name = {};  ///< "mm", "cm", "m", "in"; "unknown" when there is nothing to guess from
    bool guessed = true;
};

/// Counts after welding identical positions, as defined in the README beside the data's meshes. Counts from `shells` on
/// leave out triangles whose corners coincide.
struct MeshReport {
    Index vertices_stored = 0;       ///< as stored in the file
    Index vertices = 0;              ///< after welding, used by a triangle
    Index triangles = 0;             ///< polygons fan-split, all kept
    Index collapsed = 0;             ///< triangles with coinciding corners
    Index shells = 0;                ///< sets of triangles connected by edges
    Index boundary_edges = 0;        ///< edges of one triangle only
    Index holes = 0;                 ///< loops of boundary edges
    Index non_manifold_edges = 0;    ///< edges of three or more triangles
    Index flipped_edges = 0;         ///< edges whose two triangles disagree on orientation
    Index bow_vertices = 0;          ///< vertices whose triangles form more than one fan
    Index degenerate_triangles = 0;  ///< height below 1e-7 of the longest edge
    Index duplicate_triangles = 0;   ///< same corners as an earlier one, in any order
    /// Intersecting pairs without a common vertex, by exact predicates. Touching counts where a corner lies in the
    /// other triangle's plane. Coplanar pairs and edges that cross only in a point are left out, as in the README's
    /// numbers.
    std::int64_t self_intersections = 0;
    /// Pairs without a common vertex that lie in one plane and meet there: coincident layers. Not counted above.
    std::int64_t coplanar_overlaps = 0;
    bool coplanar_overlaps_complete = true;   ///< false: a lower bound, the search was stopped
    bool self_intersections_complete = true;  ///< false: a lower bound, see most_self_intersection_tests
    bool watertight = false;                  ///< no boundary, non-manifold or flipped edge
    double signed_volume = 0.0;        ///< unit³; positive when triangles are counter-clockwise seen from outside
    double median_longest_edge = 0.0;  ///< unit; NaN without triangles
    Box box = {};                      ///< of the vertices that a triangle uses, unit; empty without triangles
    LengthUnit unit = {};
};

/// Limit on tested pairs (overlapping boxes, no common vertex). An ordinary mesh has about ten per triangle; a heap, or
/// a cone of tens of thousands of slivers, would have all.
constexpr std::int64_t most_self_intersection_tests(std::int64_t triangles) { return 1'000'000 + 40 * triangles; }

/// Computes all fields. Time grows like triangles · log(triangles) plus the tested pairs, at most `most_tests`.
MeshReport report_mesh(const Mesh& mesh, std::int64_t most_tests);
/// With most_self_intersection_tests of the mesh.
MeshReport report_mesh(const Mesh& mesh);

/// MeshReport::self_intersections and coplanar_overlaps together, without a limit on the tests.
std::int64_t self_intersections(const Matrix3X& vertices, const Triangles& triangles);

/// MeshReport::boundary_edges alone.
Index boundary_edges(const Matrix3X& vertices, const Triangles& triangles);

/// The unit that the file states, else a guess. The longest side of the box decides: up to 2 means m, up to 25 cm,
/// above mm. Instruments and organs measure millimetres to a metre.
LengthUnit length_unit(const Mesh& mesh, const Box& box);

}  // namespace trocar
