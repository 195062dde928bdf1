#include "detect/clusters.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <numeric>
#include <span>
#include <utility>

namespace trocar {
namespace {

/// An item with its position.
struct Item {
    Vector3 point;  ///< m
    Index number = -1;
};

/// Orders items so that every aligned run of 16 is compact, and every run of 256 and so on. Halves recursively along
/// the longest side of the items' box, and cuts where a full run ends.
void halve(std::span<Item> items) {
    constexpr auto run = static_cast<std::size_t>(fan);
    while (items.size() > run) {
        Box box;
        for (const Item& item : items) box.add(item.point);
        Eigen::Index axis = 0;
        (box.max - box.min).maxCoeff(&axis);
        std::size_t unit = run;
        while (unit * run < items.size()) unit *= run;
        std::size_t middle = (items.size() / 2 + unit / 2) / unit * unit;
        if (middle == 0) middle = unit;
        if (middle >= items.size()) middle = items.size() - 1 - (items.size() - 1) % unit;
        std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle), items.end(),
                         [axis](const Item& a, const Item& b) {
                             const double x = a.point[axis];
                             const double y = b.point[axis];
                             return x < y || (x == y && a.number < b.number);
                         });
        halve(items.first(middle));
        items = items.subspan(middle);
    }
}

/// Numbers `first` … in the order of `halve`.
template <typename PointOf>
std::vector<Index> compact_order(Index first, Index count, const PointOf& point_of) {
    std::vector<Item> items;
    items.reserve(static_cast<std::size_t>(count));
    for (Index number = first; number < first + count; ++number) items.push_back({point_of(number), number});
    halve(items);
    std::vector<Index> order;
    order.reserve(items.size());
    for (const Item& item : items) order.push_back(item.number);
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

/// End of a block of vertices that starts at `begin`, at most `end`. An order along a curve or row by row has jumps,
/// and the box of a block is as long as a jump in it.
template <typename PointOf>
Index end_of_block(const PointOf& point_of, Index begin, Index end) {
    constexpr Index least = 4;  // vertices; a smaller block does not pay
    constexpr double worth_a_block = 0.8;
    const auto size = [](const Box& box) { return (box.max - box.min).sum(); };
    std::array<double, block_size> size_from{};
    for (Index whole = -1; whole != end;) {
        whole = end;
        Box from;
        for (Index k = whole; k-- > begin;) {
            from.add(point_of(k));
            size_from[static_cast<std::size_t>(k - begin)] = size(from);
        }
        double best = worth_a_block * size_from[0];
        Box to;
        for (Index k = begin; k + least <= whole; ++k) {
            if (k - begin >= least) {
                const double sum = size(to) + size_from[static_cast<std::size_t>(k - begin)];
                if (sum < best) {
                    best = sum;
                    end = k;
                }
            }
            to.add(point_of(k));
        }
    }
    return end;
}

/// Makes blocks of vertices in the given order (empty: the frame's own).
ClusteredBody make_blocks(const Frame& frame, const BodyRange& range, std::vector<Index> vertex_order) {
    ClusteredBody body;
    body.vertices = range.vertices;
    const Index count = range.vertices.count;
    const auto number = [&](Index k) {
        return vertex_order.empty() ? range.vertices.first + k : vertex_order[static_cast<std::size_t>(k)];
    };
    const auto point_of = [&](Index k) { return frame.position.col(number(k)); };
    body.block_begin.push_back(0);
    while (body.block_begin.back() < count) {
        const Index begin = body.block_begin.back();
        body.block_begin.push_back(end_of_block(point_of, begin, std::min(begin + block_size, count)));
    }
    body.block_count = static_cast<Index>(body.block_begin.size()) - 1;
    body.block_of.resize(static_cast<std::size_t>(count));
    for (Index block = 0; block < body.block_count; ++block) {
        for (Index k = body.block_begin[static_cast<std::size_t>(block)];
             k < body.block_begin[static_cast<std::size_t>(block) + 1]; ++k) {
            body.block_of[static_cast<std::size_t>(number(k) - range.vertices.first)] = block;
        }
    }
    // Ascending within a block, in the order of memory.
    for (Index block = 0; block < body.block_count && !vertex_order.empty(); ++block) {
        const auto place = [&](Index at) {
            return vertex_order.begin() + body.block_begin[static_cast<std::size_t>(at)];
        };
        std::sort(place(block), place(block + 1));
    }
    body.vertex_order = std::move(vertex_order);
    return body;
}

/// Lists the vertices and blocks of one group and of its clusters. `place` is scratch, one number per vertex of the
/// body, -1 before and after.
void list_group(const Topology& topology, Index group, std::vector<Index>& place, ClusteredBody& body) {
    constexpr std::size_t most = 3 * static_cast<std::size_t>(fan) * static_cast<std::size_t>(fan);
    const Index first_cluster = group * fan;
    const Index end_cluster = std::min(first_cluster + fan, body.cluster_count);
    const auto place_of = [&](Index v) -> Index& { return place[static_cast<std::size_t>(v - body.vertices.first)]; };
    const auto corner_of = [&](Index at, Eigen::Index k) {
        while (body.triangle[static_cast<std::size_t>(at)] < 0) --at;
        return topology.triangles(k, body.triangle[static_cast<std::size_t>(at)]);
    };
    std::vector<Index> vertices;
    vertices.reserve(most);
    for (Index at = first_cluster * fan; at < end_cluster * fan; ++at) {
        for (Eigen::Index k = 0; k < 3; ++k) {
            const Index v = corner_of(at, k);
            if (std::exchange(place_of(v), 0) < 0) vertices.push_back(v);
        }
    }
    std::sort(vertices.begin(), vertices.end());
    append(vertices, body.vertices_of_group);
    std::vector<Index> blocks;
    blocks.reserve(vertices.size());
    for (std::size_t k = 0; k < vertices.size(); ++k) {
        place_of(vertices[k]) = static_cast<Index>(k);
        blocks.push_back(body.block_of[static_cast<std::size_t>(vertices[k] - body.vertices.first)]);
    }
    sort_unique(blocks);
    append(blocks, body.blocks_of_group);
    for (Index cluster = first_cluster; cluster < end_cluster; ++cluster) {
        std::bitset<most> used;
        ClusterCorners corners{};
        for (std::size_t t = 0; t < fan; ++t) {
            for (std::size_t k = 0; k < 3; ++k) {
                const Index at =
                    place_of(corner_of(cluster * fan + static_cast<Index>(t), static_cast<Eigen::Index>(k)));
                corners[t][k] = static_cast<std::uint16_t>(at);
                used.set(static_cast<std::size_t>(at));
            }
        }
        for (std::size_t at = 0; at < vertices.size(); ++at) {
            if (used.test(at)) body.vertices_of_cluster.member.push_back(static_cast<std::uint16_t>(at));
        }
        body.vertices_of_cluster.close();
        body.corners.push_back(corners);
    }
    for (const Index v : vertices) place_of(v) = -1;
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

/// Makes clusters, groups and regions of triangles in this order, over the blocks of `body`.
void make_clusters(const Topology& topology, const std::vector<Index>& triangle_order, ClusteredBody& body) {
    body.triangle = triangle_order;
    while (body.triangle.size() % fan != 0) body.triangle.push_back(-1);
    body.cluster_count = static_cast<Index>(body.triangle.size()) / fan;
    body.group_count = runs_of(body.cluster_count, fan);
    body.region_count = runs_of(body.group_count, fan);
    body.corners.reserve(static_cast<std::size_t>(body.cluster_count));
    std::vector<Index> place(static_cast<std::size_t>(body.vertices.count), -1);
    for (Index group = 0; group < body.group_count; ++group) list_group(topology, group, place, body);
    list_regions(body);
}

/// Ratio by which the frame's own vertex order enlarges groups of `triangle_order`. Numerator: sum over the groups of
/// the longest edge of the box around their blocks. Denominator: the same for the box around their own vertices.
double looseness(const Topology& topology, const Frame& frame, const std::vector<Index>& triangle_order,
                 const ClusteredBody& blocks) {
    std::vector<Box> block(static_cast<std::size_t>(blocks.block_count));
    const auto block_of = [&](Index v) {
        return static_cast<std::size_t>(blocks.block_of[static_cast<std::size_t>(v - blocks.vertices.first)]);
    };
    for (Index v = blocks.vertices.first; v < blocks.vertices.end(); ++v) block[block_of(v)].add(frame.position.col(v));
    const auto longest = [](const Box& box) { return (box.max - box.min).maxCoeff(); };
    double sum = 0.0;
    double least = 0.0;
    constexpr std::size_t triangles = static_cast<std::size_t>(fan) * static_cast<std::size_t>(fan);
    for (std::size_t first = 0; first < triangle_order.size(); first += triangles) {
        Box loose;
        Box tight;
        const std::size_t end = std::min(first + triangles, triangle_order.size());
        for (std::size_t at = first; at < end; ++at) {
            for (const Index v : topology.triangles.col(triangle_order[at])) {
                tight.add(frame.position.col(v));
                loose.add(block[block_of(v)]);
            }
        }
        sum += longest(loose);
        least += longest(tight);
    }
    return sum / least;
}

}  // namespace

ClusteredBody cluster_body(const Topology& topology, const Frame& frame, const BodyRange& range, ClusterOrder order) {
    ClusteredBody body = make_blocks(frame, range, {});
    if (order == ClusterOrder::given) {
        make_clusters(topology, given_order(range.triangles), body);
        return body;
    }
    const auto point = [&frame](Index v) -> Vector3 { return frame.position.col(v); };
    const auto centre = [&](Index t) -> Vector3 {
        return (point(topology.triangles(0, t)) + point(topology.triangles(1, t)) + point(topology.triangles(2, t))) /
               3.0;
    };
    const std::vector<Index> triangle_order = compact_order(range.triangles.first, range.triangles.count, centre);
    // The frame's own vertex order is read as a stream, the other one vertex by vertex. That is costly where a core's
    // own cache (1 MB and more) does not hold them.
    const double worth_a_stream = range.vertices.count > 40000 ? 8.0 : 4.0;
    const double loose = looseness(topology, frame, triangle_order, body);
    if (order == ClusterOrder::local || !(loose <= worth_a_stream)) {
        body = make_blocks(frame, range, compact_order(range.vertices.first, range.vertices.count, point));
    }
    make_clusters(topology, triangle_order, body);
    return body;
}

}  // namespace trocar
