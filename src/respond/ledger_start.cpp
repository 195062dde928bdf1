// How the crossing ledger begins: the points on long edges that it follows besides the vertices, and which side of the
// tissue everything is on at the first call.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geometry/signed_crossing.hpp"
#include "respond/common.hpp"
#include "respond/crossing_ledger.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Edges of a body, each once, u < v, sorted.
std::vector<std::array<Index, 2>> edges_of(const Topology& topology, Range triangles) {
    std::vector<std::array<Index, 2>> edges;
    edges.reserve(at(triangles.count) * 3);
    for (Index t = triangles.first; t < triangles.end(); ++t) {
        for (int i = 0; i < 3; ++i) {
            const auto [u, v] = std::minmax({topology.triangles(i, t), topology.triangles((i + 1) % 3, t)});
            edges.push_back({u, v});
        }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

double length(const Matrix3X& position, const std::array<Index, 2>& edge) {
    return (position.col(edge[1]) - position.col(edge[0])).norm();
}

}  // namespace

/// Half a tissue edge apart.
void CrossingLedger::add_edge_samples(const Topology& topology, const Frame& frame) {
    constexpr double most_per_edge = 64.0;
    double tissue_edge = 0.0;
    for (const Tissue& tissue : tissues_) {
        if (tissue.edge > 0.0 && (tissue_edge == 0.0 || tissue.edge < tissue_edge)) tissue_edge = tissue.edge;
    }
    if (!(tissue_edge > 0.0)) return;
    Index key = topology.vertex_count;
    for (Index body = 0; body < topology.body_count(); ++body) {
        const BodyRange& range = topology.bodies[at(body)];
        if (range.kind == BodyKind::tissue || range.vertices.count == 0 ||
            sample_of_vertex_[at(range.vertices.first)] < 0)
            continue;
        for (const auto& edge : edges_of(topology, range.triangles)) {
            const double edge_length = length(frame.position, edge);
            if (!(edge_length > tissue_edge)) continue;
            const auto parts = static_cast<int>(std::min(std::ceil(2.0 * edge_length / tissue_edge), most_per_edge));
            const auto first = static_cast<Index>(samples_.size());
            for (int part = 1; part < parts; ++part) {
                samples_.push_back({.vertex = edge[0],
                                    .other = edge[1],
                                    .fraction = static_cast<double>(part) / parts,
                                    .body = body,
                                    .key = key++});
            }
            edges_.push_back({edge[0], edge[1], {first, static_cast<Index>(samples_.size()) - first}});
        }
    }
    for (Tissue& tissue : tissues_) {
        tissue.count.resize(samples_.size(), 0);
        tissue.layers.resize(samples_.size());
    }
}

void CrossingLedger::find_start(const Topology& topology, const Frame& frame, const ContactSet& contacts) {
    const Index bodies = topology.body_count();
    std::vector<std::uint8_t> crossing(at(bodies * bodies), 0);
    for (const Contact& contact : contacts.contacts) {
        if (contact.a < 0 || contact.b < 0 || contact.kind == ContactCase::touch) continue;
        const Index a = topology.body_of_triangle[at(contact.a)];
        const Index b = topology.body_of_triangle[at(contact.b)];
        crossing[at(a * bodies + b)] = crossing[at(b * bodies + a)] = 1;
    }
    for (Tissue& tissue : tissues_) {
        for (Index body = 0; body < bodies; ++body) {
            if (tested_[at(body * bodies + tissue.body)] == 0) continue;
            if (!tissue.closed) {
                if (crossing[at(body * bodies + tissue.body)] != 0) {
                    find_start_by_crossings(topology, frame, tissue, body);
                }
                continue;
            }
            const Range vertices = topology.bodies[at(body)].vertices;
            for (Index v = vertices.first; v < vertices.end(); ++v) {
                const Vector3 x = frame.position.col(v) + hair;
                Box box;
                box.add(x);
                if (!box.overlaps(tissue.grid.bounds())) continue;
                const double winding =
                    winding_number(frame.position, topology.triangles, topology.bodies[at(tissue.body)].triangles, x);
                tissue.count[at(sample_of_vertex_[at(v)])] = static_cast<std::int16_t>(std::lround(winding));
            }
        }
        // Along an edge every crossing changes the count.
        for (const SampledEdge& edge : edges_) {
            const Vector3 from = frame.position.col(edge.u) + hair;
            const int start = tissue.count[at(sample_of_vertex_[at(edge.u)])];
            for (Index s = edge.samples.first; s < edge.samples.end(); ++s) {
                const Vector3 to = samples_[at(s)].of(frame.position) + hair;
                tissue.count[at(s)] = static_cast<std::int16_t>(start + crossings(topology, frame, tissue, from, to));
            }
        }
    }
}

/// Along the edges of the body from vertex to vertex: every edge that passes through the sheet changes the count. What
/// hangs together is thus known up to one number, which the first edge through the sheet settles: its end on the
/// declared side has count 0.
void CrossingLedger::find_start_by_crossings(const Topology& topology, const Frame& frame, Tissue& tissue, Index body) {
    const BodyRange& range = topology.bodies[at(body)];
    std::vector<std::array<Index, 2>> edges = edges_of(topology, range.triangles);
    const std::size_t one_way = edges.size();
    for (std::size_t e = 0; e < one_way; ++e) edges.push_back({edges[e][1], edges[e][0]});
    std::sort(edges.begin(), edges.end());
    std::vector<std::uint8_t> seen(at(range.vertices.count), 0);
    std::vector<Index> connected;
    const bool belongs_in_front = topology.bodies[at(tissue.body)].start_side == SheetSide::front;
    for (Index first = range.vertices.first; first < range.vertices.end(); ++first) {
        if (seen[at(first - range.vertices.first)] != 0) continue;
        seen[at(first - range.vertices.first)] = 1;
        connected.assign(1, first);
        bool settled = false;
        int right = 0;  // count of what is on the declared side
        for (std::size_t next = 0; next < connected.size(); ++next) {
            const Index u = connected[next];
            const int count = tissue.count[at(sample_of_vertex_[at(u)])];
            for (auto edge = std::lower_bound(edges.begin(), edges.end(), std::array<Index, 2>{u, -1});
                 edge != edges.end() && (*edge)[0] == u; ++edge) {
                const Index v = (*edge)[1];
                if (seen[at(v - range.vertices.first)] != 0) continue;
                seen[at(v - range.vertices.first)] = 1;
                const Vector3 from = frame.position.col(u) + hair;
                const Vector3 to = frame.position.col(v) + hair;
                const int change = crossings(topology, frame, tissue, from, to);
                tissue.count[at(sample_of_vertex_[at(v)])] = static_cast<std::int16_t>(count + change);
                if (change != 0 && !settled) {
                    settled = true;
                    // +1: u is in front and v behind.
                    right = (change > 0) == belongs_in_front ? count : count + change;
                }
                connected.push_back(v);
            }
        }
        for (const Index v : connected) {
            std::int16_t& count = tissue.count[at(sample_of_vertex_[at(v)])];
            count = static_cast<std::int16_t>(count - right);
        }
    }
}

}  // namespace trocar
