// Compares the worst tick with the median tick: every method over a long run of equal ticks, in counted work and wall
// time. An empty loop of equal duration runs alongside, to measure the noise of a shared machine. Frames are computed
// during use, not stored.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "methods.hpp"
#include "scene/scene.hpp"

namespace trocar::bench {

/// Quantiles of a series with one value per tick; -1: no values.
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
    std::int64_t worst_tick = -1;   ///< scene tick with the most work
    Spread wall;                    ///< ns, update + detect
    Spread empty;                   ///< ns, empty loop of equal duration after the same ticks; only for own methods
    std::int64_t allocations = -1;  ///< heap allocations after the first cycle; -1: not counted
    std::int64_t truncated = 0;     ///< ticks
    std::int64_t truth_ticks = 0;   ///< ticks compared with the exact oracle
    std::int64_t wrong_ticks = 0;   ///< of truth_ticks, those with a wrong pair set
    [[nodiscard]] double work_ratio() const { return work.median > 0.0 ? work.max / work.median : -1.0; }
};

struct BoundedMeasurement {
    std::string scene;
    std::int64_t ticks = 0;  ///< ticks with at least one pair of overlapping triangle boxes; all figures refer to them
    std::int64_t driven_ticks = 0;  ///< all scene ticks
    double box_pairs = 0.0;         ///< median
    double true_pairs = 0.0;        ///< median over the ticks compared with the oracle
    std::string frames_hash;        ///< hash over the frames of all counted ticks, 16 hex digits
    std::vector<BoundedResult> methods;
};

/// Repeats the scene's motion `cycles` times, each rotated about z by the golden angle, so that no two are equal. A
/// cycle lasts until the last keyframe plus `pause` s for the return. Throws InputError unless exactly one body has a
/// motion.
Scene repeated(Scene scene, std::int64_t cycles, double pause);

/// Reads a scene file and repeats it with the settings of the benchmark and its test. Throws InputError for a missing
/// file.
Scene repeated(const std::filesystem::path& scene_file, std::int64_t cycles);

/// Runs until `ticks` ticks have a pair of overlapping boxes. `now`: called with each label before it runs.
BoundedMeasurement measure_bounded(const Scene& scene, const std::vector<Method>& methods, std::int64_t ticks,
                                   const std::function<void(const std::string&)>& now = {});

}  // namespace trocar::bench
