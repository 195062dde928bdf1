#include "playback/frame_fields.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace trocar {

FrameFields::FrameFields(const Topology& topology, const Frame& first, const std::vector<Spring>& springs,
                         const DepthTruth* followed)
    : topology_(&topology), first_(first.position), springs_(springs), truth_(followed) {
    if (followed == nullptr) truth_ = &own_.emplace(topology, first, std::span<const std::uint8_t>(), 0);  // vertices
}

void FrameFields::fill(const Frame& frame, PlayedFrame& played) {
    const auto count = static_cast<std::size_t>(topology_->vertex_count);
    played.tick = frame.tick;
    played.time = frame.time;
    played.hash = frame.hash();
    played.position = frame.position;
    played.displacement = frame.position - first_;
    if (own_) own_->follow(frame);
    played.depth.assign(count, 0.0);
    truth_->each_sample([&played](const DepthTruth::Judgement& sample) {
        if (sample.vertex < 0) return;
        double& depth = played.depth[static_cast<std::size_t>(sample.vertex)];
        // What is open towards one body is no answer, however clear the others are.
        depth = std::isnan(sample.depth) || std::isnan(depth) ? std::nan("") : std::max(depth, sample.depth);
    });
    played.strain.assign(count, 0.0);
    for (const Spring& spring : springs_) {
        const double strain = (frame.position.col(spring.j) - frame.position.col(spring.i)).norm() / spring.rest - 1.0;
        for (const Index end : {spring.i, spring.j}) {
            double& largest = played.strain[static_cast<std::size_t>(end)];
            if (std::abs(strain) > std::abs(largest)) largest = strain;
        }
    }
}

std::vector<Spring> edges_at_rest(const Topology& topology, const Frame& frame) {
    std::set<std::array<Index, 2>> edges;
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
            for (int corner = 0; corner < 3; ++corner) {
                const Index a = topology.triangles(corner, t);
                const Index b = topology.triangles((corner + 1) % 3, t);
                edges.insert({std::min(a, b), std::max(a, b)});
            }
        }
    }
    std::vector<Spring> springs;
    for (const auto& [i, j] : edges) {
        const double rest = (frame.position.col(j) - frame.position.col(i)).norm();
        if (rest > 0.0) springs.push_back({.i = i, .j = j, .rest = rest});
    }
    return springs;
}

}  // namespace trocar
