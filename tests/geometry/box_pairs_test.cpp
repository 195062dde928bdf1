#include "geometry/box_pairs.hpp"

#include <gtest/gtest.h>

#include <random>

#include "support/random_vectors.hpp"

namespace trocar {
namespace {

std::vector<IndexPair> one_by_one(const std::vector<Box>& boxes, Range first, Range second) {
    std::vector<IndexPair> pairs;
    for (Index i = first.first; i < first.end(); ++i) {
        for (Index j = second.first; j < second.end(); ++j) {
            const Box& a = boxes[static_cast<std::size_t>(i)];
            const Box& b = boxes[static_cast<std::size_t>(j)];
            bool overlap = true;
            for (int k = 0; k < 3; ++k) overlap = overlap && a.min[k] <= b.max[k] && b.min[k] <= a.max[k];
            if (overlap) pairs.push_back({i, j});
        }
    }
    return pairs;
}

TEST(OverlappingBoxes, EqualsTestingEveryPair) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 60; ++round) {
        // Small integers: many boxes that touch in a face, an edge or a corner.
        std::uniform_int_distribution<int> corner(0, round % 3 == 0 ? 3 : 30);
        std::uniform_int_distribution<int> size(0, 4);
        std::uniform_int_distribution<Index> count(0, 70);
        const Range first{0, count(random)};
        const Range second{first.end() + 2, count(random)};
        std::vector<Box> boxes(static_cast<std::size_t>(second.end()) + 1);
        for (Box& box : boxes) {
            if (size(random) == 0) continue;  // stays empty
            box.add(test::random_vector(corner, random));
            box.add(box.min + test::random_vector(size, random));
        }
        std::vector<IndexPair> pairs{{7, 7}};
        overlapping_boxes(boxes, first, second, pairs);
        EXPECT_EQ(pairs, one_by_one(boxes, first, second));
        overlapping_boxes(boxes, second, first, pairs);
        EXPECT_EQ(pairs, one_by_one(boxes, second, first));
    }
}

TEST(TriangleBoxes, HoldTheirCornersAndAreEmptyWithoutNumbers) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double inf = std::numeric_limits<double>::infinity();
    Matrix3X position(3, 5);
    position.col(0) = Vector3(1, 5, -3);
    position.col(1) = Vector3(0, 7, 2);
    position.col(2) = Vector3(4, 6, 1);
    position.col(3) = Vector3(nan, 0, 0);
    position.col(4) = Vector3(0, inf, 0);
    Triangles triangles(3, 3);
    triangles.col(0) << 0, 1, 2;
    triangles.col(1) << 0, 3, 2;
    triangles.col(2) << 4, 1, 2;
    std::vector<Box> boxes;
    triangle_boxes(position, triangles, boxes);
    ASSERT_EQ(boxes.size(), 3U);
    EXPECT_EQ(boxes[0].min, Vector3(0, 5, -3));
    EXPECT_EQ(boxes[0].max, Vector3(4, 7, 2));
    for (const std::size_t t : {1U, 2U}) {
        EXPECT_FALSE(boxes[t].overlaps(boxes[t]));
        EXPECT_FALSE(boxes[t].overlaps(boxes[0]));
        EXPECT_FALSE(boxes[0].overlaps(boxes[t]));
    }
}

}  // namespace
}  // namespace trocar
