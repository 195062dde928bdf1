// One run from specification to record: the three kinds of run that a study is made of. All judging happens here,
// outside every timed span, and no method is named.
#pragma once

#include <cstdint>
#include <functional>

#include "measure/record.hpp"
#include "scene/scene.hpp"

namespace trocar {

class Simulation;

struct RunLimits {
    /// Called before every tick with the number of ticks done; false ends the run early (the user has had enough).
    std::function<bool(std::int64_t)> progress = {};
    /// Closed loop and replay: called after every tick, outside the timed spans.
    std::function<void(const Simulation&, const StepRow&)> observe = {};
    /// Steps that are unstable for certain are taken all the same; else such a run is not started and ends `unstable`.
    /// The record says so ("run.unstable_step"). Hard cases, whose point it may be, are always taken.
    bool allow_unstable_step = false;
    /// False: no books, and what blows up by its contacts goes on (SimulationSettings::watched).
    bool watched = true;
};

/// Runs spec.mode ("replay", "closed_loop", "triangle_pair", "paced", "cost_by_size", "metamorphic test"; "hard_case":
/// the closed loop; "work_precision" and "ablation": the closed loop, or the replay where no response is named) with
/// spec.overrides applied to the scene for spec.ticks ticks (0: the scene's own number). Throws InputError for an
/// unknown or absent method and an unknown mode; everything else a method does wrong is the record's outcome, with the
/// rows so far. The record holds environment() and the facts about this run, e.g. "frames".
Record make_run(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

/// Detector on the frames of the scene's stream (frame_source.hpp): pair errors, contact errors and stage times.
/// frames_hash is the hash over all frames, the same for every detector.
Record run_replay(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

/// Detector and response drive their own copy of the scene; judged by geometry on the frame after each tick.
Record run_closed_loop(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

/// The closed loop, released by the clock once per tick of the scene and not judged: judging would take the time that
/// is measured. An empty loop runs beside it in a thread of its own. Rows hold the stages.
Record run_paced_loop(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

/// The closed loop tick after tick as fast as it goes, timed and not judged. The record reports the tissue's triangles
/// ("run.tissue_triangles") and the sub-steps that the stepper takes. Rows hold the stages.
Record run_timed_loop(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

/// The thesis' own table: the response's time per triangle pair and per iteration on the scene's stream, "without" the
/// triangle test (the intersections given) and "with" it inside the span (the pairs given), on the very same pairs. An
/// iteration is a tick with a pair. Rows hold the stages of the "with" run.
Record run_triangle_pair(const Scene& scene, const RunSpec& spec, const RunLimits& limits = {});

}  // namespace trocar
