// Measures methods side by side in one process: in blocks, in random order, each on the very same frames. Google
// Benchmark runs one benchmark to its end before the next and cannot interleave, and a paired ratio needs both sides
// on the same step under the same conditions; so this loop is our own, and Google Benchmark measures what stands alone
// (micro.cpp).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "contact/contact_set.hpp"
#include "methods.hpp"

namespace trocar::bench {

/// The frames of a cell: write(step, frame) must be a pure function of the step.
struct FrameMaker {
    const Topology* topology = nullptr;
    std::function<void(std::int64_t, Frame&)> write;
};

struct MeasureOptions {
    double budget_s = 0.5;          ///< for each method's steps; slow ones take fewer, at least `fewest_steps`
    std::int64_t most_steps = 160;  ///< measured steps of a fast method
    std::int64_t fewest_steps = 2;
    double query_distance = 0.0;  ///< m, of methods that are asked within one
    std::uint64_t seed = 1;       ///< of the order in which methods take their turns
    /// Reported who is about to run, so that a crash can be laid at somebody's door.
    std::function<void(const std::string&)> now = {};
};

/// One method in one cell. `step` and the times have an entry per measured step. Stage times are CPU time of the
/// whole process, so that other programs on the machine do not count; wall time stands beside.
struct MethodResult {
    std::string label;
    std::string method;
    std::string library;
    std::string family;
    std::string narrow;
    bool own = false;
    bool claims_exact = false;
    Outcome outcome;
    double prepare_ns = -1.0;
    std::int64_t heap_bytes = -1;      ///< of malloc, after prepare and one step; -1: not known
    std::int64_t resident_bytes = -1;  ///< growth of the process; some libraries map memory themselves
    std::vector<std::int64_t> step;
    std::vector<std::int64_t> update_ns;
    std::vector<std::int64_t> detect_ns;
    std::vector<std::int64_t> wall_ns;   ///< update + detect
    std::vector<std::int64_t> cold_ns;   ///< update + detect of the first step after the others had their turns
    WorkCounters work;                   ///< medians over measured steps, each counter by itself
    std::int64_t work_max = 0;           ///< largest sum of a step
    std::int64_t allocations = -1;       ///< most in a measured step; -1: not counted
    std::int64_t pairs = 0;              ///< median
    bool within_query_distance = false;  ///< sets are held against truth with their near pairs
    std::int64_t near_pairs = 0;         ///< median
    std::int64_t differing_steps = 0;    ///< steps whose pair set differs from the reference's
    std::int64_t truth_steps = 0;        ///< steps held against the exact oracle
    std::int64_t false_negatives = 0;    ///< pairs, summed over truth_steps
    std::int64_t false_positives = 0;
    std::int64_t true_pairs = 0;
    [[nodiscard]] bool exact() const {
        return outcome.ok() && differing_steps == 0 && false_negatives == 0 && false_positives == 0;
    }
};

struct CellMeasurement {
    std::vector<MethodResult> methods;  ///< in the order of the methods
    std::int64_t true_pairs = 0;        ///< median over the steps held against the oracle
    std::int64_t true_near_pairs = 0;   ///< the same within the cell's reach
    std::string frames_hash;            ///< over the frames of those steps, 16 hex digits
};

/// Number of blocks that a cell is cut into; a method with few steps visits every second, fourth or eighth.
inline constexpr std::int64_t block_count = 8;

/// Clock readings lie between stages only; frames are written, pairs compared and counters read outside.
CellMeasurement measure(const FrameMaker& frames, const std::vector<Method>& methods, const MeasureOptions& options);

}  // namespace trocar::bench
