// What the first level of ohc_clustered sees of a frame: boxes must be exact with every instruction set, and no number
// that is not finite may pass.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "detect/vertex_kernels.hpp"

namespace trocar::test {
namespace {

TEST(VertexKernels, BoxesOfVerticesAreExactAndNonFiniteNumbersAreSeen) {
    std::mt19937 random(10);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (const VertexKernels& kernels : vertex_kernels()) {
        SCOPED_TRACE(kernels.target);
        for (Index count = 1; count <= 70; ++count) {
            Matrix3X points(3, count);
            for (double& x : points.reshaped()) x = uniform(random);
            // The largest last, the others in any order; behind them numbers that are foreseen, not read.
            std::vector<Index> number(static_cast<std::size_t>(count));
            std::iota(number.begin(), number.end(), 0);
            std::shuffle(number.begin(), number.end() - 1, random);
            const Index known = count + static_cast<Index>(random() % 100);
            number.resize(static_cast<std::size_t>(known), count - 1);
            for (int bad = -1; bad < 3 * count; bad += 1 + count / 4) {
                Matrix3X changed = points;
                if (bad >= 0) {
                    changed.data()[bad] = bad % 2 == 0 ? std::numeric_limits<double>::quiet_NaN()
                                                       : -std::numeric_limits<double>::infinity();
                }
                for (const bool run : {true, false}) {
                    Extent box;
                    const bool finite = run ? kernels.box_of_run(changed.data(), count, box)
                                            : kernels.box_of_some(changed.data(), number.data(), count, known, box);
                    ASSERT_EQ(finite, bad < 0) << count << " points, number " << bad;
                    if (!finite) continue;
                    for (Eigen::Index axis = 0; axis < 3; ++axis) {
                        EXPECT_EQ(box.low[static_cast<std::size_t>(axis)], points.row(axis).minCoeff());
                        EXPECT_EQ(box.high[static_cast<std::size_t>(axis)], points.row(axis).maxCoeff());
                    }
                }
            }
            points.setConstant(1.7e308);  // finite, though sums are not
            Extent box;
            EXPECT_TRUE(kernels.box_of_some(points.data(), number.data(), count, known, box));
            EXPECT_TRUE(kernels.box_of_run(points.data(), count, box));
        }
    }
}

TEST(VertexKernels, RunsAreBoxedUpToTheFirstWhoseFirstPointIsKnown) {
    std::mt19937 random(12);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const std::vector<Index> begin{0, 1, 6, 7, 20, 84, 100};
    Matrix3X points(3, begin.back());
    for (double& x : points.reshaped()) x = uniform(random);
    const Index runs = static_cast<Index>(begin.size()) - 1;
    const auto box_of = [&](Index run) -> Box {
        Box box;
        for (Index k = begin[static_cast<std::size_t>(run)]; k < begin[static_cast<std::size_t>(run) + 1]; ++k) {
            box.add(points.col(k));
        }
        return box;
    };
    for (const VertexKernels& kernels : vertex_kernels()) {
        SCOPED_TRACE(kernels.target);
        for (Index rests = 0; rests <= runs; ++rests) {
            std::vector<std::array<double, 3>> first(static_cast<std::size_t>(runs), {9.0, 9.0, 9.0});
            if (rests < runs) {
                std::copy_n(points.col(begin[static_cast<std::size_t>(rests)]).data(), 3,
                            first[static_cast<std::size_t>(rests)].data());
            }
            std::vector<Extent> boxes(static_cast<std::size_t>(runs));
            bool finite = true;
            ASSERT_EQ(
                kernels.boxes_of_moved_runs(points.data(), begin.data(), runs, first.data(), boxes.data(), finite),
                rests);
            EXPECT_TRUE(finite);
            for (Index run = 0; run < runs; ++run) {
                const auto r = static_cast<std::size_t>(run);
                const bool read = run < rests;
                EXPECT_EQ(boxes[r].low[0] <= boxes[r].high[0], read) << "what rests is left alone";
                if (!read) continue;
                const Box expected = box_of(run);
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    EXPECT_EQ(boxes[r].low[axis], expected.min[static_cast<Eigen::Index>(axis)]);
                    EXPECT_EQ(boxes[r].high[axis], expected.max[static_cast<Eigen::Index>(axis)]);
                    EXPECT_EQ(first[r][axis], points(static_cast<Eigen::Index>(axis), begin[r]));
                }
            }
            if (rests < runs) continue;
            const std::array<Index, 3> some{4, 0, 2};
            Extent around;
            kernels.box_of_boxes(boxes.data(), some.data(), 3, around);
            Box expected;
            for (const Index run : some) {
                expected.add(box_of(run).min);
                expected.add(box_of(run).max);
            }
            for (std::size_t axis = 0; axis < 3; ++axis) {
                EXPECT_EQ(around.low[axis], expected.min[static_cast<Eigen::Index>(axis)]);
                EXPECT_EQ(around.high[axis], expected.max[static_cast<Eigen::Index>(axis)]);
            }
        }
    }
}

}  // namespace
}  // namespace trocar::test
