// State at the start of a tick, to which gaps and normals refer. Scripted bodies have not yet moved in this tick; all
// else is where the last tick left it.
#pragma once

#include "geometry/exact.hpp"
#include "scene/world.hpp"

namespace trocar {

class TickStart {
public:
    TickStart(const Topology& topology, const Frame& frame) : topology_(&topology), frame_(&frame) {}

    [[nodiscard]] bool is_tissue(Index body) const { return range(body).kind == BodyKind::tissue; }
    /// m, world.
    [[nodiscard]] Vector3 position(Index vertex, Index body) const {
        if (is_tissue(body)) return frame_->position.col(vertex);
        if (frame_->operator_motion.empty()) return frame_->previous.col(vertex);
        return frame_->previous.col(vertex) + frame_->operator_motion[static_cast<std::size_t>(body)];
    }
    /// m, world, of a triangle of the body.
    [[nodiscard]] Corners corners(Index triangle, Index body) const {
        const auto corner = topology_->triangles.col(triangle);
        return {position(corner[0], body), position(corner[1], body), position(corner[2], body)};
    }
    /// m, scripted motion of the vertex within this tick.
    [[nodiscard]] Vector3 scripted(Index vertex, Index body) const {
        if (is_tissue(body)) return Vector3::Zero();
        return frame_->position.col(vertex) - position(vertex, body);
    }
    [[nodiscard]] const Frame& frame() const { return *frame_; }
    [[nodiscard]] const Topology& topology() const { return *topology_; }

private:
    [[nodiscard]] const BodyRange& range(Index body) const { return topology_->bodies[static_cast<std::size_t>(body)]; }
    const Topology* topology_;
    const Frame* frame_;
};

}  // namespace trocar
