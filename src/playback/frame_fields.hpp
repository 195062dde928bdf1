// Depth, strain and displacement of every vertex on a frame, from geometry alone.
#pragma once

#include <vector>

#include "measure/depth_truth.hpp"
#include "playback/playback.hpp"
#include "scene/world.hpp"

namespace trocar {

class FrameFields {
public:
    /// `springs`: those of the scene. The topology outlives the object.
    FrameFields(const Topology& topology, const Frame& first, const std::vector<Spring>& springs);

    /// Fills tick, time, hash, position, displacement, depth and strain. Call with every frame, in order: the side of
    /// an open sheet depends on the motion.
    void fill(const Frame& frame, PlayedFrame& played);

private:
    const Topology* topology_;
    Matrix3X first_;
    std::vector<Spring> springs_;
    DepthTruth truth_;
};

/// The edges of all tissue triangles as springs at rest on this frame.
std::vector<Spring> edges_at_rest(const Topology& topology, const Frame& frame);

}  // namespace trocar
