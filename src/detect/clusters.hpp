// What ohc_clustered knows of a mesh before the first tick: vertices in chunks of 16 and triangles in clusters of 16,
// both compact in space, and which chunks each cluster touches. Positions change every tick, this never does.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

inline constexpr Index cluster_size = 16;     ///< vertices in a chunk, triangles in a cluster, clusters in a group
inline constexpr Index chunk_group_size = 4;  ///< chunks in a chunk group

/// A row of lists in one array.
struct Lists {
    std::vector<Index> first{0};  ///< one more than there are lists
    std::vector<Index> member;
    void close() { first.push_back(static_cast<Index>(member.size())); }
    [[nodiscard]] const Index* begin(Index list) const { return member.data() + first[static_cast<std::size_t>(list)]; }
    [[nodiscard]] const Index* end(Index list) const {
        return member.data() + first[static_cast<std::size_t>(list) + 1];
    }
};

/// Whether to take vertices and triangles in the caller's order, in one made for locality, or in the better of the two.
enum class ClusterOrder : std::uint8_t { automatic, given, local };

/// One body's clusters. Chunk, chunk group, cluster and group numbers are local to the body.
struct ClusteredBody {
    Range vertices;                   ///< of the frame
    std::vector<Index> vertex_order;  ///< frame's vertex numbers chunk by chunk; empty: the frame's own order
    std::vector<Index> chunk_of;      ///< chunk of each vertex of the body
    Index chunk_count = 0;
    std::vector<Index> triangle;               ///< global number, cluster by cluster; -1 fills up the last cluster
    std::vector<std::array<Index, 3>> corner;  ///< global vertex numbers of `triangle`; fillers repeat the one before
    Index cluster_count = 0;
    Lists chunks_of_cluster;
    Index group_count = 0;        ///< groups of 16 consecutive clusters
    Lists chunk_groups_of_group;  ///< groups of 4 consecutive chunks that a group of clusters touches
};

namespace detail {

/// Orders items [begin, end) so that every aligned run of 16 is compact, every run of 256 too and so on: halves along
/// the longest side of their box, again and again, cut where a full run ends.
inline void halve(std::vector<Index>& order, const std::vector<Vector3>& point, std::size_t begin, std::size_t end,
                  Index shift) {
    constexpr auto run = static_cast<std::size_t>(cluster_size);
    while (end - begin > run) {
        Box box;
        for (std::size_t k = begin; k < end; ++k) box.add(point[static_cast<std::size_t>(order[k] - shift)]);
        Eigen::Index axis = 0;
        (box.max - box.min).maxCoeff(&axis);
        std::size_t unit = run;
        while (unit * run < end - begin) unit *= run;
        std::size_t middle = begin + ((end - begin) / 2 + unit / 2) / unit * unit;
        if (middle <= begin) middle = begin + unit;
        if (middle >= end) middle = end - 1 - (end - 1 - begin) % unit;
        std::nth_element(order.begin() + static_cast<std::ptrdiff_t>(begin),
                         order.begin() + static_cast<std::ptrdiff_t>(middle),
                         order.begin() + static_cast<std::ptrdiff_t>(end), [&](Index a, Index b) {
                             const double x = point[static_cast<std::size_t>(a - shift)][axis];
                             const double y = point[static_cast<std::size_t>(b - shift)][axis];
                             return x < y || (x == y && a < b);
                         });
        halve(order, point, begin, middle, shift);
        begin = middle;
    }
}

/// Items `first` … in an order made by halve.
template <typename PointOf>
std::vector<Index> compact_order(Index first, Index count, const PointOf& point_of) {
    std::vector<Index> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), first);
    std::vector<Vector3> point;
    point.reserve(order.size());
    for (const Index item : order) point.push_back(point_of(item));
    halve(order, point, 0, order.size(), first);
    return order;
}

inline void append_unique(std::vector<Index>& scratch, Lists& lists) {
    std::sort(scratch.begin(), scratch.end());
    scratch.erase(std::unique(scratch.begin(), scratch.end()), scratch.end());
    lists.member.insert(lists.member.end(), scratch.begin(), scratch.end());
    lists.close();
}

inline ClusteredBody make_clusters(const Topology& topology, const BodyRange& range, std::vector<Index> vertex_order,
                                   const std::vector<Index>& triangle_order) {
    ClusteredBody body;
    body.vertices = range.vertices;
    body.chunk_count = (range.vertices.count + cluster_size - 1) / cluster_size;
    std::vector<Index>& chunk_of = body.chunk_of;
    chunk_of.resize(static_cast<std::size_t>(range.vertices.count));
    for (Index k = 0; k < range.vertices.count; ++k) {
        const Index v = vertex_order.empty() ? k : vertex_order[static_cast<std::size_t>(k)] - range.vertices.first;
        chunk_of[static_cast<std::size_t>(v)] = k / cluster_size;
    }
    body.vertex_order = std::move(vertex_order);
    body.triangle = triangle_order;
    for (const Index t : body.triangle) {
        body.corner.push_back({topology.triangles(0, t), topology.triangles(1, t), topology.triangles(2, t)});
    }
    while (body.triangle.size() % cluster_size != 0) {
        body.triangle.push_back(-1);
        body.corner.push_back(body.corner.back());
    }
    body.cluster_count = static_cast<Index>(body.triangle.size()) / cluster_size;
    body.group_count = (body.cluster_count + cluster_size - 1) / cluster_size;
    std::vector<Index> scratch;
    std::vector<Index> group_scratch;
    for (Index cluster = 0; cluster < body.cluster_count; ++cluster) {
        scratch.clear();
        for (Index k = 0; k < cluster_size; ++k) {
            for (const Index v :
                 body.corner[static_cast<std::size_t>(cluster) * cluster_size + static_cast<std::size_t>(k)]) {
                scratch.push_back(chunk_of[static_cast<std::size_t>(v - range.vertices.first)]);
            }
        }
        append_unique(scratch, body.chunks_of_cluster);
        for (const Index chunk : scratch) group_scratch.push_back(chunk / chunk_group_size);
        if ((cluster + 1) % cluster_size == 0 || cluster + 1 == body.cluster_count) {
            append_unique(group_scratch, body.chunk_groups_of_group);
            group_scratch.clear();
        }
    }
    return body;
}

/// Sum over the clusters of the longest edge of the box around their chunks, m: what an order costs.
inline double looseness(const Frame& frame, const ClusteredBody& body) {
    std::vector<Box> chunk(static_cast<std::size_t>(body.chunk_count));
    for (Index k = 0; k < body.vertices.count; ++k) {
        const Index v =
            body.vertex_order.empty() ? body.vertices.first + k : body.vertex_order[static_cast<std::size_t>(k)];
        chunk[static_cast<std::size_t>(k / cluster_size)].add(frame.position.col(v));
    }
    double sum = 0.0;
    for (Index cluster = 0; cluster < body.cluster_count; ++cluster) {
        Box box;
        for (const Index* c = body.chunks_of_cluster.begin(cluster); c != body.chunks_of_cluster.end(cluster); ++c) {
            box.add(chunk[static_cast<std::size_t>(*c)].min);
            box.add(chunk[static_cast<std::size_t>(*c)].max);
        }
        sum += (box.max - box.min).maxCoeff();
    }
    return sum;
}

}  // namespace detail

/// Clusters of one body. `frame` tells where things are at the start; it decides the order, never the answer.
inline ClusteredBody cluster_body(const Topology& topology, const Frame& frame, const BodyRange& range,
                                  ClusterOrder order) {
    std::vector<Index> as_given(static_cast<std::size_t>(range.triangles.count));
    std::iota(as_given.begin(), as_given.end(), range.triangles.first);
    ClusteredBody given;
    if (order != ClusterOrder::local) {
        given = detail::make_clusters(topology, range, {}, as_given);
        if (order == ClusterOrder::given) return given;
    }
    const auto point = [&frame](Index v) -> Vector3 { return frame.position.col(v); };
    const auto centre = [&](Index t) -> Vector3 {
        return (point(topology.triangles(0, t)) + point(topology.triangles(1, t)) + point(topology.triangles(2, t))) /
               3.0;
    };
    ClusteredBody local =
        detail::make_clusters(topology, range, detail::compact_order(range.vertices.first, range.vertices.count, point),
                              detail::compact_order(range.triangles.first, range.triangles.count, centre));
    // The frame's own order is read in one stream, the other vertex by vertex: taken where it is as compact.
    if (order == ClusterOrder::automatic && detail::looseness(frame, given) <= 1.1 * detail::looseness(frame, local)) {
        return given;
    }
    return local;
}

}  // namespace trocar
