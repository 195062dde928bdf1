// The few statistics that reports use, with the rules that keep them honest: a tail quantile needs enough ticks, an
// interval comes from a seeded bootstrap over processes and blocks of ticks. NaN values are left out everywhere.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

namespace trocar {

/// Ticks at the start of a run that are left out of every time figure.
inline constexpr std::int64_t warm_up_ticks = 10;

/// NaN for no values.
double median(std::vector<double> values);

/// Quantile 0 <= q <= 1 by linear interpolation between order statistics (Hyndman and Fan 1996, type 7); NaN for none.
double quantile(std::vector<double> values, double q);

/// Smallest count from which a quantile is printed: 1 up to q = 0.9, 1000 up to 0.99, 1e5 beyond (STUDIES, Measuring).
std::int64_t smallest_count(double q);

/// As quantile, but nothing ("n too small") below smallest_count(q).
std::optional<double> tail_quantile(const std::vector<double>& values, double q);

/// Of positive values; NaN for none or when one is not positive.
double geometric_mean(const std::vector<double>& values);

struct Bounds {
    double low = std::numeric_limits<double>::quiet_NaN();
    double high = std::numeric_limits<double>::quiet_NaN();
};

/// Smallest and largest value; NaN for none. What is printed instead of an interval for fewer than 10 processes.
Bounds range_of(const std::vector<double>& values);

using Statistic = std::function<double(std::vector<double>)>;

/// 95 % percentile bootstrap of a statistic over independent values. The same seed gives the same interval anywhere.
Bounds bootstrap(const std::vector<double>& values, const Statistic& statistic, std::uint64_t seed,
                 int resamples = 1000);

/// The same for ticks grouped by process: processes are resampled, and within each circular blocks of `block` ticks,
/// since neighbouring ticks are not independent (Politis and Romano 1992).
Bounds bootstrap_processes(const std::vector<std::vector<double>>& processes, const Statistic& statistic,
                           std::int64_t block, std::uint64_t seed, int resamples = 1000);

/// 95 % interval of the ratio statistic(a) / statistic(b); ticks of the same frame are resampled together, so a and b
/// must have as many processes and ticks.
Bounds bootstrap_ratio(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b,
                       const Statistic& statistic, std::int64_t block, std::uint64_t seed, int resamples = 1000);

}  // namespace trocar
