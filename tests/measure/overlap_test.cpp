#include "measure/overlap.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include "support/shapes.hpp"

namespace trocar {
namespace {

using test::Shape;

Shape block(const Vector3& low, const Vector3& high) { return test::box_of(low, high - low); }

/// Bit s of `other_diagonals`: side s of the box is cut along its other diagonal.
Shape with_diagonals(Shape box, int other_diagonals) {
    for (std::size_t side = 0; side < 6; ++side) {
        auto& first = box.triangles[2 * side];
        auto& second = box.triangles[2 * side + 1];
        const auto [a, b, c] = first;
        const Index d = second[2];
        if (((other_diagonals >> side) & 1) == 0) continue;
        first = {a, b, d};
        second = {b, c, d};
    }
    return box;
}

/// Fine enough that the ball's volume is 0.2 % off.
Shape ball(const Vector3& centre, double radius) { return test::sphere(radius, 80).move(centre); }

Overlap overlap_of(const Shape& a, const Shape& b) {
    const test::World world = test::make_world("two", {{BodyKind::instrument, a}, {BodyKind::instrument, b}});
    OverlapTruth truth;
    return truth.measure(world.topology, world.frame.position, 0, 1);
}

TEST(Overlap, TwoBlocksShareABlockAndPartOverItsThinnestSide) {
    const Overlap overlap = overlap_of(block({0, 0, 0}, {1, 1, 1}), block({0.7, 0.2, -0.1}, {1.7, 1.2, 0.9}));
    EXPECT_NEAR(overlap.volume, 0.3 * 0.8 * 0.9, 0.3 * 0.8 * 0.9 * 0.01);
    EXPECT_NEAR(overlap.min_translation, 0.3, 1e-12);
    EXPECT_LT((overlap.direction - Vector3(-1, 0, 0)).norm(), 1e-12) << "the first body leaves towards -x";
}

// Boxes whose projection is the bundle itself: lines run along diagonals that go from low to high.
TEST(Overlap, LinesAlongDiagonalsAreNeitherLostNorCountedTwice) {
    for (int diagonals = 0; diagonals < 64; ++diagonals) {
        SCOPED_TRACE(diagonals);
        const Shape inner = with_diagonals(block({-0.1, -0.2, -0.3}, {0.1, 0.2, 0.3}), diagonals);
        const Overlap contained = overlap_of(inner, block({-1, -1, -1}, {1, 1, 1}));
        EXPECT_NEAR(contained.volume, 0.2 * 0.4 * 0.6, 1e-12);
        EXPECT_NEAR(contained.min_translation, 1.1, 1e-12) << "thinnest side first: 1 - -0.1";
        // Both boxes have the diagonals, so that a line is lost in both at once or in one alone.
        const Shape cube = with_diagonals(block({0, 0, 0}, {1, 1, 1}), diagonals);
        const Overlap same = overlap_of(cube, with_diagonals(block({0, 0, -0.5}, {1, 1, 0.5}), 63 - diagonals));
        EXPECT_NEAR(same.volume, 0.5, 1e-12);
        EXPECT_NEAR(same.min_translation, 0.5, 1e-12);
        EXPECT_LT((same.direction - Vector3::UnitZ()).norm(), 1e-12);
    }
}

TEST(Overlap, TwoBallsShareALens) {
    const double radius = 0.01;
    for (const double distance : {0.016, 0.012}) {
        const Overlap overlap = overlap_of(ball({0, 0, 0}, radius), ball({0, distance, 0}, radius));
        const double lens = std::numbers::pi * (4 * radius + distance) * std::pow(2 * radius - distance, 2) / 12;
        EXPECT_NEAR(overlap.volume, lens, 0.02 * lens) << distance;
        // Lines are 0.42 mm apart and miss the poles by up to 0.3 mm, where each ball is 0.3²/20 = 0.0045 mm thinner;
        // the balls' chords take 0.008 mm each.
        EXPECT_LE(overlap.min_translation, 2 * radius - distance + 1e-12) << distance;
        EXPECT_NEAR(overlap.min_translation, 2 * radius - distance, 4e-5) << distance;
        EXPECT_LT((overlap.direction - Vector3(0, -1, 0)).norm(), 1e-12);
    }
}

TEST(Overlap, BodyInASlotComesOutIntoTheSlot) {
    Shape slot = block({-5, -2, -5}, {5, -1, 5});
    slot.add(block({-5, 1, -5}, {5, 2, 5}));
    // 0.2 deep in the upper wall: a hull of the slot would ask for a way around it.
    const Overlap overlap = overlap_of(block({-0.5, 0.2, -0.5}, {0.5, 1.2, 0.5}), slot);
    EXPECT_NEAR(overlap.min_translation, 0.2, 1e-12);
    EXPECT_LT((overlap.direction - Vector3(0, -1, 0)).norm(), 1e-12);
    // Too long for the slot: out of the upper wall is into the lower one, so the path goes on through all of it.
    const Overlap stuck = overlap_of(block({-0.5, -0.95, -0.5}, {0.5, 1.2, 0.5}), slot);
    EXPECT_NEAR(stuck.min_translation, 2.0 - -0.95, 1e-12) << "up through the upper wall";
}

TEST(Overlap, WhatTheFirstLineAloneMeetsHasToComeOutToo) {
    // A plate 0.1 deep in a floor, with a pin at the corner with the lowest coordinates that goes 1 deep and is as wide
    // as lines are apart. Walls around the plate leave it no way but up, which the pin makes 1 long.
    constexpr double pin = 10.0 / overlap_lines;
    constexpr double gap = 0.05;
    Shape plate = block({0, 0, -0.1}, {10, 10, 2});
    plate.add(block({0, 0, -1}, {pin, pin, 0}));
    Shape well = block({-50, -50, -50}, {50, 50, 0});
    well.add(block({-50, -50, -1}, {-gap, 50, 50}));
    well.add(block({10 + gap, -50, -1}, {50, 50, 50}));
    well.add(block({-gap, -50, -1}, {10 + gap, -gap, 50}));
    well.add(block({-gap, 10 + gap, -1}, {10 + gap, 50, 50}));
    const Overlap overlap = overlap_of(plate, well);
    EXPECT_NEAR(overlap.min_translation, 1.0, 1e-12);
    EXPECT_LT((overlap.direction - Vector3(0, 0, 1)).norm(), 1e-12);
}

TEST(Overlap, ApartIsZero) {
    const Overlap apart = overlap_of(block({0, 0, 0}, {1, 1, 1}), block({1.1, 0, 0}, {2, 1, 1}));
    EXPECT_EQ(apart.volume, 0.0);
    EXPECT_EQ(apart.min_translation, 0.0);
    // Boxes that overlap without the bodies meeting: two balls at the corners of each other's box.
    const Overlap corner = overlap_of(ball({0, 0, 0}, 1.0), ball({1.5, 1.5, 1.5}, 1.0));
    EXPECT_EQ(corner.volume, 0.0);
    EXPECT_EQ(corner.min_translation, 0.0);
}

TEST(Overlap, ThirteenDirectionsWithoutAPairOfOpposites) {
    const auto directions = translation_directions();
    ASSERT_EQ(directions.size(), 13U);
    for (std::size_t i = 0; i < directions.size(); ++i) {
        EXPECT_NEAR(directions[i].norm(), 1.0, 1e-15);
        for (std::size_t j = 0; j < i; ++j) EXPECT_LT(std::abs(directions[i].dot(directions[j])), 0.9);
    }
}

}  // namespace
}  // namespace trocar
