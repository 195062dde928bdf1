// Detectors that take turns in one process: blocks of consecutive ticks in random order, all on the frames of one
// generated scene. Paired ratios of times need two methods on the same frame of the same process.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "measure/record.hpp"
#include "method/detector.hpp"
#include "simulate/generated_scene.hpp"

namespace trocar {

/// Number of blocks of a run; a detector that affords few ticks takes part in every second, fourth or eighth.
inline constexpr std::int64_t interleaved_blocks = 8;
/// Ticks of a block of a run of `ticks` ticks. Truth is computed on the first of each: RunSpec::truth_stride.
std::int64_t ticks_per_block(std::int64_t ticks);
/// First timed tick of a block. It leaves room for an untimed tick before each.
std::int64_t first_tick_of_block(std::int64_t block, std::int64_t ticks_per_block);

/// One detector of a run.
struct InterleavedRun {
    RunSpec spec;
    bool claims_exact = false;
    std::function<std::unique_ptr<Detector>()> make;
};
/// With the detector that `spec` names. Throws InputError for an unknown or absent one.
InterleavedRun interleaved_run(const RunSpec& spec);

/// Runs the detectors on the scene: one record each, in the order of `runs`. A run has at most as many ticks as the
/// specification of the first says, and takes about half a second of its detector. A run with a contact generator that
/// wants a query distance asks for the one of a closed loop on these frames. Stage times are CPU time of the process
/// with all its threads (ns), so that other programs do not count and a helper thread does. Truth is computed on the
/// first frame of every block; other ticks are compared with an exact detector that agreed with truth (metric
/// `differing_ticks`). The order of the turns follows the seed of the first specification. `turn`: called with the
/// position of a run before it takes its turn, to attribute a crash. Failures are outcomes of their records.
std::vector<Record> run_interleaved(const GeneratedScene& scene, std::span<const InterleavedRun> runs,
                                    const std::function<void(std::size_t)>& turn = {});

}  // namespace trocar
