// What the equations of the thesis need of a contact: a vertex in a face, or two edges that have crossed. Read from a
// pair of triangles and its overlap case (source `intersection`), or from two features (`proximity`,
// `tracked_proximity`), which are reported once each, by their closest points and with a normal of their own.
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
    Index triangle = -1;               ///< the pierced face; -1 where the source reports a point of the surface alone
    ContactPoint face;                 ///< its loaded point
    Vector3 normal = Vector3::Zero();  ///< unit, outer, of the face
    Index nearest = -1;                ///< the face's vertex that the printed equations use
    double depth = 0.0;                ///< m
    double distance = 0.0;             ///< m, to the closest point of the face
    Index next = -1;                   ///< next face of the same vertex
};

/// Two edges that have crossed, or what the printed equations take for them.
struct CrossedEdges {
    Index body_a = -1;
    Index body_b = -1;
    ContactPoint a, b;                    ///< loaded points
    Index vertex_a = -1;                  ///< of a, whose velocity the printed equations take
    Index vertex_b = -1;                  ///< the same of b
    Vector3 direction = Vector3::Zero();  ///< unit; moving b along it by `depth` parts the two
    double depth = 0.0;                   ///< m
    double stiffness = 0.0;               ///< N/m, of b where it is tissue
    Vector3 place = Vector3::Zero();      ///< m, where they cross
};

[[nodiscard]] inline bool is_of_features(const Contact& contact) {
    return contact.kind == ContactCase::point_face || contact.kind == ContactCase::edge_edge;
}
/// True where b's vertex is in a face of a.
[[nodiscard]] bool enters_with_b(const Contact& contact);

/// The vertices of a pair of triangles that are in the other's face: the printed equations take the deepest, with
/// reduction every vertex that lies below the face counts. Replaces `out`.
void read_vertices(const ThesisState& state, const Frame& frame, const Contact& contact,
                   std::vector<VertexInFace>& out);
VertexInFace read_point_face(const Contact& contact);
CrossedEdges read_crossing(const ThesisState& state, const Frame& frame, const Contact& contact);
CrossedEdges read_edge_edge(const ThesisState& state, const Contact& contact);

}  // namespace trocar
