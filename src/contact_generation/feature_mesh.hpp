// Connectivity of a topology's surfaces: edges, and the faces and edges at an edge or vertex. Built once per run.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/index_lists.hpp"
#include "scene/world.hpp"

namespace trocar {

class FeatureMesh {
public:
    void prepare(const Topology& topology);

    /// Edge i of a triangle joins its corners i and i + 1.
    [[nodiscard]] const std::array<Index, 3>& edges_of(Index triangle) const { return edges_of_[at(triangle)]; }
    /// Both ends, the smaller vertex number first.
    [[nodiscard]] const std::array<Index, 2>& ends(Index edge) const { return ends_[at(edge)]; }
    /// Ascending; one at a rim, two inside a manifold surface.
    [[nodiscard]] std::span<const Index> faces_at_edge(Index edge) const { return faces_at_edge_.of(edge); }
    [[nodiscard]] std::span<const Index> faces_at_vertex(Index vertex) const { return faces_at_vertex_.of(vertex); }
    [[nodiscard]] std::span<const Index> edges_at_vertex(Index vertex) const { return edges_at_vertex_.of(vertex); }
    [[nodiscard]] bool is_rim(Index edge) const { return faces_at_edge(edge).size() == 1; }
    [[nodiscard]] Index edge_count() const { return static_cast<Index>(ends_.size()); }
    [[nodiscard]] Index other_end(Index edge, Index vertex) const {
        return ends(edge)[0] == vertex ? ends(edge)[1] : ends(edge)[0];
    }
    /// Corner of the triangle opposite the edge.
    [[nodiscard]] Index apex(Index triangle, Index edge) const {
        return topology_->triangles.col(triangle).sum() - ends(edge)[0] - ends(edge)[1];
    }

private:
    const Topology* topology_ = nullptr;
    std::vector<std::array<Index, 3>> edges_of_;
    std::vector<std::array<Index, 2>> ends_;
    IndexLists faces_at_edge_, faces_at_vertex_, edges_at_vertex_;
};

}  // namespace trocar
