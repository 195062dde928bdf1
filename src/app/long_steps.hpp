// Detects frame steps longer than a feature. Discrete detectors miss features that pass each other between two frames.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/world.hpp"

namespace trocar::app {

/// Steps of a recording that are longer than the mean edge.
struct LongSteps {
    std::int64_t frames = 0;  ///< frames with such a step
    std::int64_t tick = -1;   ///< frame after the longest step, from 0
    Index body = -1;          ///< body with the longest step
    double step = 0.0;        ///< m
    double edge = 0.0;        ///< m, mean edge that it is compared with
};

/// Examines frames in order. A step is the largest displacement of a vertex of one body relative to the mean motion of
/// another. Only tested body pairs with overlapping swept boxes count. It is long when it exceeds the shorter mean edge
/// of the two bodies in the previous frame.
class LongStepWatch {
public:
    explicit LongStepWatch(const Topology& topology) : topology_(&topology) {}
    /// frame.previous is the previous frame. Frames that are not finite are skipped.
    void observe(const Frame& frame);
    [[nodiscard]] const LongSteps& steps() const { return steps_; }

private:
    struct BodyMotion {
        Box swept;
        Vector3 mean = Vector3::Zero();  ///< m, mean displacement of the vertices
        double edge = 0.0;               ///< m, mean edge; 0 without triangles
    };
    [[nodiscard]] BodyMotion motion_of(const Frame& frame, const BodyRange& body) const;
    [[nodiscard]] double furthest(const Frame& frame, const BodyRange& body, const Vector3& against) const;

    const Topology* topology_;
    LongSteps steps_;
    std::vector<BodyMotion> motions_;
};

/// One line for the user; empty without long steps.
std::string long_step_note(const LongSteps& steps, const Topology& topology);

}  // namespace trocar::app
