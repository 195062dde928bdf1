// Intervals and tests of shares, against their definitions.
#include "report/proportions.hpp"

#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace trocar
