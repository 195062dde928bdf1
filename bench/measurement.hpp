// Interleaved measurement of methods in one process: blocks in random order, all on the same frames. Paired ratios need
// both methods on the same step. Google Benchmark (registry_benchmarks.cpp) cannot interleave.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "contact/contact_set.hpp"
#include "methods.hpp"

namespace trocar::bench {

/// Frames of a cell. write(step, frame) must be a pure function of the step.
struct FrameMaker {
    const Topology* topology = nullptr;
    std::function<void(std::int64_t, Frame&)> write;
};

struct MeasureOptions {
    double budget_s = 0.5;          ///< s, per method; slow methods take fewer steps, at least `fewest_steps`
    std::int64_t most_steps = 160;  ///< maximum number of measured steps
    std::int64_t fewest_steps = 2;
    double query_distance = 0.0;  ///< query distance, m, for methods with within_query_distance
    std::uint64_t seed = 1;       ///< seed of the order of the methods
    /// Called with each label before it runs, to attribute crashes.
    std::function<void(const std::string&)> now = {};
};

/// One method in one cell. `step` and the times have one entry per measured step. Stage times are CPU time of the
/// process, unaffected by other programs; wall time is recorded too.
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
    std::int64_t heap_bytes = -1;      ///< of malloc, after prepare and one step; -1: unknown
    std::int64_t resident_bytes = -1;  ///< growth of the process; includes memory that libraries map themselves
    std::vector<std::int64_t> step;
    std::vector<std::int64_t> update_ns;
    std::vector<std::int64_t> detect_ns;
    std::vector<std::int64_t> wall_ns;   ///< update + detect
    std::vector<std::int64_t> cold_ns;   ///< update + detect of the first step after the other methods ran
    WorkCounters work;                   ///< medians over measured steps, per counter
    std::int64_t work_max = 0;           ///< maximum sum over a step
    std::int64_t allocations = -1;       ///< maximum per measured step; -1: not counted
    std::int64_t pairs = 0;              ///< median
    bool within_query_distance = false;  ///< queried with the cell's query distance; near pairs are compared too
    std::int64_t near_pairs = 0;         ///< median
    std::int64_t differing_steps = 0;    ///< steps whose pair set differs from the reference's
    std::int64_t truth_steps = 0;        ///< steps compared with the exact oracle
    std::int64_t false_negatives = 0;    ///< pairs, summed over truth_steps
    std::int64_t false_positives = 0;
    std::int64_t true_pairs = 0;
    [[nodiscard]] bool exact() const {
        return outcome.ok() && differing_steps == 0 && false_negatives == 0 && false_positives == 0;
    }
};

struct CellMeasurement {
    std::vector<MethodResult> methods;  ///< in the order of the input
    std::int64_t true_pairs = 0;        ///< median over the steps compared with the oracle
    std::int64_t true_near_pairs = 0;   ///< same for near pairs within the cell's query distance
    std::string frames_hash;            ///< hash over the frames of those steps, 16 hex digits
};

/// Number of blocks of a cell; a method with few steps runs in every second, fourth or eighth.
inline constexpr std::int64_t block_count = 8;

/// Reads clocks between stages only; frame generation, comparison and counters are outside the timed sections.
CellMeasurement measure(const FrameMaker& frames, const std::vector<Method>& methods, const MeasureOptions& options);

}  // namespace trocar::bench
