// Shares of successes, and whether two of them differ.
#pragma once

#include <cstdint>

#include "geometry/types.hpp"

namespace trocar {

struct Proportion {
    double low = 0.0;   ///< 1, in 0 to 1
    double high = 1.0;  ///< 1, in 0 to 1
};

/// 95 % score interval (Wilson 1927). It holds the shares p with |successes/all - p| at most 1.96 standard errors of p.
/// 0 to 1 where `all` is 0.
Proportion wilson_interval(int successes, int all);

/// p of the two-sided exact test of McNemar for two numbers of discordant pairs. It is the probability that a fair coin
/// splits as many at least as unequally; 1 without any.
double mcnemar_exact(int one, int other);

/// Probability of at most `successes` in `all` independent trials that succeed with probability `share` each.
double binomial_at_most(std::int64_t successes, std::int64_t all, double share);

/// Rate of events in trials over that in other trials.
struct RateRatio {
    double ratio = not_known;  ///< infinity where the others have no event; NaN where both have none
    double upper = not_known;  ///< bound that the ratio exceeds in 5 % of the samples; infinity: none
    double p = 1.0;            ///< of as many events or more when both rates are equal
};

/// Conditional test of two rates (Przyborowski and Wilenski 1940). Given the sum of events, those of one side are
/// binomial with share trials / (trials + other_trials) under equal rates. The bound is Clopper and Pearson's of that
/// share. Events are taken as independent; where they come in bursts, p and bound are too small.
RateRatio compare_rates(std::int64_t events, std::int64_t trials, std::int64_t other_events, std::int64_t other_trials);

}  // namespace trocar
