// Loop of a haptic device: the clock releases one tick per period, whether or not the previous tick has ended. Latency
// counts from the scheduled release. A late tick thus delays the next ones and none is left out (no coordinated
// omission).
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

/// Calls `work` once per release, `period_ns` apart, `ticks` times, in this thread; ends early when it returns false.
/// Waits with clock_nanosleep until shortly before a release, then polls the clock.
PacedTimes run_paced(std::int64_t ticks, std::int64_t period_ns, const std::function<bool()>& work);

struct PacedBeside {
    PacedTimes work;
    PacedTimes empty;  ///< of a loop that does nothing
};

/// As run_paced, while a second thread runs an empty loop of as many ticks on the same clock. With two cores, other
/// load of the machine affects both loops alike. The empty loop is not prolonged when `work` falls behind. The loops do
/// not alternate, since an idle period slows the ticks after it.
PacedBeside run_beside_empty(std::int64_t ticks, std::int64_t period_ns, const std::function<bool()>& work);

/// Latency of a paced loop after the warm-up; NaN: not known.
struct PacedLatency {
    double median_ns;
    double p99_ns;
    double p999_ns;
    double max_ns;
    double misses;  ///< ticks that end after the next release
    double burst;   ///< longest run of misses
};
PacedLatency latency_of(const PacedTimes& times, std::int64_t period_ns);

}  // namespace trocar
