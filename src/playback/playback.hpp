// A record's run or a recording, frame by frame, for pictures and exports. Each frame has fields (depth, strain,
// displacement), contacts, forces and loads on tools. Depth comes from truth in measure/, never from a method.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "measure/record.hpp"
#include "scene/scene.hpp"
#include "simulate/runs.hpp"

namespace trocar {

/// Origin of a contact and how it acts.
enum class ActingKind : std::uint8_t {
    found,       ///< reported by the contact generator; its forces are entries of the other kinds
    pushed,      ///< a contact force law of the response, with the force that the stepper returned
    held_force,  ///< a force of the response on a vertex, constant over the tick
    placed       ///< a vertex that the response places; without a force
};
/// "found", "pushed", "held_force", "placed".
const char* name_of(ActingKind kind);

/// One contact of a tick. Points are those of the frame shown, so that arrows start on the drawn surface. Depth and
/// normal are those at the start of the tick.
struct PlayedContact {
    ActingKind kind = ActingKind::found;
    Index body = -1;                                ///< found: body_a; else the one that is pushed
    Index other = -1;                               ///< the one it touches; -1: unknown
    Vector3 point = Vector3::Constant(not_known);   ///< m, world
    Vector3 normal = Vector3::Constant(not_known);  ///< unit; found: from body to other; pushed: direction of the push
    double depth = not_known;                       ///< m, >= 0; NaN: unknown (held_force, placed)
    Vector3 force = Vector3::Constant(not_known);   ///< N, on `body`, mean over the tick; NaN: unknown (found, placed)
};

/// Load of contact on an instrument, mean over the tick. Bodies of one operator share their sum.
struct PlayedTool {
    Index body = -1;
    Vector3 tip = Vector3::Zero();     ///< m, world, at the start of the tick
    Vector3 force = Vector3::Zero();   ///< N, on the tool, world
    Vector3 moment = Vector3::Zero();  ///< N m, about the tip, world
};

/// The world after one tick (of a replay or a recording: the frame given).
struct PlayedFrame {
    std::int64_t tick = -1;
    double time = 0.0;       ///< s
    std::uint64_t hash = 0;  ///< Frame::hash; the last frame's is the record's state_hash
    Matrix3X position;       ///< 3×N, m, world; all bodies, numbered as in the topology
    Matrix3X displacement;   ///< 3×N, m: from the first frame, where tissue is at rest.
    /// N entries, m, >= 0: depth by DepthTruth on this frame, the largest over the bodies and sheets that the vertex'
    /// body is tested against. NaN where the side is undecided. Points between the vertices may be deeper;
    /// row.residual_penetration includes them.
    std::vector<double> depth;
    /// N entries, 1: strain (length / rest - 1) of largest absolute value over the springs at the vertex; positive:
    /// stretched. 0 off tissue. A recording has no springs: its strain is relative to the edge lengths of the first
    /// frame.
    std::vector<double> strain;
    std::vector<PlayedContact> contacts;  ///< found ones, then those that penetrate or push; empty of a recording
    std::vector<PlayedTool> tools;        ///< one per instrument; empty of a replay and a recording
    StepRow row;                          ///< the record's row; of a recording, tick and time alone
    /// m, largest finite entry of `depth`; 0 without any.
    [[nodiscard]] double deepest_vertex() const;
};

/// Selection of ticks.
struct PlaybackChoice {
    std::int64_t every = 1;                ///< ticks 0, n, 2n, …; 0: none of these
    std::vector<std::int64_t> ticks = {};  ///< and these
    bool deepest = false;  ///< and the one with the largest row.residual_penetration, else deepest_vertex()
    bool last = false;     ///< and the last one with outcome ok
};

/// Called with selected frames: those of `every` and `ticks` in order, then the deepest and the last one unless they
/// were among them. The frame is reused; copy what must persist.
using PlayedFrameVisitor = std::function<void(const PlayedFrame&)>;

/// Repeats the run of a specification, with its overrides, and visits its frames. state_hash (of a replay: frames_hash)
/// equals that of the record that make_run returns. `paced` and `cost_by_size` run without a clock and without judging,
/// which changes no bit of the motion. A failed tick is not visited. Throws InputError as make_run, and for modes
/// without a single motion (`metamorphic`).
Record play(const Scene& scene, const RunSpec& spec, const RunLimits& limits, const PlaybackChoice& choice,
            const PlayedFrameVisitor& visit);

/// Visits the frames of a recording, without contacts and tools. `progress` as RunLimits::progress; false ends it
/// early. Returns the number of frames read. Throws InputError as RecordingReader, and for a frame that is not finite.
std::int64_t play_recording(const std::filesystem::path& file, const PlaybackChoice& choice,
                            const PlayedFrameVisitor& visit, const std::function<bool(std::int64_t)>& progress = {});

}  // namespace trocar
