// Static hierarchy of a mesh for ohc_clustered: vertices in blocks of up to 64, cut where their order jumps; triangles
// in clusters of 16, clusters in groups of 16, groups in regions of 16. All are compact in space. Each cluster, group
// and region has lists of its vertices or blocks.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

inline constexpr Index fan = 16;         ///< triangles in a cluster, clusters in a group, groups in a region
inline constexpr Index block_size = 64;  ///< largest number of vertices in a block

/// Lists of numbers in one array.
template <typename Number>
struct Lists {
    std::vector<Index> first{0};  ///< start of each list, and the end of the last
    std::vector<Number> member;
    void close() { first.push_back(static_cast<Index>(member.size())); }
    [[nodiscard]] Index count(Index list) const {
        return first[static_cast<std::size_t>(list) + 1] - first[static_cast<std::size_t>(list)];
    }
    [[nodiscard]] const Number* begin(Index list) const {
        return member.data() + first[static_cast<std::size_t>(list)];
    }
    [[nodiscard]] const Number* end(Index list) const {
        return member.data() + first[static_cast<std::size_t>(list) + 1];
    }
};

/// Order of vertices and triangles: the caller's, one made for locality, or the better of the two.
enum class ClusterOrder : std::uint8_t { automatic, given, local };

/// Corners of a cluster's 16 triangles, as places in the vertex list of its group.
using ClusterCorners = std::array<std::array<std::uint16_t, 3>, fan>;

/// One body's clusters. Block, cluster, group and region numbers are local to the body.
struct ClusteredBody {
    Range vertices;                   ///< frame numbers
    std::vector<Index> vertex_order;  ///< frame's vertex numbers block by block; empty: the frame's own order
    std::vector<Index> block_of;      ///< block of each vertex of the body
    Index block_count = 0;
    std::vector<Index> block_begin;  ///< first place of each block in that order, and the end of the last
    std::vector<Index> triangle;     ///< global number, cluster by cluster; -1 pads the last cluster
    Index cluster_count = 0;
    Index group_count = 0;
    Index region_count = 0;
    std::vector<ClusterCorners> corners;       ///< one per cluster; padding repeats the triangle before
    Lists<Index> vertices_of_group;            ///< frame numbers, ascending, each once
    Lists<std::uint16_t> vertices_of_cluster;  ///< places in the group's list, ascending, each once
    Lists<Index> blocks_of_group;
    Lists<Index> blocks_of_region;
    Lists<Index> regions_of_block;
};

/// Builds the clusters of one body. `frame`, the start position, affects their order and never the answer.
ClusteredBody cluster_body(const Topology& topology, const Frame& frame, const BodyRange& range, ClusterOrder order);

}  // namespace trocar
