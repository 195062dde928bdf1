// How much worse the worst tick is than an ordinary one: every method over a long run of the same ticks, in counted
// work and in wall time, with a loop that computes nothing beside it, since on a shared machine most of a bad tick is
// the machine's. Frames come from a scene that is driven while they are used; nothing is stored.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "methods.hpp"
#include "scene/scene.hpp"

namespace trocar::bench {

/// A series of numbers, one per tick, as far as its tail reports.
struct Spread {
    double median = -1.0;
    double p99 = -1.0;
    double p999 = -1.0;
    double max = -1.0;
};

struct BoundedResult {
    std::string label;
    std::string library;
    bool own = false;
    bool claims_exact = false;
    Outcome outcome;
    Spread work;                    ///< WorkCounters::work() of a tick
    std::int64_t worst_tick = -1;   ///< of the scene, where the work was most
    Spread wall;                    ///< ns, update and detect
    Spread empty;                   ///< ns, a loop without memory that takes as long, after the same ticks; ours only
    std::int64_t allocations = -1;  ///< heap allocations in all ticks after the first cycle; -1: not counted
    std::int64_t truncated = 0;     ///< ticks
    std::int64_t truth_ticks = 0;   ///< ticks held against the exact oracle
    std::int64_t wrong_ticks = 0;   ///< of these: pair set not the oracle's
    [[nodiscard]] double work_ratio() const { return work.median > 0.0 ? work.max / work.median : -1.0; }
};

struct BoundedMeasurement {
    std::string scene;              ///< its name
    std::int64_t ticks = 0;         ///< with at least one pair of overlapping triangle boxes: all figures are of these
    std::int64_t driven_ticks = 0;  ///< of the scene, those without one included
    double box_pairs = 0.0;         ///< median
    double true_pairs = 0.0;        ///< median over the ticks held against the oracle
    std::string frames_hash;        ///< over the frames of all counted ticks, 16 hex digits
    std::vector<BoundedResult> methods;
};

/// The scene's one drag again and again, `cycles` times, each time turned about z by the golden angle, so that no two
/// are alike. One cycle takes the last key's time and `pause` s for the way back. Throws InputError unless exactly one
/// body has a motion.
Scene repeated(Scene scene, std::int64_t cycles, double pause);

/// A scene file, repeated as the bench and its test use it. Throws InputError when the file is not there.
Scene repeated(const std::filesystem::path& scene_file, std::int64_t cycles);

/// Runs until `ticks` ticks had a pair of overlapping boxes. `now` is reported who is about to run.
BoundedMeasurement measure_bounded(const Scene& scene, const std::vector<Method>& methods, std::int64_t ticks,
                                   const std::function<void(const std::string&)>& now = {});

}  // namespace trocar::bench
