// A run for pictures and exports: the very run of a record, or a recording, frame by frame with what colours it (depth,
// strain, displacement) and what acted in it (contacts, forces, loads on tools). Everything reported depth comes from
// truth in measure/, never from a method.
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

/// Who reports a contact, and how it acts.
enum class ActingKind : std::uint8_t {
    found,       ///< reported by the contact generator; what came of it stands in the entries of the other kinds
    pushed,      ///< a contact force law of the response, with the force that the stepper handed back
    held_force,  ///< a force that the response holds on a vertex over the tick
    placed       ///< a vertex that the response puts somewhere; no force is reported
};
/// "found", "pushed", "held_force", "placed".
const char* name_of(ActingKind kind);

/// One contact of a tick. Points are those of the frame shown, so that arrows start on what is drawn; depth and normal
/// are what the teller said at the start of the tick.
struct PlayedContact {
    static constexpr double unset = std::numeric_limits<double>::quiet_NaN();
    ActingKind kind = ActingKind::found;
    Index body = -1;                            ///< found: body_a; else the one that is pushed
    Index other = -1;                           ///< the one it touches; -1: not reported
    Vector3 point = Vector3::Constant(unset);   ///< m, world
    Vector3 normal = Vector3::Constant(unset);  ///< unit; found: from body to other; pushed: the way body is pushed
    double depth = unset;                       ///< m, >= 0; NaN: not reported (held_force, placed)
    Vector3 force = Vector3::Constant(unset);   ///< N, on `body`, mean over the tick; NaN: not reported (found, placed)
};

/// Load of contact on an instrument, mean over the tick. Bodies that one operator leads share their sum.
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
    Matrix3X displacement;   ///< 3×N, m: position less that of the first frame, where tissue rests
    /// N, m, >= 0: how far the vertex is inside the closed bodies or beyond the open sheets that its body is tested
    /// against, the deepest of them, by DepthTruth on this frame; NaN where truth leaves the side open. Between the
    /// vertices something may be deeper: row.residual_penetration looks there too.
    std::vector<double> depth;
    /// N, 1: of the springs at the vertex the strain (length / rest - 1) that is largest in size, with its sign:
    /// positive stretched, negative compressed. 0 for vertices that are no tissue. A recording has no springs: its
    /// tissue's edges are held against their lengths on the first frame.
    std::vector<double> strain;
    std::vector<PlayedContact> contacts;  ///< found ones, then those that penetrate or push; empty of a recording
    std::vector<PlayedTool> tools;        ///< one per instrument; empty of a replay and a recording
    StepRow row;                          ///< what the record reports the tick; of a recording tick and time alone
    /// m, largest finite entry of `depth`; 0 without any.
    [[nodiscard]] double deepest_vertex() const;
};

/// Which ticks are wanted.
struct PlaybackChoice {
    std::int64_t every = 1;                ///< ticks 0, n, 2n, …; 0: none of these
    std::vector<std::int64_t> ticks = {};  ///< and these
    bool deepest = false;  ///< and the one with the largest row.residual_penetration, else deepest_vertex()
    bool last = false;     ///< and the last one that ended well
};

/// Called with wanted frames: those of `every` and `ticks` as they come, then, where they have not come yet, the
/// deepest and the last one. The frame is reused: copy what shall stay.
using PlayedFrameVisitor = std::function<void(const PlayedFrame&)>;

/// Runs the specification once more, with its overrides, and shows its frames. The run is that of make_run: the
/// record's state_hash (of a replay: frames_hash) equals that of a record of the same specification. "paced" and
/// "cost_by_size" are run without a clock and without judging, which changes no bit of the motion. A tick that fails is
/// not shown. Throws InputError as make_run, and for modes that have no single motion ("metamorphic test",
/// "triangle_pair").
Record play(const Scene& scene, const RunSpec& spec, const RunLimits& limits, const PlaybackChoice& choice,
            const PlayedFrameVisitor& visit);

/// The frames of a recording, without contacts and tools. `progress` as RunLimits::progress; false ends it early.
/// Returns the number of frames gone through. Throws InputError as RecordingReader, and for a frame that is not finite.
std::int64_t play_recording(const std::filesystem::path& file, const PlaybackChoice& choice,
                            const PlayedFrameVisitor& visit, const std::function<bool(std::int64_t)>& progress = {});

}  // namespace trocar
