// Inputs of the thesis' equations: a vertex in a face, or two crossed edges. Read from a triangle pair and its overlap
// case (generator `intersection`), or from two features (`proximity`, `tracked_proximity`). Features have closest
// points and a normal of their own.
#pragma once

#include <vector>

#include "contact/contact.hpp"
#include "respond/common.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

/// A vertex in a face, in either role.
struct VertexInFace {
    Index vertex = -1;
    Index vertex_body = -1;
    Index face_body = -1;
    Index triangle = -1;               ///< the pierced face; -1: unknown
    ContactPoint face;                 ///< loaded point of the face
    Vector3 normal = Vector3::Zero();  ///< unit, outer, of the face
    Index nearest = -1;                ///< vertex of the face that the printed equations use
    double depth = 0.0;                ///< m
    double distance = 0.0;             ///< m, to the closest point of the face
    Index next = -1;                   ///< next face of the same vertex
};

/// Two crossed edges, or their counterpart in the printed equations.
struct CrossedEdges {
    Index body_a = -1;
    Index body_b = -1;
    ContactPoint a, b;                    ///< loaded points
    Index vertex_a = -1;                  ///< of a, whose velocity the printed equations use
    Index vertex_b = -1;                  ///< the same of b
    Vector3 direction = Vector3::Zero();  ///< unit; moving b along it by `depth` separates the two
    double depth = 0.0;                   ///< m
    double stiffness = 0.0;               ///< N/m, of b if it is tissue
    Vector3 place = Vector3::Zero();      ///< m, crossing point
};

[[nodiscard]] inline bool is_of_features(const Contact& contact) {
    return contact.kind == ContactCase::point_face || contact.kind == ContactCase::edge_edge;
}
/// True if b's vertex is in a face of a.
[[nodiscard]] bool enters_with_b(const Contact& contact);

/// Vertices of a triangle pair in the other's face: the deepest or, in `corrected`, all below the face. Replaces `out`.
void read_vertices(const ThesisState& state, const Frame& frame, const Contact& contact,
                   std::vector<VertexInFace>& out);
VertexInFace read_point_face(const Contact& contact);
CrossedEdges read_crossing(const ThesisState& state, const Frame& frame, const Contact& contact);
CrossedEdges read_edge_edge(const ThesisState& state, const Contact& contact);

}  // namespace trocar
