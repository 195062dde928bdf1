// Frames so far apart that features pass each other between them: what no detector that examines one frame at a time
// can report, and what a user of `replay` should know before he reads "0 missing".
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/world.hpp"

namespace trocar::app {

/// The steps of a recording that are longer than a feature, and the longest of them in edges.
struct LongSteps {
    std::int64_t frames = 0;  ///< to which some body took one
    std::int64_t tick = -1;   ///< frame that the longest leads to, from 0
    Index body = -1;          ///< that takes it
    double step = 0.0;        ///< m
    double edge = 0.0;        ///< m, that it is measured with
};

/// Examines frames in their order. A step is how far a vertex of one body goes against the mean motion of another body
/// that it is tested with, where the boxes round both frames overlap; it is long when it exceeds the shorter mean edge
/// of the two in the frame before.
class LongStepWatch {
public:
    explicit LongStepWatch(const Topology& topology) : topology_(&topology) {}
    /// frame.previous is the frame before; frames that are not finite are passed over.
    void observe(const Frame& frame);
    [[nodiscard]] const LongSteps& steps() const { return steps_; }

private:
    struct BodyMotion {
        Box swept;
        Vector3 mean = Vector3::Zero();  ///< m, of its vertices
        double edge = 0.0;               ///< m, mean; 0 without triangles
    };
    [[nodiscard]] BodyMotion motion_of(const Frame& frame, const BodyRange& body) const;
    [[nodiscard]] double furthest(const Frame& frame, const BodyRange& body, const Vector3& against) const;

    const Topology* topology_;
    LongSteps steps_;
    std::vector<BodyMotion> motions_;
};

/// One line that reports them; empty when there are none.
std::string long_step_note(const LongSteps& steps, const Topology& topology);

}  // namespace trocar::app
