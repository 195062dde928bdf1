// Statistics of reports. A tail quantile needs enough ticks; an interval comes from a seeded bootstrap over processes
// and blocks of ticks. NaN values are left out everywhere.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// Ticks at the start of a run that are left out of every time figure.
inline constexpr std::int64_t warm_up_ticks = 10;

/// NaN for no values.
double median(std::vector<double> values);

/// Quantile 0 <= q <= 1 by linear interpolation between order statistics (Hyndman and Fan 1996, type 7); NaN for none.
double quantile(std::vector<double> values, double q);

/// As quantile, but NaN where fewer than ten known values lie above it (STUDIES, Measuring). The least count is 1000 at
/// 99 % and 10 000 at 99.9 %.
double quantile_with_ten_above(const std::vector<double>& values, double q);

/// Positive values only; NaN for none or when one is not positive.
double geometric_mean(const std::vector<double>& values);

struct Bounds {
    double low = not_known;
    double high = not_known;
};

/// 95 % interval of a median from `count` values, as ranks from 1 (David and Nagaraja 2003, section 7.1). It is the
/// narrowest symmetric pair of order statistics with at least that coverage. Nothing below 6 values. Precondition:
/// count <= 1000.
struct RankInterval {
    int low = 0;
    int high = 0;
};
std::optional<RankInterval> median_ranks(int count);

/// The values at those ranks, which may be infinite; NaN for fewer than 6.
Bounds median_bounds(std::vector<double> values);

using Statistic = std::function<double(std::vector<double>)>;

/// 95 % percentile bootstrap of a statistic over independent values. The same seed gives the same interval anywhere.
Bounds bootstrap(const std::vector<double>& values, const Statistic& statistic, std::uint64_t seed,
                 int resamples = 1000);

/// Correlation of neighbouring values; 0 for a constant series and fewer than three values.
double lag_one_correlation(const std::vector<double>& series);

/// Length of resampled blocks: optimal for the variance of a mean of `count` values of a first-order autoregressive
/// series. Method of Politis and White 2004, circular blocks, with G and D in closed form; from 1 to count / 4.
std::int64_t block_length(std::int64_t count, double lag_one);

/// One number for each resample and each process drawn in it.
using Resamples = std::vector<std::vector<double>>;

/// Quantiles over the ticks of every process, resampled in two factors. Each resample draws processes, and circular
/// blocks of ticks that are the same for all of them (Owen 2007; Politis and Romano 1992). Calls with the same seed,
/// block and sizes draw alike, so that two methods are paired tick by tick. One Resamples per quantile; empty when the
/// processes have unequal numbers of ticks or none.
std::vector<Resamples> resampled_quantiles(const std::vector<std::vector<double>>& processes,
                                           const std::vector<double>& quantiles, std::int64_t block, std::uint64_t seed,
                                           int resamples = 1000);

/// 95 % interval of the median over processes; NaN for no resample or where a number is NaN.
Bounds bounds_of_median(const Resamples& resamples);

}  // namespace trocar
