#include "detect/clustered_bodies.hpp"

#include <algorithm>
#include <utility>

namespace trocar {
namespace {

bool finite(const Frame& frame, Range range) {
    return (frame.position.middleCols(range.first, range.count).array() * 0.0).sum() == 0.0;
}

}  // namespace

void ClusteredBodies::prepare(const Topology& topology) {
    topology_ = &topology;
    tested_.assign(static_cast<std::size_t>(topology.body_count()), false);
    for (const auto& [a, b] : topology.body_pairs) {
        tested_[static_cast<std::size_t>(a)] = true;
        tested_[static_cast<std::size_t>(b)] = true;
    }
}

void ClusteredBodies::build(const Frame& frame) {
    bodies_.clear();
    unused_vertices_.clear();
    for (Index body = 0; body < topology_->body_count(); ++body) {
        const BodyRange& range = topology_->bodies[static_cast<std::size_t>(body)];
        if (!tested_[static_cast<std::size_t>(body)] || range.triangles.count == 0) {
            unused_vertices_.push_back(range.vertices);
            continue;
        }
        MovingBody moving;
        moving.body = body;
        moving.clusters = cluster_body(*topology_, frame, range, settings_.order);
        bodies_.push_back(std::move(moving));
    }
    std::stable_partition(bodies_.begin(), bodies_.end(), [this](const MovingBody& moving) {
        return !settings_.limited() ||
               topology_->bodies[static_cast<std::size_t>(moving.body)].kind == BodyKind::instrument;
    });
    place_of_triangle_.assign(static_cast<std::size_t>(topology_->triangle_count()), -1);
    owner_of_body_.assign(static_cast<std::size_t>(topology_->body_count()), -1);
    region_count_ = 0;
    group_count_ = 0;
    for (std::size_t owner = 0; owner < bodies_.size(); ++owner) {
        MovingBody& moving = bodies_[owner];
        owner_of_body_[static_cast<std::size_t>(moving.body)] = static_cast<Index>(owner);
        moving.boxes = std::make_unique<BlockBoxes>(moving.clusters, kernels_);
        moving.first_region = region_count_;
        moving.first_group = group_count_;
        region_count_ += static_cast<std::size_t>(moving.clusters.region_count);
        group_count_ += static_cast<std::size_t>(moving.clusters.group_count);
        for (std::size_t place = 0; place < moving.clusters.triangle.size(); ++place) {
            const Index t = moving.clusters.triangle[place];
            if (t >= 0) place_of_triangle_[static_cast<std::size_t>(t)] = static_cast<Index>(place);
        }
    }
    unused_moved_.reserve(unused_vertices_.empty() ? 0 : ordinary_contact);
}

std::int64_t ClusteredBodies::ask(const std::vector<Range>& ranges) {
    unused_moved_.clear();
    std::int64_t vertices = 0;
    for (const Range& unused : unused_vertices_) {
        for (const Range& range : ranges) {
            const Index first = std::max(range.first, unused.first);
            const Index end = std::min(range.end(), unused.end());
            if (first >= end) continue;
            unused_moved_.push_back({first, end - first});
            vertices += end - first;
        }
    }
    for (const MovingBody& moving : bodies_) vertices += moving.boxes->ask(ranges, clock_.now + 1);
    return vertices;
}

bool ClusteredBodies::two_rest_in_part() const {
    return std::count_if(bodies_.begin(), bodies_.end(),
                         [this](const MovingBody& moving) { return !clock_.moved(moving.boxes->all_moved_at()); }) > 1;
}

bool ClusteredBodies::read(const Frame& frame, bool whole) {
    bool all_finite = true;
    for (const Range& range : whole ? unused_vertices_ : unused_moved_) all_finite &= finite(frame, range);
    for (const MovingBody& moving : bodies_) {
        if (settings_.swept) {
            all_finite &= moving.boxes->read_swept(frame, clock_.path, clock_.now);
        } else if (whole) {
            all_finite &= moving.boxes->read_all(frame, clock_.now);
        } else {
            all_finite &= moving.boxes->read_asked(frame, clock_.now);
        }
    }
    return all_finite;
}

}  // namespace trocar
