#include "measure/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>

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

TEST(TailQuantile, TooFewTicksGiveNoAnswer) {
    std::vector<double> values(999, 1.0);
    EXPECT_FALSE(tail_quantile(values, 0.99).has_value());
    values.push_back(nan);
    EXPECT_FALSE(tail_quantile(values, 0.99).has_value()) << "a NaN is no tick";
    values.push_back(1.0);
    EXPECT_TRUE(tail_quantile(values, 0.99).has_value());
    EXPECT_FALSE(tail_quantile(values, 0.999).has_value());
    values.resize(100001, 1.0);
    EXPECT_TRUE(tail_quantile(values, 0.999).has_value());
    EXPECT_TRUE(tail_quantile({1.0}, 0.5).has_value());
}

TEST(GeometricMean, KnownValues) {
    EXPECT_DOUBLE_EQ(geometric_mean({1.0, 100.0}), 10.0);
    EXPECT_DOUBLE_EQ(geometric_mean({0.5, 2.0, nan}), 1.0);
    EXPECT_TRUE(std::isnan(geometric_mean({1.0, 0.0})));
    EXPECT_TRUE(std::isnan(geometric_mean({})));
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

TEST(Bootstrap, DifferencesBetweenProcessesWidenTheInterval) {
    // Within a process nothing varies; the processes differ: pooling the ticks would give a far too small interval.
    std::vector<std::vector<double>> processes;
    for (int p = 0; p < 10; ++p) processes.emplace_back(100, 10.0 + p);
    const Bounds bounds = bootstrap_processes(
        processes, [](std::vector<double> v) { return median(std::move(v)); }, 10, 1);
    EXPECT_LE(bounds.low, 12.5);
    EXPECT_GE(bounds.high, 16.5);
    EXPECT_TRUE(std::isnan(bootstrap_processes(
                               {}, [](std::vector<double> v) { return median(std::move(v)); }, 10, 1)
                               .low));
}

TEST(Bootstrap, RatioOfProportionalTicksIsSharp) {
    // b is twice a tick by tick: resampled together the ratio has no spread, however much the ticks vary.
    std::vector<std::vector<double>> a;
    std::vector<std::vector<double>> b;
    std::mt19937_64 random(3);
    for (int p = 0; p < 4; ++p) {
        a.emplace_back();
        b.emplace_back();
        for (int i = 0; i < 50; ++i) {
            const auto value = static_cast<double>(1 + random() % 1000);
            a.back().push_back(value);
            b.back().push_back(2.0 * value);
        }
    }
    const Bounds bounds = bootstrap_ratio(
        a, b, [](std::vector<double> v) { return median(std::move(v)); }, 5, 1);
    EXPECT_EQ(bounds.low, 0.5);
    EXPECT_EQ(bounds.high, 0.5);
    b.pop_back();
    EXPECT_THROW(bootstrap_ratio(
                     a, b, [](std::vector<double> v) { return median(std::move(v)); }, 5, 1),
                 std::logic_error);
}

}  // namespace
}  // namespace trocar
