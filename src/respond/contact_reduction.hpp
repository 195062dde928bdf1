// The corrected reduction (METHODS §5, erratum 12): one contact per vertex and other body, the nearest face, and one
// per pair of edges, so that stiffness does not grow with the number of triangle pairs.
#pragma once

#include <array>
#include <vector>

#include "contact/contact.hpp"
#include "respond/common.hpp"
#include "respond/surface.hpp"
#include "scene/world.hpp"

namespace trocar {

/// A vertex in a face, in either role.
struct VertexInFace {
    Index vertex = -1;
    Index triangle = -1;  ///< the pierced face
    Index vertex_body = -1;
    Index face_body = -1;
    Vector3 normal = Vector3::Zero();   ///< unit, outer, of the face
    Vector3 weights = Vector3::Zero();  ///< of the face's loaded point
    Index nearest = -1;                 ///< the face's vertex that the printed equations use
    double depth = 0.0;                 ///< m
    double distance = 0.0;              ///< m, to the closest point of the face
    Index next = -1;                    ///< next face of the same vertex
};

/// The two edges that cross in a contact: their vertices, body a's first, sorted within each.
using EdgeKey = std::array<Index, 4>;

struct EdgePair {
    EdgeKey key{};
    Contact contact;
    bool crosses = true;  ///< false: body b's edge pierces a face of body a at this edge of the face, see keep_pierced
    Index next = -1;
};

class ContactReduction {
public:
    void prepare(const Topology& topology);
    /// Keeps the vertex' contact with this body if its face is nearer than the one known.
    void keep(const VertexInFace& candidate);
    /// Keeps every corner of triangle b as a vertex that may be inside the body of face a, whatever the pair's case:
    /// edges that cross near a free rim may well have the rim's vertex inside.
    void keep_corners(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame,
                      const Contact& contact);
    /// Keeps the deepest contact of the two edges that cross.
    void keep_edges(const Topology& topology, const Frame& frame, const Contact& contact);
    /// Where an edge of body b passes through a face of body a round one of the face's edges and ends below the face on
    /// the other side, no pair of triangles says that the two edges cross: keeps every edge of the face as a candidate.
    void keep_pierced(const Topology& topology, const Frame& frame, const Contact& contact);
    [[nodiscard]] const std::vector<VertexInFace>& faces() const { return faces_; }
    [[nodiscard]] const std::vector<EdgePair>& edges() const { return edges_; }
    void clear();
    /// False when a key stands for a triangle pair whose edges are not known.
    [[nodiscard]] static bool names_edges(const EdgePair& pair) { return pair.key[3] != pair.contact.b; }

private:
    void keep_edges(const EdgePair& candidate);

    std::vector<Index> first_face_;  ///< N; first of a vertex' faces
    std::vector<VertexInFace> faces_;
    std::vector<Index> first_edge_;  ///< N; by the smallest vertex of body a's edge
    std::vector<EdgePair> edges_;
};

}  // namespace trocar
