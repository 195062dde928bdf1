#include "report/proportions.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar {

Proportion wilson_interval(int successes, int all) {
    if (all <= 0) return {};
    constexpr double z = 1.959963984540054;  // 97.5 % quantile of the normal distribution
    const double n = all;
    const double share = successes / n;
    const double centre = share + z * z / (2.0 * n);
    const double half = z * std::sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n));
    const double scale = 1.0 + z * z / n;
    return {std::max(0.0, (centre - half) / scale), std::min(1.0, (centre + half) / scale)};
}

double mcnemar_exact(int one, int other) {
    const int all = one + other;
    double term = std::ldexp(1.0, -all);  // of no success in `all` throws
    double sum = 0.0;
    for (int k = 0; k <= std::min(one, other); ++k) {
        sum += term;
        term *= static_cast<double>(all - k) / (k + 1);
    }
    return std::min(1.0, 2.0 * sum);
}

double binomial_at_most(std::int64_t successes, std::int64_t all, double share) {
    if (successes < 0) return 0.0;
    if (successes >= all || share <= 0.0) return 1.0;
    if (share >= 1.0) return 0.0;
    const auto n = static_cast<double>(all);
    const auto most = static_cast<double>(successes);
    // Terms from the last one down, by their ratios; logarithms, since the first one may underflow.
    double term = std::lgamma(n + 1.0) - std::lgamma(most + 1.0) - std::lgamma(n - most + 1.0) +
                  most * std::log(share) + (n - most) * std::log1p(-share);
    const double odds = (1.0 - share) / share;
    double sum = 0.0;
    for (std::int64_t left = successes; left >= 0; --left) {
        const auto k = static_cast<double>(left);
        const double value = std::exp(term);
        sum += value;
        if (k < n * share && value < 1e-17 * sum) break;  // below the mode terms only fall
        term += std::log(k / (n - k + 1.0) * odds);
    }
    return std::min(1.0, sum);
}

RateRatio compare_rates(std::int64_t events, std::int64_t trials, std::int64_t other_events,
                        std::int64_t other_trials) {
    const std::int64_t sum = events + other_events;
    if (sum <= 0 || trials <= 0 || other_trials <= 0) return {};
    const double equal = static_cast<double>(trials) / static_cast<double>(trials + other_trials);
    const auto ratio_of_share = [equal](double share) { return share / (1.0 - share) * (1.0 - equal) / equal; };
    RateRatio result{.ratio = ratio_of_share(static_cast<double>(events) / static_cast<double>(sum)),
                     .p = binomial_at_most(sum - events, sum, 1.0 - equal)};
    double low = 0.0;
    double high = 1.0;
    constexpr int halvings = 60;
    for (int i = 0; i < halvings; ++i) {
        const double middle = 0.5 * (low + high);
        (binomial_at_most(events, sum, middle) > 0.05 ? low : high) = middle;
    }
    result.upper = other_events == 0 ? std::numeric_limits<double>::infinity() : ratio_of_share(low);
    return result;
}

}  // namespace trocar
