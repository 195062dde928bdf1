// Computes the metrics of a run (measure/metrics.def) from its rows.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "measure/contact_event.hpp"
#include "measure/metric.hpp"
#include "measure/statistics.hpp"
#include "measure/step_row.hpp"

namespace trocar {

inline constexpr double clear_depth = 1.0e-4;        ///< m; a depth up to this counts as cleared
inline constexpr double settle_time = 0.2;           ///< s after the last key of the motion
inline constexpr double force_cutoff_hz = 30.0;      ///< voluntary motion is below, jitter above
inline constexpr double haptic_deadline_ns = 1.0e6;  ///< ns, 1 kHz

/// Facts about a run that its rows do not hold.
struct SummaryContext {
    /// Time of a tick in a "replay" is update + detect; in every other kind of run it is all stages present.
    std::string_view mode = "closed_loop";
    double motion_end = not_known;         ///< s, last key of any body's motion
    std::int64_t warm_up = warm_up_ticks;  ///< rows at the start that no time figure and no allocation count reads
};

/// Metrics of a run from its rows alone; a metric that does not apply is NaN ("n/a").
Summary summarize(const std::vector<StepRow>& rows, const SummaryContext& context = {});
/// Metrics of contacts between frames, from the events; NaN without any event.
Summary summarize(const std::vector<ContactEvent>& events);

/// Median and 99 % quantile of the time of a stage, by its position in stage_names.
Metric stage_median(std::size_t stage);
Metric stage_p99(std::size_t stage);

/// Time of one tick as the summary counts it, ns: update + detect in a replay, else every stage that is present.
std::int64_t tick_ns(const StepRow& row, bool replay);

/// Part of a signal above `cutoff` Hz, by Parseval's sum over the slow Fourier terms: root mean square, and fraction of
/// the signal's energy. The straight line through first and last sample is removed first. NaN for fewer than two
/// samples. `dt`: s between samples.
struct FastPart {
    double rms = not_known;
    double share = not_known;
};
FastPart part_above(const std::vector<Vector3>& samples, double dt, double cutoff);

}  // namespace trocar
