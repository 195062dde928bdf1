// Figures of frames that somebody else's simulator made, from the frames alone. Contacts and forces are not known, and
// nothing is said about them.
#pragma once

#include <cstdint>
#include <memory>

#include "measure/depth_truth.hpp"
#include "measure/step_row.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Knowledge about the first frame.
enum class FrameStart : std::uint8_t {
    clean,   ///< every body is on the right side of every open sheet
    unknown  ///< nothing: on which side of an open sheet a point is cannot be said
};

/// Figures of one frame.
struct FrameFigures {
    /// tick, time, true_pairs, true_touch, passed_through and the figures of DepthTruth; all else is unset. With an
    /// unknown start, figures of the wrong side are unset where a pair has an open sheet. Penetration is then that into
    /// closed bodies, and unset without one.
    StepRow row;
    std::int64_t self_intersections = -1;  ///< pairs of triangles of one body (geometry/mesh_report.hpp); -1: not asked
};

class FrameJudge {
public:
    /// `first`: the first frame, which is judged as all others. `self`: also looks for self-intersections. The topology
    /// outlives the object. Throws InputError when a clean start is claimed and `first` has surfaces that cross an open
    /// sheet; `place`: of its message.
    FrameJudge(const Topology& topology, const Frame& first, FrameStart start, bool self, const std::string& place);
    ~FrameJudge();
    FrameJudge(const FrameJudge&) = delete;
    FrameJudge& operator=(const FrameJudge&) = delete;
    FrameJudge(FrameJudge&&) = delete;
    FrameJudge& operator=(FrameJudge&&) = delete;

    /// Call with every frame, in order. A body whose points are where its best rigid motion takes them, up to 1e-5 of
    /// its size, has kept its shape (passage.hpp). A frame that is not finite gives unset figures.
    FrameFigures judge(const Frame& frame);

    /// Depths on the frame judged last.
    [[nodiscard]] const DepthTruth& depth_truth() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace trocar
