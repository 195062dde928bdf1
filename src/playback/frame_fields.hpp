// Depth, strain and displacement of every vertex on a frame, from geometry alone.
#pragma once

#include <optional>
#include <vector>

#include "measure/depth_truth.hpp"
#include "playback/playback.hpp"
#include "scene/world.hpp"

namespace trocar {

class FrameFields {
public:
    /// `springs`: those of the scene. `followed`: truth that follows the frames already; null: one of its own. Topology
    /// and truth outlive the object.
    FrameFields(const Topology& topology, const Frame& first, const std::vector<Spring>& springs,
                const DepthTruth* followed = nullptr);

    /// Fills tick, time, hash, position, displacement, depth and strain. Call with every frame, in order: the side of
    /// an open sheet depends on the motion. With `followed`: with frames that it has just followed.
    void fill(const Frame& frame, PlayedFrame& played);

private:
    const Topology* topology_;
    Matrix3X first_;
    std::vector<Spring> springs_;
    std::optional<DepthTruth> own_;
    const DepthTruth* truth_;
};

/// The edges of all tissue triangles as springs at rest on this frame.
std::vector<Spring> edges_at_rest(const Topology& topology, const Frame& frame);

}  // namespace trocar
