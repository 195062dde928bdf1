// Shares of successes, and whether two of them differ.
#pragma once

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

}  // namespace trocar
