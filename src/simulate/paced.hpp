// The loop that a haptic device sees: one tick is released every tick of the scene by the clock, whether the one before
// has ended or not. Time counts from the scheduled release, so that a late tick makes the next ones late too and none
// is left out of the count (no coordinated omission).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace trocar {

struct PacedTimes {
    std::vector<double> latency_ns;  ///< per tick, from its scheduled release to its end
};

/// Calls `work` once for every release, `period_ns` apart, `ticks` times, in this thread; ends early when it returns
/// false. Waits by sleeping until shortly before a release and examining the clock from there on.
PacedTimes run_paced(std::int64_t ticks, std::int64_t period_ns, const std::function<bool()>& work);

struct PacedBeside {
    PacedTimes work;
    PacedTimes empty;  ///< of a loop that does nothing
};

/// The same while an empty loop of as many ticks is released by the same clock in a thread of its own: what else the
/// machine does meets both where it has two cores. It is not prolonged for work that falls behind. Not in turns: after
/// a second without work a tick of 0.25 ms took 5 to 19 ms.
PacedBeside run_beside_empty(std::int64_t ticks, std::int64_t period_ns, const std::function<bool()>& work);

/// NAME_median_ns, NAME_p99_ns, NAME_p999_ns, NAME_max_ns, NAME_misses, NAME_burst after the warm-up. A miss is a tick
/// that ended after the next one's release.
std::map<std::string, double> paced_figures(const std::string& name, const PacedTimes& times, std::int64_t period_ns);

}  // namespace trocar
