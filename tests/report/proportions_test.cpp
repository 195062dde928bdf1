// Intervals and tests of shares, against their definitions.
#include "report/proportions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

namespace trocar {
namespace {

TEST(Proportions, EndsOfTheScoreIntervalAreAsFarAsTheirOwnStandardErrorsSay) {
    for (const auto& [successes, all] : {std::pair{18, 24}, {1, 24}, {23, 24}, {60, 120}, {3, 5}}) {
        const Proportion interval = wilson_interval(successes, all);
        const double share = static_cast<double>(successes) / all;
        EXPECT_LT(interval.low, share);
        EXPECT_GT(interval.high, share);
        for (const double p : {interval.low, interval.high}) {
            EXPECT_NEAR(std::abs(share - p), 1.959964 * std::sqrt(p * (1.0 - p) / all), 1e-6)
                << successes << "/" << all;
        }
    }
    EXPECT_NEAR(wilson_interval(0, 24).low, 0.0, 1e-12);
    EXPECT_GT(wilson_interval(0, 24).high, 0.1);
    EXPECT_NEAR(wilson_interval(24, 24).high, 1.0, 1e-12);
    EXPECT_EQ(wilson_interval(0, 0).high, 1.0);
}

TEST(Proportions, McNemarIsTheTailOfAFairCoin) {
    EXPECT_DOUBLE_EQ(mcnemar_exact(0, 6), 2.0 / 64.0) << "six that all go one way are the fewest below 5 %";
    EXPECT_DOUBLE_EQ(mcnemar_exact(5, 0), 2.0 / 32.0);
    EXPECT_DOUBLE_EQ(mcnemar_exact(2, 8), 2.0 * (1 + 10 + 45) / 1024.0);
    EXPECT_DOUBLE_EQ(mcnemar_exact(8, 2), mcnemar_exact(2, 8));
    EXPECT_EQ(mcnemar_exact(3, 3), 1.0);
    EXPECT_EQ(mcnemar_exact(0, 0), 1.0);
}

TEST(Proportions, BinomialTailsAreSumsOfTheirTerms) {
    EXPECT_NEAR(binomial_at_most(2, 8, 0.5), (1 + 8 + 28) / 256.0, 1e-14);
    EXPECT_NEAR(binomial_at_most(1, 3, 1.0 / 3.0), (8 + 12) / 27.0, 1e-14);
    EXPECT_EQ(binomial_at_most(-1, 8, 0.5), 0.0);
    EXPECT_EQ(binomial_at_most(8, 8, 0.5), 1.0);
    EXPECT_EQ(binomial_at_most(3, 8, 1.0), 0.0);
    // Either at most k succeed or at most n - k - 1 fail.
    for (const auto& [k, n, share] : {std::tuple{3, 40, 0.1}, {700, 20'000, 0.04}, {19'000, 20'000, 0.94}}) {
        EXPECT_NEAR(binomial_at_most(k, n, share) + binomial_at_most(n - k - 1, n, 1.0 - share), 1.0, 1e-9) << k;
    }
}

TEST(Proportions, RatesAreComparedByTheShareOfOneSide) {
    const RateRatio three = compare_rates(3, 1000, 1, 1000);
    EXPECT_DOUBLE_EQ(three.ratio, 3.0);
    EXPECT_NEAR(three.p, (4 + 1) / 16.0, 1e-14) << "three or four of four tosses";
    // A share s has at most three of four in 5 % of the samples: 1 - s^4 = 0.05.
    const double share = std::pow(0.95, 0.25);
    EXPECT_NEAR(three.upper, share / (1.0 - share), 1e-9);
    // Three times as many trials of the others: a quarter each.
    const RateRatio alone = compare_rates(2, 10, 0, 30);
    EXPECT_TRUE(std::isinf(alone.ratio));
    EXPECT_TRUE(std::isinf(alone.upper));
    EXPECT_NEAR(alone.p, 1.0 / 16.0, 1e-14);
    EXPECT_DOUBLE_EQ(compare_rates(4, 10, 6, 30).ratio, 2.0);
    const RateRatio none = compare_rates(0, 10, 3, 10);
    EXPECT_EQ(none.ratio, 0.0);
    EXPECT_EQ(none.p, 1.0);
    EXPECT_NEAR(std::pow(1.0 / (1.0 + none.upper), 3.0), 0.05, 1e-9);
    EXPECT_TRUE(std::isnan(compare_rates(0, 10, 0, 10).ratio));
    EXPECT_EQ(compare_rates(0, 10, 0, 10).p, 1.0);
}

}  // namespace
}  // namespace trocar
