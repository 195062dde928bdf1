// Within a query distance boxes in float are grown where they ask. Whatever is lost between double and float, and far
// from the origin of the floats, no two boxes that come within the query distance may seem apart.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "detect/cluster_kernels.hpp"

namespace trocar::test {
namespace {

/// As FloatFrame converts.
float in_float(double x, double origin, double scale) { return static_cast<float>((x - origin) * scale); }

TEST(GrownBoxes, OverlapAllThatComesWithinQueryDistance) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    std::int64_t close = 0;
    for (int k = 0; k < 200000; ++k) {
        const double scale = std::ldexp(1.0, static_cast<int>(random() % 40) - 20);
        const double origin = unit(random) * std::ldexp(1.0, static_cast<int>(random() % 20) - 10);
        const double high = origin + unit(random) * std::ldexp(1.0, static_cast<int>(random() % 30) - 15);
        const double query_distance = std::abs(unit(random)) * std::ldexp(1.0, static_cast<int>(random() % 30) - 25);
        const double low = high + query_distance;  // exactly as far, but for rounding
        if (low - high > query_distance) continue;
        const float query_distance_in_float = static_cast<float>(query_distance * scale);
        const float grown = grown_down(in_float(low, origin, scale), query_distance_in_float);
        ASSERT_LE(grown, in_float(high, origin, scale)) << k;
        ASSERT_GE(grown_up(in_float(high, origin, scale), query_distance_in_float), in_float(low, origin, scale)) << k;
        // And not much more than that.
        const double size = std::abs((low - origin) * scale) + query_distance * scale;
        close += (low - origin) * scale - grown < 1.001 * query_distance * scale + 1e-6 * size ? 1 : 0;
    }
    EXPECT_GT(close, 90000);
}

TEST(GrownBoxes, KernelsGrowAsOneByOneAndLeaveNoNumberAlone) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> unit(-8.0F, 8.0F);
    constexpr float infinity = std::numeric_limits<float>::infinity();
    for (const ClusterKernels& kernels : cluster_kernels()) {
        SCOPED_TRACE(kernels.target);
        for (const float query_distance : {1e-30F, 0.01F, 3.0F, 1e30F, infinity}) {
            SixteenBoxes boxes{};
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (std::size_t i = 0; i < 16; ++i) {
                    boxes.low[axis][i] = unit(random);
                    boxes.high[axis][i] = boxes.low[axis][i] + 1.0F;
                }
                boxes.low[axis][3] = -infinity;
                boxes.high[axis][4] = infinity;
                boxes.low[axis][5] = infinity;  // what did not fit a float may be anywhere beyond
                boxes.high[axis][5] = infinity;
                boxes.low[axis][6] = boxes.high[axis][6] = std::numeric_limits<float>::quiet_NaN();
            }
            SixteenBoxes grown{};
            kernels.grow(boxes, query_distance, grown);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (std::size_t i = 0; i < 16; ++i) {
                    if (i == 6) {
                        EXPECT_TRUE(std::isnan(grown.low[axis][i]) && std::isnan(grown.high[axis][i]));
                        continue;
                    }
                    EXPECT_EQ(grown.low[axis][i], grown_down(boxes.low[axis][i], query_distance))
                        << i << " " << query_distance;
                    EXPECT_EQ(grown.high[axis][i], grown_up(boxes.high[axis][i], query_distance))
                        << i << " " << query_distance;
                }
                EXPECT_EQ(grown.low[axis][5], -infinity);
            }
        }
    }
}

}  // namespace
}  // namespace trocar::test
