#include "detect/clusters.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace trocar {
namespace {

/// Orders items [begin, end) so that every aligned run of 16 is compact, every run of 256 too and so on: halves along
/// the longest side of their box, again and again, cut where a full run ends.
void halve(std::vector<Index>& order, const std::vector<Vector3>& point, std::size_t begin, std::size_t end,
           Index shift) {
    constexpr auto run = static_cast<std::size_t>(fan);
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

std::vector<Index> given_order(Range range) {
    std::vector<Index> order(static_cast<std::size_t>(range.count));
    std::iota(order.begin(), order.end(), range.first);
    return order;
}

void sort_unique(std::vector<Index>& numbers) {
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

void append(const std::vector<Index>& numbers, Lists<Index>& lists) {
    lists.member.insert(lists.member.end(), numbers.begin(), numbers.end());
    lists.close();
}

Index runs_of(Index count, Index length) { return (count + length - 1) / length; }

/// Where to cut a run of vertices [begin, end) so that its pieces are compact: an order along a curve, or row by row,
/// now and then jumps, and a block with a jump in it has a box as long as the jump. Appends the pieces' ends.
template <typename PointOf>
void cut_at_jumps(const PointOf& point_of, Index begin, Index end, std::vector<Index>& ends) {
    constexpr Index least = 8;  // vertices; less is not worth a block
    constexpr double worth_a_block = 0.8;
    const auto size = [](const Box& box) { return (box.max - box.min).sum(); };
    std::array<double, block_size> size_from{};
    Box box;
    for (Index k = end; k-- > begin;) {
        box.add(point_of(k));
        size_from[static_cast<std::size_t>(k - begin)] = size(box);
    }
    double best = worth_a_block * size_from[0];
    Index cut = end;
    box = Box();
    for (Index k = begin; k + least <= end; ++k) {
        if (k - begin >= least) {
            const double sum = size(box) + size_from[static_cast<std::size_t>(k - begin)];
            if (sum < best) {
                best = sum;
                cut = k;
            }
        }
        box.add(point_of(k));
    }
    if (cut == end) {
        ends.push_back(end);
        return;
    }
    cut_at_jumps(point_of, begin, cut, ends);
    cut_at_jumps(point_of, cut, end, ends);
}

/// Blocks of vertices in the order given (empty: the frame's own).
ClusteredBody make_blocks(const Frame& frame, const BodyRange& range, std::vector<Index> vertex_order) {
    ClusteredBody body;
    body.vertices = range.vertices;
    const Index count = range.vertices.count;
    const auto number = [&](Index k) {
        return vertex_order.empty() ? range.vertices.first + k : vertex_order[static_cast<std::size_t>(k)];
    };
    const auto point_of = [&](Index k) { return frame.position.col(number(k)); };
    body.block_begin.push_back(0);
    for (Index k = 0; k < count; k += block_size) {
        cut_at_jumps(point_of, k, std::min(k + block_size, count), body.block_begin);
    }
    body.block_count = static_cast<Index>(body.block_begin.size()) - 1;
    body.block_of.resize(static_cast<std::size_t>(count));
    for (Index block = 0; block < body.block_count; ++block) {
        for (Index k = body.block_begin[static_cast<std::size_t>(block)];
             k < body.block_begin[static_cast<std::size_t>(block) + 1]; ++k) {
            body.block_of[static_cast<std::size_t>(number(k) - range.vertices.first)] = block;
        }
    }
    // Ascending within a block: neighbours in memory one after the other.
    for (Index block = 0; block < body.block_count && !vertex_order.empty(); ++block) {
        const auto place = [&](Index at) {
            return vertex_order.begin() + body.block_begin[static_cast<std::size_t>(at)];
        };
        std::sort(place(block), place(block + 1));
    }
    body.vertex_order = std::move(vertex_order);
    return body;
}

/// Vertices and blocks of the clusters of one group, and the group's own.
void list_group(const Topology& topology, Index group, ClusteredBody& body) {
    const auto corner_of = [&](Index place, Eigen::Index k) {
        while (body.triangle[static_cast<std::size_t>(place)] < 0) --place;
        return topology.triangles(k, body.triangle[static_cast<std::size_t>(place)]);
    };
    const Index first_cluster = group * fan;
    const Index end_cluster = std::min(first_cluster + fan, body.cluster_count);
    std::vector<Index> vertices;
    for (Index place = first_cluster * fan; place < end_cluster * fan; ++place) {
        for (Eigen::Index k = 0; k < 3; ++k) vertices.push_back(corner_of(place, k));
    }
    sort_unique(vertices);
    append(vertices, body.vertices_of_group);
    std::vector<Index> blocks;
    blocks.reserve(vertices.size());
    for (const Index v : vertices) {
        blocks.push_back(body.block_of[static_cast<std::size_t>(v - body.vertices.first)]);
    }
    sort_unique(blocks);
    append(blocks, body.blocks_of_group);
    for (Index cluster = first_cluster; cluster < end_cluster; ++cluster) {
        std::vector<Index> places;
        ClusterCorners corners{};
        for (std::size_t t = 0; t < fan; ++t) {
            for (std::size_t k = 0; k < 3; ++k) {
                const Index v = corner_of(cluster * fan + static_cast<Index>(t), static_cast<Eigen::Index>(k));
                const auto place = std::lower_bound(vertices.begin(), vertices.end(), v) - vertices.begin();
                corners[t][k] = static_cast<std::uint16_t>(place);
                places.push_back(static_cast<Index>(place));
            }
        }
        sort_unique(places);
        for (const Index place : places) body.vertices_of_cluster.member.push_back(static_cast<std::uint16_t>(place));
        body.vertices_of_cluster.close();
        body.corners.push_back(corners);
    }
}

void list_regions(ClusteredBody& body) {
    std::vector<std::vector<Index>> regions_of_block(static_cast<std::size_t>(body.block_count));
    for (Index region = 0; region < body.region_count; ++region) {
        const Index end = std::min((region + 1) * fan, body.group_count);
        std::vector<Index> blocks(body.blocks_of_group.begin(region * fan), body.blocks_of_group.end(end - 1));
        sort_unique(blocks);
        append(blocks, body.blocks_of_region);
        for (const Index block : blocks) regions_of_block[static_cast<std::size_t>(block)].push_back(region);
    }
    for (const std::vector<Index>& regions : regions_of_block) append(regions, body.regions_of_block);
}

/// Clusters, groups and regions of triangles in this order, over the blocks that `body` has.
void make_clusters(const Topology& topology, const std::vector<Index>& triangle_order, ClusteredBody& body) {
    body.triangle = triangle_order;
    while (body.triangle.size() % fan != 0) body.triangle.push_back(-1);
    body.cluster_count = static_cast<Index>(body.triangle.size()) / fan;
    body.group_count = runs_of(body.cluster_count, fan);
    body.region_count = runs_of(body.group_count, fan);
    for (Index group = 0; group < body.group_count; ++group) list_group(topology, group, body);
    list_regions(body);
}

/// Sum over the groups of the longest edge of the box around their blocks, m: what an order costs.
double looseness(const Frame& frame, const ClusteredBody& body) {
    std::vector<Box> block(static_cast<std::size_t>(body.block_count));
    for (Index v = 0; v < body.vertices.count; ++v) {
        block[static_cast<std::size_t>(body.block_of[static_cast<std::size_t>(v)])].add(
            frame.position.col(body.vertices.first + v));
    }
    double sum = 0.0;
    for (Index group = 0; group < body.group_count; ++group) {
        Box box;
        for (const Index* b = body.blocks_of_group.begin(group); b != body.blocks_of_group.end(group); ++b) {
            box.add(block[static_cast<std::size_t>(*b)].min);
            box.add(block[static_cast<std::size_t>(*b)].max);
        }
        sum += (box.max - box.min).maxCoeff();
    }
    return sum;
}

}  // namespace

ClusteredBody cluster_body(const Topology& topology, const Frame& frame, const BodyRange& range, ClusterOrder order) {
    ClusteredBody given = make_blocks(frame, range, {});
    if (order == ClusterOrder::given) {
        make_clusters(topology, given_order(range.triangles), given);
        return given;
    }
    const auto point = [&frame](Index v) -> Vector3 { return frame.position.col(v); };
    const auto centre = [&](Index t) -> Vector3 {
        return (point(topology.triangles(0, t)) + point(topology.triangles(1, t)) + point(topology.triangles(2, t))) /
               3.0;
    };
    const std::vector<Index> triangle_order = compact_order(range.triangles.first, range.triangles.count, centre);
    ClusteredBody local = make_blocks(frame, range, compact_order(range.vertices.first, range.vertices.count, point));
    make_clusters(topology, triangle_order, local);
    if (order == ClusterOrder::local) return local;
    // The frame's own vertex order is read in a stream, the other vertex by vertex: taken where it is nearly as
    // compact.
    make_clusters(topology, triangle_order, given);
    constexpr double worth_a_stream = 3.0;
    return looseness(frame, given) <= worth_a_stream * looseness(frame, local) ? std::move(given) : std::move(local);
}

}  // namespace trocar
