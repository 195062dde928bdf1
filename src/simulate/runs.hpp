// Runs a specification and returns its record. Judging happens outside every timed span.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "measure/record.hpp"
#include "scene/scene.hpp"
#include "simulate/simulation.hpp"

namespace trocar {

struct RunLimits {
    /// Called before every tick with the number of ticks done; false ends the run early.
    std::function<bool(std::int64_t)> progress = {};
    /// Closed loop and replay: called after every tick, outside the timed spans.
    std::function<void(const Simulation&, const StepRow&)> observe = {};
    /// False: a run with steps that are certainly unstable is not started and ends `unstable`. True: it runs. The
    /// record holds the reason ("run.unstable_step"). Hard cases always run, since instability may be their subject.
    bool allow_unstable_step = false;
    /// False: no energy and momentum audit and no stop on unstable contact (SimulationSettings::watched).
    bool watched = true;
    /// Ticks that truth judges.
    struct Judged {
        std::int64_t begin = 0;
        std::int64_t end = 0;
    };
    /// Closed loop: truth judges these alone and follows the others; force without touch is not asked. Absent: all that
    /// the specification names.
    std::optional<Judged> judged = {};
};

/// Stepper, margin of the query distance and device of a closed loop. Throws InputError.
SimulationSettings simulation_settings(const RunSpec& spec);

/// Reason why detector, contact generator and response do not work together; empty when they do. Throws InputError for
/// an unknown or absent method.
std::string why_not_combined(const RunSpec& spec);

/// Runs spec.mode for spec.ticks ticks (0: the scene's own number), with spec.overrides applied to the scene. Modes are
/// `replay`, `repeated_motion` (a replay), `closed_loop`, `paced`, `cost_by_size`, `against`, `resolution`,
/// `metamorphic` and `hard_case` (the closed loop). `work_precision` is the closed loop, or the replay without a
/// response. Throws InputError for an unknown or absent method and an unknown mode. Any other failure of a method is
/// the record's outcome, with the rows so far. The record holds environment() and the facts about this run, e.g.
/// "frames".
Record make_run(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

/// Detector on the frames of the scene's stream (frame_source.hpp): pair errors, contact errors and stage times.
/// frames_hash is the hash over all frames, the same for every detector.
Record run_replay(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

/// Detector and response drive their own copy of the scene. Judged by geometry on the frame after each tick. The modes
/// `paced` and `cost_by_size` are not judged and not watched, since both would take measured time. `paced` has one
/// period for at most one tick, in turns with an empty loop (paced.hpp), and ends with its periods.
Record run_closed_loop(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

/// The closed loop of a scene with an interval without contact, after the same with contact at every tick; compared by
/// compare_resolution. Truth must be computed on every tick. The record holds why it is not resolved
/// ("resolution.cause") and how the twin ended ("resolution.twin").
Record run_resolution(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

}  // namespace trocar
