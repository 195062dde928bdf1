#include "contact_generation/feature_mesh.hpp"

#include <algorithm>
#include <tuple>

namespace trocar {

void FeatureMesh::prepare(const Topology& topology) {
    topology_ = &topology;
    const Index triangles = topology.triangle_count();
    // (smaller end, larger end, triangle, edge within the triangle)
    std::vector<std::tuple<Index, Index, Index, int>> sides;
    sides.reserve(at(triangles) * 3);
    for (Index t = 0; t < triangles; ++t) {
        for (int i = 0; i < 3; ++i) {
            const auto [u, v] = std::minmax({topology.triangles(i, t), topology.triangles((i + 1) % 3, t)});
            sides.emplace_back(u, v, t, i);
        }
    }
    std::sort(sides.begin(), sides.end());
    edges_of_.assign(at(triangles), {-1, -1, -1});
    ends_.clear();
    for (const auto& [u, v, t, i] : sides) {
        if (ends_.empty() || ends_.back()[0] != u || ends_.back()[1] != v) ends_.push_back({u, v});
        edges_of_[at(t)][static_cast<std::size_t>(i)] = edge_count() - 1;
    }
    faces_at_edge_.fill(edge_count(), [this, triangles](const auto& act) {
        for (Index t = 0; t < triangles; ++t) {
            for (const Index e : edges_of(t)) act(e, t);
        }
    });
    faces_at_vertex_.fill(topology.vertex_count, [&topology, triangles](const auto& act) {
        for (Index t = 0; t < triangles; ++t) {
            for (int i = 0; i < 3; ++i) act(topology.triangles(i, t), t);
        }
    });
    edges_at_vertex_.fill(topology.vertex_count, [this](const auto& act) {
        for (Index e = 0; e < edge_count(); ++e) {
            for (const Index v : ends(e)) act(v, e);
        }
    });
}

}  // namespace trocar
