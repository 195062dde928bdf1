#include "measure/statistics.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <stdexcept>

#include "geometry/random.hpp"

namespace trocar {
namespace {

const double nan = std::nan("");

TEST(Quantile, KnownValues) {
    EXPECT_EQ(median({3.0, 1.0, 2.0}), 2.0);
    EXPECT_EQ(median({4.0, 1.0, 2.0, 3.0}), 2.5);
    EXPECT_EQ(median({1.0, nan, 3.0}), 2.0);
    EXPECT_TRUE(std::isnan(median({})));
    EXPECT_TRUE(std::isnan(median({nan})));
    // Hyndman and Fan type 7 on 1 … 5: h = (n - 1) q + 1.
    EXPECT_DOUBLE_EQ(quantile({1, 2, 3, 4, 5}, 0.9), 4.6);
    EXPECT_EQ(quantile({5, 1}, 0.0), 1.0);
    EXPECT_EQ(quantile({5, 1}, 1.0), 5.0);
}

TEST(TailQuantile, TenValuesLieAboveAQuantile) {
    std::vector<double> values(999, 1.0);
    EXPECT_TRUE(std::isnan(quantile_with_ten_above(values, 0.99)));
    values.push_back(nan);
    EXPECT_TRUE(std::isnan(quantile_with_ten_above(values, 0.99))) << "a NaN is no tick";
    values.push_back(1.0);
    EXPECT_EQ(quantile_with_ten_above(values, 0.99), 1.0);
    values.resize(10000, 1.0);
    EXPECT_TRUE(std::isnan(quantile_with_ten_above(values, 0.999)));
    values.push_back(2.0);
    EXPECT_EQ(quantile_with_ten_above(values, 0.999), 1.0);
}

TEST(GeometricMean, KnownValues) {
    EXPECT_DOUBLE_EQ(geometric_mean({1.0, 100.0}), 10.0);
    EXPECT_DOUBLE_EQ(geometric_mean({0.5, 2.0, nan}), 1.0);
    EXPECT_TRUE(std::isnan(geometric_mean({1.0, 0.0})));
    EXPECT_TRUE(std::isnan(geometric_mean({})));
}

/// Share of all 2^n patterns of "below the median" for which the pair of ranks encloses the median.
double coverage_by_enumeration(int count, int low, int high) {
    std::int64_t enclosed = 0;
    for (std::uint32_t pattern = 0; pattern < (1U << static_cast<unsigned>(count)); ++pattern) {
        const int below = std::popcount(pattern);
        if (below >= low && below < high) ++enclosed;
    }
    return std::ldexp(static_cast<double>(enclosed), -count);
}

TEST(MedianRanks, AreTheNarrowestPairThatCovers) {
    EXPECT_FALSE(median_ranks(0).has_value());
    EXPECT_FALSE(median_ranks(5).has_value()) << "1 - 2/32 is below 95 %";
    for (int count = 6; count <= 20; ++count) {
        const std::optional<RankInterval> ranks = median_ranks(count);
        ASSERT_TRUE(ranks.has_value());
        EXPECT_EQ(ranks->low + ranks->high, count + 1);
        EXPECT_GE(coverage_by_enumeration(count, ranks->low, ranks->high), 0.95) << count;
        EXPECT_LT(coverage_by_enumeration(count, ranks->low + 1, ranks->high - 1), 0.95) << count;
    }
}

/// Critical values of the two-sided sign test at 5 %, as tabulated (Conover 1999, table A3): one less than the lower
/// rank.
TEST(MedianRanks, AreThoseOfTheSignTest) {
    for (const auto& [count, critical] : {std::pair{6, 0}, {10, 1}, {20, 5}, {25, 7}, {30, 9}, {50, 17}, {60, 21}}) {
        const std::optional<RankInterval> ranks = median_ranks(count);
        ASSERT_TRUE(ranks.has_value());
        EXPECT_EQ(ranks->low, critical + 1) << count;
        EXPECT_EQ(ranks->high, count - critical) << count;
    }
}

TEST(MedianBounds, AreOrderStatistics) {
    const double infinite = std::numeric_limits<double>::infinity();
    const Bounds bounds = median_bounds({7, 3, nan, 1, infinite, 5, 2, 4, 6, 9, 8});  // ten values: ranks 2 and 9
    EXPECT_EQ(bounds.low, 2.0);
    EXPECT_EQ(bounds.high, 9.0);
    EXPECT_EQ(median_bounds({1, 2, 3, 4, 5, infinite}).high, infinite);
    EXPECT_TRUE(std::isnan(median_bounds({1, 2, 3, 4, 5, nan}).low));
}

TEST(Bootstrap, IntervalOfTheMeanIsThatOfTheory) {
    // 400 normal values of deviation 1: the 95 % interval of the mean is ± 1.96/20.
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    std::vector<double> values(400);
    for (double& value : values) value = normal(random);
    const Statistic mean = [](const std::vector<double>& v) {
        return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
    };
    const Bounds bounds = bootstrap(values, mean, 1, 4000);
    EXPECT_LT(bounds.low, mean(values));
    EXPECT_GT(bounds.high, mean(values));
    EXPECT_NEAR(bounds.high - bounds.low, 2 * 1.96 / 20.0, 0.02);
    const Bounds again = bootstrap(values, mean, 1, 4000);
    EXPECT_EQ(bounds.low, again.low);
    EXPECT_EQ(bounds.high, again.high);
    EXPECT_NE(bounds.low, bootstrap(values, mean, 2, 4000).low);
}

/// First-order autoregressive series of deviation 1.
std::vector<double> autoregressive(std::size_t count, double rho, std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    std::vector<double> series{normal(random)};
    while (series.size() < count) series.push_back(rho * series.back() + std::sqrt(1.0 - rho * rho) * normal(random));
    return series;
}

TEST(Bootstrap, BlocksOfTicksGiveTheIntervalOfADependentSeries) {
    // The median of n values of a Gaussian series has the variance sum arcsin(rho^|k|) / n: the signs of two normal
    // values of correlation r are correlated by 2/pi arcsin r. Independent ticks would have pi/2 / n.
    constexpr std::size_t count = 2000;
    constexpr double rho = 0.8;
    double sum = std::numbers::pi / 2.0;
    for (int k = 1; k < 200; ++k) sum += 2.0 * std::asin(std::pow(rho, k));
    const double theory = 2.0 * 1.96 * std::sqrt(sum / static_cast<double>(count));
    std::mt19937_64 random(11);
    double blocks = 0.0;
    double single = 0.0;
    double correlation = 0.0;
    constexpr int series = 12;
    for (int i = 0; i < series; ++i) {
        // All processes see the same ticks and differ in nothing else.
        const std::vector<std::vector<double>> processes(10, autoregressive(count, rho, random));
        const double lag_one = lag_one_correlation(processes.front());
        const auto width = [&](std::int64_t block) {
            const Bounds bounds = bounds_of_median(resampled_quantiles(processes, {0.5}, block, 1, 400).front());
            return (bounds.high - bounds.low) / series;
        };
        correlation += lag_one / series;
        blocks += width(block_length(count, lag_one));
        single += width(1);
    }
    EXPECT_NEAR(correlation, rho, 0.02);
    EXPECT_NEAR(blocks, theory, 0.2 * theory);
    EXPECT_LT(single, 0.5 * theory);  // what forgetting the blocks would give
}

TEST(Bootstrap, BlocksHaveTheLengthOfPolitisAndWhite) {
    for (const double rho : {0.1, 0.5, 0.9}) {
        double g = 0.0;
        double spectrum = 1.0;
        for (int k = 1; k < 2000; ++k) {
            g += 2.0 * k * std::pow(rho, k);
            spectrum += 2.0 * std::pow(rho, k);
        }
        const double best = std::cbrt(2.0 * g * g / (4.0 / 3.0 * spectrum * spectrum) * 5000.0);
        EXPECT_NEAR(static_cast<double>(block_length(5000, rho)), best, 0.51) << rho;
    }
    EXPECT_EQ(block_length(5000, 0.0), 1);
    EXPECT_EQ(block_length(5000, -0.5), 1);
    EXPECT_EQ(block_length(100, 1.0), 25);
    EXPECT_EQ(block_length(2, 0.9), 1);
    EXPECT_EQ(lag_one_correlation({3.0, 3.0, 3.0}), 0.0);
}

TEST(Bootstrap, DifferencesBetweenProcessesWidenTheInterval) {
    // Within a process nothing varies; the processes differ: pooling the ticks would give a far too small interval.
    std::vector<std::vector<double>> processes;
    for (int p = 0; p < 10; ++p) processes.emplace_back(100, 10.0 + p);
    const Bounds bounds = bounds_of_median(resampled_quantiles(processes, {0.5}, 10, 1).front());
    EXPECT_LE(bounds.low, 12.5);
    EXPECT_GE(bounds.high, 16.5);
    EXPECT_TRUE(resampled_quantiles({}, {0.5}, 10, 1).empty());
    EXPECT_TRUE(resampled_quantiles({{1.0, 2.0}, {1.0}}, {0.5}, 10, 1).empty());
    EXPECT_TRUE(std::isnan(bounds_of_median({}).low));
}

TEST(Bootstrap, TwoMethodsAreDrawnAlike) {
    std::mt19937_64 random(5);
    std::vector<std::vector<double>> ours;
    std::vector<std::vector<double>> theirs;
    for (int p = 0; p < 10; ++p) {
        ours.push_back(autoregressive(60, 0.5, random));
        theirs.push_back(ours.back());
        for (double& value : theirs.back()) value = 3.0 * value + 7.0;  // keeps the order: quantiles follow
    }
    const auto a = resampled_quantiles(ours, {0.5, 0.99}, 4, 9, 50);
    const auto b = resampled_quantiles(theirs, {0.5, 0.99}, 4, 9, 50);
    ASSERT_EQ(a.size(), 2U);
    for (std::size_t q = 0; q < 2; ++q) {
        for (std::size_t r = 0; r < 50; ++r) {
            for (std::size_t p = 0; p < 10; ++p) EXPECT_NEAR(b[q][r][p], 3.0 * a[q][r][p] + 7.0, 1e-9);
        }
    }
}

}  // namespace
}  // namespace trocar
