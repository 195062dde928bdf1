// Contact reduction of `corrected` (METHODS §5, erratum 12): per vertex and other body the nearest face, and one
// contact per edge pair. Stiffness then does not grow with the number of triangle pairs.
#pragma once

#include <array>
#include <vector>

#include "respond/thesis_contacts.hpp"

namespace trocar {

/// Vertices of the two crossing edges, body a's first, sorted within each edge.
using EdgeKey = std::array<Index, 4>;
EdgeKey name_edges(const Topology& topology, const Frame& frame, const Contact& contact);

class ContactReduction {
public:
    void prepare(const Topology& topology);
    /// Keeps the vertex' contact with this body if its face is nearer than the one known. False where one was known.
    bool keep(const VertexInFace& candidate);
    /// Keeps the deepest contact of two edges. False where one was known.
    bool keep(const EdgeKey& key, const CrossedEdges& candidate);
    [[nodiscard]] const std::vector<VertexInFace>& faces() const { return faces_; }
    [[nodiscard]] std::size_t edge_count() const { return edges_.size(); }
    [[nodiscard]] const CrossedEdges& edges(std::size_t i) const { return edges_[i].edges; }
    void clear();

private:
    struct EdgePair {
        EdgeKey key{};
        CrossedEdges edges;
        Index next = -1;
    };
    std::vector<Index> first_face_;  ///< N; first of a vertex' faces
    std::vector<VertexInFace> faces_;
    std::vector<Index> first_edge_;  ///< N; by the smallest vertex of body a's edge
    std::vector<EdgePair> edges_;
};

}  // namespace trocar
