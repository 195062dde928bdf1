// Loop of a haptic device: the clock releases one tick per period. A tick that ends after the next release is an
// overrun. The next tick then starts at the next release that lies ahead, and the releases in between are skipped. A
// late tick therefore delays no other one, and a latency holds the time of its own tick alone.
//
// Counted are overruns, of the ticks executed, and skipped releases, of the periods. A loop whose ticks take 2.5
// periods executes every third tick, overruns in all of them and skips two thirds of the releases.
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// Readings of a paced loop; tests bring their own.
struct PacedClock {
    std::function<std::int64_t()> now_ns;          ///< monotonic wall time
    std::function<void(std::int64_t)> wait_until;  ///< returns at this time of now_ns or later
    std::function<std::int64_t()> cpu_ns;          ///< CPU time of this thread
    std::function<std::int64_t()> switches;        ///< involuntary context switches of this thread
};

/// The machine's clocks. Waits with clock_nanosleep until shortly before a release, then polls the clock.
PacedClock machine_clock();

struct PacedTick {
    std::int64_t release = 0;   ///< number of its release in the block
    double latency_ns = 0.0;    ///< wall time from its release to its end
    double cpu_ns = 0.0;        ///< CPU time of the thread from its start to its end
    std::int64_t switches = 0;  ///< involuntary, since the end of the tick before
};

/// Ticks in the order of their releases.
struct PacedBlock {
    std::int64_t periods = 0;  ///< releases, the skipped ones included
    std::vector<PacedTick> ticks = {};
};

/// Calls `work` at releases that are `period_ns` apart, `periods` of them, in this thread. Ends early, and returns
/// false, when `work` does. Allocates before the first release alone.
bool run_paced(std::int64_t periods, std::int64_t period_ns, const PacedClock& clock, const std::function<bool()>& work,
               PacedBlock& block);

/// CPU time of the whole machine in the kernel's units, from the first line of /proc/stat.
struct MachineTime {
    double steal = 0.0;  ///< time in which the host ran others
    double all = 0.0;
};
/// None where the line is not as expected.
std::optional<MachineTime> read_machine_time(std::istream& stat);

/// A loop and an empty loop that take turns.
struct PacedRun {
    std::vector<PacedBlock> work = {};
    std::vector<PacedBlock> empty = {};
    double steal = not_known;  ///< 1, share of the machine's CPU time, both loops
};

inline constexpr std::int64_t paced_blocks = 10;

/// Runs `work` for `periods` periods in ten blocks. After each of them an empty loop runs for as many periods. Both
/// loops run in this thread and meet the same minutes of the machine. Ends when `work` returns false.
PacedRun run_in_turns(std::int64_t periods, std::int64_t period_ns, const PacedClock& clock,
                      const std::function<bool()>& work);

/// The first periods of every block are not counted. The other loop has run before and left the caches and the
/// processor's frequency to others.
inline constexpr std::int64_t paced_warm_up_periods = 10;

/// Figures of the counted periods of all blocks; NaN: not known.
struct PacedFigures {
    double ticks = not_known;     ///< executed
    double overruns = not_known;  ///< ticks that ended after the next release
    double skipped = not_known;   ///< releases without a tick
    double latency_median_ns = not_known;
    double latency_p99_ns = not_known;
    double latency_p999_ns = not_known;
    double latency_max_ns = not_known;
    double cpu_median_ns = not_known;
    double cpu_p999_ns = not_known;
    double switches = not_known;
    /// Age of the contact model: from the release of a tick to the end of the next one executed, which replaces its
    /// force. Every period counts with the age at the end of the tick that ends its gap.
    double age_p99_ns = not_known;
};
PacedFigures figures_of(std::span<const PacedBlock> blocks, std::int64_t period_ns);

}  // namespace trocar
