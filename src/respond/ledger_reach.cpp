// The crossing ledger at a free rim. A rim that has slipped past a point that had crossed the tissue leaves nothing to
// clear there, though the point never came back through the tissue.
#include <algorithm>
#include <array>

#include "respond/crossing_ledger.hpp"

namespace trocar {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

/// Along the edges of instruments and rigid bodies, through the points on them. Notes the rims of the tissues, too.
void CrossingLedger::link_samples(const Topology& topology, const SurfaceNeighbours& surface) {
    for (Tissue& tissue : tissues_) {
        const Range triangles = topology.bodies[at(tissue.body)].triangles;
        tissue.rim.clear();
        for (Index t = triangles.first; t < triangles.end(); ++t) {
            for (int i = 0; i < 3; ++i) {
                if ((surface.rim_edges(t) & (1U << static_cast<unsigned>(i))) == 0) continue;
                tissue.rim.push_back({topology.triangles(i, t), topology.triangles((i + 1) % 3, t)});
            }
        }
    }
    std::vector<std::pair<Index, Index>> links;
    const auto link = [&links](Index a, Index b) {
        links.emplace_back(a, b);
        links.emplace_back(b, a);
    };
    for (const SampledEdge& edge : edges_) {
        link(sample_of_vertex_[at(edge.u)], edge.samples.first);
        for (Index s = edge.samples.first; s + 1 < edge.samples.end(); ++s) link(s, s + 1);
        link(edge.samples.end() - 1, sample_of_vertex_[at(edge.v)]);
    }
    for (const BodyRange& body : topology.bodies) {
        if (body.kind == BodyKind::tissue || body.vertices.count == 0 || sample_of_vertex_[at(body.vertices.first)] < 0)
            continue;
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            for (int i = 0; i < 3; ++i) {
                const Index u = topology.triangles(i, t);
                const Index v = topology.triangles((i + 1) % 3, t);
                if (sampled_edge(u, v) != nullptr) continue;
                link(sample_of_vertex_[at(u)], sample_of_vertex_[at(v)]);
            }
        }
    }
    std::sort(links.begin(), links.end());
    links.erase(std::unique(links.begin(), links.end()), links.end());
    first_link_.assign(samples_.size() + 1, 0);
    for (const auto& [from, to] : links) ++first_link_[at(from) + 1];
    for (std::size_t s = 0; s < samples_.size(); ++s) first_link_[s + 1] += first_link_[s];
    link_.clear();
    for (const auto& [from, to] : links) link_.push_back(to);
    reach_.assign(samples_.size(), Reach::unknown);
    crossed_.reserve(samples_.size());
    group_.reserve(samples_.size());
}

/// A rim that has moved since the start, so that nothing holds it.
bool CrossingLedger::free_rim_is_near(const Frame& frame, const Tissue& tissue) const {
    return std::any_of(tissue.rim.begin(), tissue.rim.end(), [&](const std::array<Index, 2>& edge) {
        const auto moved = [&](Index v) { return frame.position.col(v) != original_.col(v); };
        if (!moved(edge[0]) && !moved(edge[1])) return false;
        Box box;
        for (const Index v : edge) box.add(frame.position.col(v));
        return std::any_of(tissue.regions.begin(), tissue.regions.end(),
                           [&box](const Box& region) { return region.overlaps(box); });
    });
}

/// The way out of the sample's body.
Vector3 CrossingLedger::outwards_at(const LedgerSample& sample, const Topology& topology,
                                    const SurfaceNeighbours& surface, const Frame& frame) {
    Vector3 here = surface.vertex_normal(topology, frame.position, sample.vertex);
    if (sample.other < 0) return here;
    return (here + surface.vertex_normal(topology, frame.position, sample.other)).normalized();
}

/// Frees the samples past which a rim of an open sheet has slipped.
void CrossingLedger::free_slipped(const Topology& topology, const Frame& frame, Tissue& tissue) {
    crossed_.clear();
    for (std::size_t s = 0; s < samples_.size(); ++s) {
        if (tissue.count[s] != 0 && first_link_[s] != first_link_[s + 1]) crossed_.push_back(static_cast<Index>(s));
    }
    for (const Index s : crossed_) {
        if (reach_[at(s)] == Reach::unknown) free_group(at(s), topology, frame, tissue);
    }
}

/// The crossed samples that hang together with `first` along edges of their body. Where one of these edges leads to a
/// sample that has not crossed and none passes through the sheet, the rim has slipped past all of them, unless they
/// are the greater part of the body: their count is put right.
void CrossingLedger::free_group(std::size_t first, const Topology& topology, const Frame& frame, Tissue& tissue) {
    group_.assign(1, static_cast<Index>(first));
    reach_[first] = Reach::looked_at;
    bool reaches_right = false;
    bool passes = false;
    for (std::size_t g = 0; g < group_.size(); ++g) {
        const std::size_t s = at(group_[g]);
        const Vector3 from = samples_[s].of(frame.position) + hair;
        for (Index l = first_link_[s]; l < first_link_[s + 1]; ++l) {
            const std::size_t other = at(link_[at(l)]);
            if (crossings(topology, frame, tissue, from, samples_[other].of(frame.position) + hair) != 0) {
                passes = true;
            } else if (tissue.count[other] == 0) {
                reaches_right = true;
            } else if (reach_[other] == Reach::unknown) {
                reach_[other] = Reach::looked_at;
                group_.push_back(static_cast<Index>(other));
            }
        }
    }
    if (!reaches_right || passes) return;
    std::size_t right = 0;
    for (std::size_t s = 0; s < samples_.size(); ++s) {
        if (samples_[s].body == samples_[first].body && tissue.count[s] == 0) ++right;
    }
    if (right < group_.size()) return;
    for (const Index s : group_) {
        reach_[at(s)] = Reach::freed;
        tissue.count[at(s)] = 0;
        ++repairs_;
    }
}

}  // namespace trocar
