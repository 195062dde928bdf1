#include "tissue/body_boxes.hpp"

#include <algorithm>

namespace trocar {

BodyBoxes::BodyBoxes(const Topology& topology)
    : topology_(&topology), places_(topology.bodies.size()), opposite_(topology.bodies.size()) {
    for (const auto& [a, b] : topology.body_pairs) {
        opposite_[at(a)].push_back(b);
        opposite_[at(b)].push_back(a);
    }
    for (const std::vector<Index>& others : opposite_) {
        has_opposite_tissue_.push_back(
            std::any_of(others.begin(), others.end(),
                        [&](Index other) { return topology.bodies[at(other)].kind == BodyKind::tissue; })
                ? 1
                : 0);
    }
}

void BodyBoxes::start(const Frame& frame) {
    for (Index body = 0; body < topology_->body_count(); ++body) take(body, frame);
}

void BodyBoxes::follow(const Frame& frame) {
    for (Index body = 0; body < topology_->body_count(); ++body) {
        const BodyRange& range = topology_->bodies[at(body)];
        if (range.kind == BodyKind::tissue) continue;
        const bool moved = !frame.moved || std::any_of(frame.moved->begin(), frame.moved->end(), [&](const Range& one) {
            return one.first < range.vertices.end() && range.vertices.first < one.end();
        });
        if (moved) take(body, frame);
    }
}

void BodyBoxes::take(Index body, const Frame& frame) {
    Place& place = places_[at(body)];
    place = {};
    if (at(body) < frame.pose.size()) {
        place.to_own = frame.pose[at(body)].rotation.toRotationMatrix().transpose();
        place.origin = frame.pose[at(body)].translation;
    }
    const Range& vertices = topology_->bodies[at(body)].vertices;
    for (Index v = vertices.first; v < vertices.end(); ++v) {
        place.box.add(place.to_own * (frame.position.col(v) - place.origin));
    }
}

void BodyBoxes::extend(Index body, const Vector3& point) {
    Place& place = places_[at(body)];
    place.box.add(place.to_own * (point - place.origin));
}

bool BodyBoxes::may_meet(Index body, const Vector3& from, const Vector3& to, double distance) const {
    if (opposite_[at(body)].empty()) return true;
    return std::any_of(opposite_[at(body)].begin(), opposite_[at(body)].end(), [&](Index other) {
        const Place& place = places_[at(other)];
        const Box path = box_of(place.to_own * (from - place.origin), place.to_own * (to - place.origin));
        return path.grown(distance).overlaps(place.box);
    });
}

}  // namespace trocar
