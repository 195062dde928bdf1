#include "measure/statistics.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/random.hpp"
#include "geometry/types.hpp"

namespace trocar {
namespace {

/// The middle 95 % of the resampled statistics (percentile bootstrap, Efron and Tibshirani 1993, ch. 13).
Bounds middle(const std::vector<double>& statistics) {
    return {.low = quantile(statistics, 0.025), .high = quantile(statistics, 0.975)};
}

/// Of at least one value, ascending.
double quantile_of_sorted(const std::vector<double>& values, double q) {
    const double place = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    if (below + 1 >= values.size()) return values.back();
    const double part = place - static_cast<double>(below);
    if (part == 0.0 || values[below] == values[below + 1]) return values[below];  // both may be infinite
    return values[below] + part * (values[below + 1] - values[below]);
}

}  // namespace

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

double quantile(std::vector<double> values, double q) {
    std::erase_if(values, [](double value) { return std::isnan(value); });
    if (values.empty()) return not_known;
    std::sort(values.begin(), values.end());
    return quantile_of_sorted(values, q);
}

double quantile_with_ten_above(const std::vector<double>& values, double q) {
    constexpr double rounding = 1e-9;
    const auto known = std::count_if(values.begin(), values.end(), [](double value) { return !std::isnan(value); });
    return static_cast<double>(known) * (1.0 - q) < 10.0 - rounding ? not_known : quantile(values, q);
}

double geometric_mean(const std::vector<double>& values) {
    double sum = 0.0;
    std::size_t count = 0;
    for (const double value : values) {
        if (std::isnan(value)) continue;
        if (!(value > 0.0)) return not_known;
        sum += std::log(value);
        ++count;
    }
    return count == 0 ? not_known : std::exp(sum / static_cast<double>(count));
}

std::optional<RankInterval> median_ranks(int count) {
    double term = std::ldexp(1.0, -count);  // that no value is below the median
    double tail = 0.0;                      // that fewer than `low` values are
    int low = 0;
    while (tail + term <= 0.025) {
        tail += term;
        term *= static_cast<double>(count - low) / (low + 1);
        ++low;
    }
    if (low == 0) return std::nullopt;
    return RankInterval{.low = low, .high = count + 1 - low};
}

Bounds median_bounds(std::vector<double> values) {
    std::erase_if(values, [](double value) { return std::isnan(value); });
    const std::optional<RankInterval> ranks = median_ranks(static_cast<int>(values.size()));
    if (!ranks) return {};
    std::sort(values.begin(), values.end());
    return {.low = values[static_cast<std::size_t>(ranks->low - 1)],
            .high = values[static_cast<std::size_t>(ranks->high - 1)]};
}

Bounds bootstrap(const std::vector<double>& values, const Statistic& statistic, std::uint64_t seed, int resamples) {
    std::vector<double> known = values;
    std::erase_if(known, [](double value) { return std::isnan(value); });
    if (known.empty()) return {};
    Random random(seed);
    std::vector<double> statistics;
    std::vector<double> sample(known.size());
    for (int i = 0; i < resamples; ++i) {
        for (double& value : sample) value = known[random.below(known.size())];
        statistics.push_back(statistic(sample));
    }
    return middle(statistics);
}

double lag_one_correlation(const std::vector<double>& series) {
    if (series.size() < 3) return 0.0;
    double mean = 0.0;
    for (const double value : series) mean += value / static_cast<double>(series.size());
    double squares = 0.0;
    double products = 0.0;
    for (std::size_t i = 0; i < series.size(); ++i) {
        squares += (series[i] - mean) * (series[i] - mean);
        if (i > 0) products += (series[i] - mean) * (series[i - 1] - mean);
    }
    return squares > 0.0 ? products / squares : 0.0;
}

std::int64_t block_length(std::int64_t count, double lag_one) {
    // b = (2 G^2 / D n)^(1/3) with G = sum |k| R(k), D = 4/3 (sum R(k))^2 and R(k) = R(0) lag_one^|k|.
    const double rho = std::clamp(lag_one, 0.0, 0.999);
    const double ratio = 2.0 * rho / (1.0 - rho * rho);
    const double best = std::cbrt(1.5 * ratio * ratio * static_cast<double>(count));
    return std::clamp<std::int64_t>(std::llround(best), 1, std::max<std::int64_t>(1, count / 4));
}

std::vector<Resamples> resampled_quantiles(const std::vector<std::vector<double>>& processes,
                                           const std::vector<double>& quantiles, std::int64_t block, std::uint64_t seed,
                                           int resamples) {
    if (processes.empty() || processes.front().empty()) return {};
    const std::size_t count = processes.front().size();
    for (const std::vector<double>& ticks : processes) {
        if (ticks.size() != count) return {};
    }
    Random random(seed);
    std::vector<Resamples> all(quantiles.size());
    std::vector<std::size_t> chosen(count);
    std::vector<double> values(count);
    for (int r = 0; r < resamples; ++r) {
        for (std::size_t filled = 0; filled < count;) {
            const std::size_t start = random.below(count);
            for (std::int64_t k = 0; k < block && filled < count; ++k, ++filled) {
                chosen[filled] = (start + static_cast<std::size_t>(k)) % count;
            }
        }
        std::vector<std::vector<double>> of_process(processes.size());  // one number per quantile, made when drawn
        for (Resamples& one : all) one.emplace_back();
        for (std::size_t i = 0; i < processes.size(); ++i) {
            const std::size_t p = random.below(processes.size());
            if (of_process[p].empty()) {
                for (std::size_t t = 0; t < count; ++t) values[t] = processes[p][chosen[t]];
                std::sort(values.begin(), values.end());
                for (const double q : quantiles) of_process[p].push_back(quantile_of_sorted(values, q));
            }
            for (std::size_t k = 0; k < all.size(); ++k) all[k].back().push_back(of_process[p][k]);
        }
    }
    return all;
}

Bounds bounds_of_median(const Resamples& resamples) {
    std::vector<double> medians;
    medians.reserve(resamples.size());
    for (const std::vector<double>& processes : resamples) {
        if (std::any_of(processes.begin(), processes.end(), [](double v) { return std::isnan(v); })) return {};
        medians.push_back(median(processes));
    }
    return middle(medians);
}

}  // namespace trocar
