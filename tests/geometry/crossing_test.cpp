#include "geometry/crossing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/triangle_families.hpp"
#include "support/data.hpp"
#include "support/random_vectors.hpp"

namespace trocar {
namespace {

using test::KnownPair;
using test::TrianglePairCase;

const Corners face{Vector3(-0.02, -0.02, 0.0), Vector3(0.04, -0.02, 0.0), Vector3(-0.02, 0.04, 0.0)};

Corners moved(const Corners& t, const Quaternion& rotation, const Vector3& translation) {
    return {Vector3(rotation * t[0] + translation), Vector3(rotation * t[1] + translation),
            Vector3(rotation * t[2] + translation)};
}

TEST(Crossing, TipBelowAFaceEntersItWithItsPlaneDepth) {
    // Tip 2 mm below, the two edges cut z = 0 at x = 0.001 ± 0.001/4 (2 mm of 8 mm up the edges of half width 4 mm).
    const Corners tip{Vector3(0.001, 0.0, -0.002), Vector3(0.005, 0.0, 0.006), Vector3(-0.003, 0.0, 0.006)};
    const Crossing first = cross_triangles(tip, face);
    EXPECT_EQ(first.kind, CrossingKind::crossing);
    EXPECT_EQ(first.overlap_case, CrossingCase::first_enters_second);
    EXPECT_NEAR(first.first_depth[0], 0.002, 1e-15);
    EXPECT_NEAR(first.first_depth[1], -0.006, 1e-15);
    EXPECT_NEAR(first.length, 0.002, 1e-15);
    EXPECT_TRUE(first.second_normal.isApprox(Vector3::UnitZ(), 1e-15));
    for (const CrossingEnd& end : first.ends) {
        EXPECT_EQ(end.triangle, 0);
        EXPECT_NEAR(end.point.z(), 0.0, 1e-15);
        EXPECT_NEAR(std::abs(end.point.x() - 0.001), 0.001, 1e-15);
    }
    EXPECT_NE(first.ends[0].edge, first.ends[1].edge);
    const Crossing second = cross_triangles(face, tip);
    EXPECT_EQ(second.overlap_case, CrossingCase::second_enters_first);
    EXPECT_NEAR(second.second_depth[0], 0.002, 1e-15);
    EXPECT_NEAR(second.length, first.length, 1e-15);
    EXPECT_TRUE(second.direction.isApprox(-first.direction, 1e-12));
}

TEST(Crossing, ATipTooNarrowToMeasureIsNoTouchOnceItIsDeep) {
    // 1e-4 wide per length: 100 nm deep it is 0.01 nm wide where it passes the face, where up to 1 nm is a touch.
    for (const double deep : {1e-7, 1e-10}) {
        const Corners tip{Vector3(0.0, 0.0, -deep), Vector3(5e-6, 0.0, 0.1 - deep), Vector3(-5e-6, 0.0, 0.1 - deep)};
        const CrossingKind kind = deep > 1e-9 ? CrossingKind::crossing : CrossingKind::touch;
        for (const bool swapped : {false, true}) {
            const Crossing crossing = swapped ? cross_triangles(face, tip) : cross_triangles(tip, face);
            EXPECT_EQ(crossing.kind, kind) << deep << swapped;
            EXPECT_LE(crossing.length, 1.1e-11);
        }
    }
}

/// Thesis eq. 3.5 by construction: second's edge stands at x = 0.25 inside first's interval [-0.5, 0.5] on the x axis.
TEST(Crossing, OverlapOfCrossingEdgesIsMetricAndParts) {
    const Corners first{Vector3(0, -1, 0), Vector3(1, 1, 0), Vector3(-2, 1, 0)};
    const Corners second{Vector3(0.25, 0, -1), Vector3(0.25, 0, 0.875), Vector3(3, 0, 0)};
    const Crossing crossing = cross_triangles(first, second);
    EXPECT_EQ(crossing.kind, CrossingKind::crossing);
    EXPECT_EQ(crossing.overlap_case, CrossingCase::edges_cross);
    EXPECT_NEAR(crossing.length, 0.25, 1e-15);
    EXPECT_TRUE(crossing.direction.isApprox(Vector3::UnitX(), 1e-15));
    EXPECT_TRUE(crossing.ends[0].point.isApprox(Vector3(0.25, 0, 0), 1e-15));
    EXPECT_EQ(crossing.ends[0].triangle, 1);
    EXPECT_EQ(crossing.ends[0].edge, 0);
    EXPECT_TRUE(crossing.ends[1].point.isApprox(Vector3(0.5, 0, 0), 1e-15));
    EXPECT_EQ(crossing.ends[1].triangle, 0);
    EXPECT_EQ(crossing.ends[1].edge, 0);
    const Crossing swapped = cross_triangles(second, first);
    EXPECT_NEAR(swapped.length, 0.25, 1e-15);
    EXPECT_TRUE(swapped.direction.isApprox(-Vector3::UnitX(), 1e-15));
    // A line along (1,1,1)/sqrt3 is where a length along the largest coordinate would be short by sqrt3.
    const Quaternion turn = Quaternion::FromTwoVectors(Vector3::UnitX(), Vector3::Ones());
    const Crossing turned = cross_triangles(moved(first, turn, {1, 2, 3}), moved(second, turn, {1, 2, 3}));
    EXPECT_NEAR(turned.length, 0.25, 1e-14);
    EXPECT_TRUE(turned.direction.isApprox(Vector3::Ones() / std::sqrt(3.0), 1e-14));
}

TEST(Crossing, PartsAfterMovingSecondByTheLengthAlongTheDirection) {
    std::mt19937_64 random(1);
    int edges = 0;
    for (int n = 0; n < 20000; ++n) {
        const TrianglePairCase pair = test::random_pair(random);
        const Crossing crossing = cross_triangles(pair.first, pair.second);
        if (crossing.overlap_case != CrossingCase::edges_cross) continue;
        ++edges;
        const auto moved_by = [&](double share) {
            const Vector3 shift = share * crossing.length * crossing.direction;
            return moved(pair.second, Quaternion::Identity(), shift);
        };
        ASSERT_TRUE(triangles_intersect(pair.first, moved_by(1.0 - 1e-6)));
        ASSERT_FALSE(triangles_intersect(pair.first, moved_by(1.0 + 1e-6)));
    }
    EXPECT_GT(edges, 1000);
}

TEST(Crossing, LengthAndCaseDoNotChangeUnderRotation) {
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    int crossings = 0;
    for (int n = 0; n < 5000; ++n) {
        const TrianglePairCase pair = test::random_pair(random);
        const Crossing before = cross_triangles(pair.first, pair.second);
        if (before.kind != CrossingKind::crossing) continue;
        const double sine = before.first_normal.cross(before.second_normal).norm();
        if (sine < 1e-3 || before.length < 1e-3) continue;
        ++crossings;
        const Quaternion turn = test::random_turn(normal, random);
        const Vector3 shift = test::random_vector(normal, random);
        const Crossing after = cross_triangles(moved(pair.first, turn, shift), moved(pair.second, turn, shift));
        ASSERT_EQ(after.overlap_case, before.overlap_case);
        ASSERT_NEAR(after.length, before.length, 1e-9 * before.length);
        ASSERT_TRUE(after.direction.isApprox(turn * before.direction, 1e-9));
        for (std::size_t i = 0; i < 3; ++i) ASSERT_NEAR(after.first_depth[i], before.first_depth[i], 1e-12);
    }
    EXPECT_GT(crossings, 500);
}

TEST(Crossing, CaseAgreesWithTheEndsAndTheIntervals) {
    std::mt19937_64 random(3);
    std::array<int, 4> seen{};
    for (int n = 0; n < 20000; ++n) {
        const TrianglePairCase pair = test::random_pair(random);
        const Crossing crossing = cross_triangles(pair.first, pair.second);
        if (crossing.kind != CrossingKind::crossing) continue;
        ++seen[static_cast<std::size_t>(crossing.overlap_case)];
        const int ends_of_first = (crossing.ends[0].triangle == 0 ? 1 : 0) + (crossing.ends[1].triangle == 0 ? 1 : 0);
        const int expected = crossing.overlap_case == CrossingCase::first_enters_second   ? 2
                             : crossing.overlap_case == CrossingCase::second_enters_first ? 0
                                                                                          : 1;
        ASSERT_EQ(ends_of_first, expected);
        ASSERT_NEAR((crossing.ends[1].point - crossing.ends[0].point).norm(), crossing.length, 2e-9);
        ASSERT_GE((crossing.ends[1].point - crossing.ends[0].point).dot(crossing.direction), -1e-12);
        for (const CrossingEnd& end : crossing.ends) {
            // On its edge, and inside the other triangle's interval.
            const Corners& own = end.triangle == 0 ? pair.first : pair.second;
            const Vector3& from = own[static_cast<std::size_t>(end.edge)];
            const Vector3 edge = own[static_cast<std::size_t>((end.edge + 1) % 3)] - from;
            ASSERT_LT((end.point - from).cross(edge).norm(), 1e-12);
            const double along = (end.point - pair.first[0]).dot(crossing.direction);
            const auto& other = end.triangle == 0 ? crossing.second_interval : crossing.first_interval;
            ASSERT_GE(along, other[0] - 2e-9);
            ASSERT_LE(along, other[1] + 2e-9);
        }
        const Crossing swapped = cross_triangles(pair.second, pair.first);
        if (crossing.overlap_case == CrossingCase::first_enters_second) {
            ASSERT_EQ(swapped.overlap_case, CrossingCase::second_enters_first);
        } else if (crossing.overlap_case == CrossingCase::edges_cross) {
            ASSERT_EQ(swapped.overlap_case, CrossingCase::edges_cross);
        }
        ASSERT_LT((swapped.direction + crossing.direction).norm(), 1e-9);
    }
    for (const std::size_t i : {1U, 2U, 3U}) EXPECT_GT(seen[i], 100);
}

TEST(Crossing, EqualIntervalsCountAsSecondEntersFirst) {
    const Corners first{Vector3(-0.01, 0, -0.01), Vector3(0.01, 0, -0.01), Vector3(0, 0, 0.01)};
    const Corners second{Vector3(-0.01, -0.01, 0), Vector3(0, 0.01, 0), Vector3(0.01, -0.01, 0)};
    EXPECT_EQ(cross_triangles(first, second).overlap_case, CrossingCase::second_enters_first);
    EXPECT_EQ(cross_triangles(second, first).overlap_case, CrossingCase::second_enters_first);
}

TEST(Crossing, ToleratesANanometreAndNoMore) {
    const auto tip_at = [](double z) {
        return Corners{Vector3(0.001, 0.0, z), Vector3(0.005, 0.0, 0.006), Vector3(-0.003, 0.0, 0.006)};
    };
    EXPECT_EQ(cross_triangles(tip_at(0.0), face).kind, CrossingKind::touch);
    EXPECT_EQ(cross_triangles(tip_at(-0.5e-9), face).kind, CrossingKind::touch);
    EXPECT_EQ(cross_triangles(tip_at(-5e-9), face).kind, CrossingKind::crossing);
    EXPECT_EQ(cross_triangles(tip_at(1e-11), face).kind, CrossingKind::none);
}

TEST(Crossing, LabelsCoplanarAndDegeneratePairs) {
    const Corners shifted = moved(face, Quaternion::Identity(), {0.01, 0, 0});
    EXPECT_EQ(cross_triangles(face, shifted).kind, CrossingKind::coplanar);
    EXPECT_EQ(cross_triangles(face, moved(face, Quaternion::Identity(), {0.2, 0, 0})).kind, CrossingKind::none);
    EXPECT_EQ(cross_triangles(face, moved(face, Quaternion::Identity(), {0, 0, 0.5e-12})).kind, CrossingKind::coplanar);
    const auto sliver = [](double height) {
        return Corners{Vector3(0, 0, -0.01), Vector3(0, 0, 0.01), Vector3(height, 0, 0)};
    };
    EXPECT_EQ(cross_triangles(sliver(0.9e-6), face).kind, CrossingKind::degenerate);
    EXPECT_EQ(cross_triangles(face, sliver(0.0)).kind, CrossingKind::degenerate);
    EXPECT_EQ(cross_triangles(sliver(1.1e-6), face).kind, CrossingKind::crossing);
    EXPECT_TRUE(interval_intersect(sliver(0.9e-6), face));
    EXPECT_TRUE(interval_intersect(face, sliver(0.0)));
    EXPECT_FALSE(interval_intersect(face, moved(sliver(0.0), Quaternion::Identity(), {0.05, 0, 0})));
}

TEST(IntervalTest, EqualsExactTestOnGenericPairsAndWhereProductsOverflow) {
    std::mt19937_64 random(4);
    int meet = 0;
    for (int n = 0; n < 50000; ++n) {
        const TrianglePairCase pair = test::random_pair(random);
        const bool truth = triangles_intersect(pair.first, pair.second);
        meet += truth ? 1 : 0;
        ASSERT_EQ(interval_intersect(pair.first, pair.second), truth);
        if (n >= 2000) continue;
        // Lengths to the second or fourth power overflow.
        for (const int exponent : {230, 300, 500, 512, 700, 1010, 1020}) {
            const double factor = std::ldexp(1.0, exponent);
            ASSERT_EQ(interval_intersect(test::scaled(pair.first, factor), test::scaled(pair.second, factor)), truth)
                << n << " times two to the " << exponent;
        }
    }
    EXPECT_GT(meet, 5000);
}

TEST(Crossing, LengthsGrowWithTrianglesWhoseProductsOverflow) {
    const Corners blade = moved(face, Quaternion(Eigen::AngleAxisd(1.2, Vector3::UnitX())), {0.003, 0.002, 0.001});
    const Crossing plain = cross_triangles(face, blade);
    ASSERT_EQ(plain.kind, CrossingKind::crossing);
    const double factor = std::ldexp(1.0, 900);
    const Crossing huge = cross_triangles(test::scaled(face, factor), test::scaled(blade, factor));
    EXPECT_EQ(huge.kind, CrossingKind::crossing);
    EXPECT_EQ(huge.overlap_case, plain.overlap_case);
    EXPECT_NEAR(huge.length / factor, plain.length, 1e-12);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR((huge.ends[i].point / factor - plain.ends[i].point).norm(), 0.0, 1e-12);
        EXPECT_NEAR(huge.first_interval[i] / factor, plain.first_interval[i], 1e-12);
    }
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(huge.first_depth[i] / factor, plain.first_depth[i], 1e-12);
        EXPECT_NEAR(huge.second_depth[i] / factor, plain.second_depth[i], 1e-12);
    }
}

/// A find of the fuzzers: finite corners of which one is so far away that the area is not. The verdict may err (the
/// margin is far below the rounding), but it is one, and what belongs to it is set.
TEST(Crossing, OneCornerAtTheEndOfTheNumbersLeavesNothingUnset) {
    const Corners first{Vector3(1.625, 1.25, -0.125), Vector3(1.375, 1.125, 0), Vector3(-0.125, 0, -0.375)};
    for (const double far : {1e160, 1e300, -1e308}) {
        const Corners second{Vector3(1.375, 1.125, 0), Vector3(-55.125, far, 0), Vector3(1.625, 1.25, -0.125)};
        for (const auto& [one, two] : {std::pair(&first, &second), std::pair(&second, &first)}) {
            const Crossing crossing = cross_triangles(*one, *two);
            for (const double depth : crossing.first_depth) {
                EXPECT_TRUE(std::isfinite(depth) || crossing.kind == CrossingKind::degenerate) << far;
            }
            if (crossing.kind != CrossingKind::crossing && crossing.kind != CrossingKind::touch) continue;
            EXPECT_GE(crossing.length, 0.0) << far;
            EXPECT_NEAR(crossing.direction.norm(), 1.0, 1e-12) << far;
        }
    }
}

TEST(IntervalTest, FindsTouchesOnALattice) {
    std::mt19937_64 random(5);
    for (int n = 0; n < 20000; ++n) {
        const TrianglePairCase pair = test::lattice_pair(random, 3, 0.001);
        const auto flat = [](const Corners& t) { return (t[1] - t[0]).cross(t[2] - t[0]).norm() < 1e-12; };
        if (flat(pair.first) && flat(pair.second)) continue;
        ASSERT_EQ(interval_intersect(pair.first, pair.second), oracle_intersect(pair.first, pair.second)) << n;
    }
}

/// METHODS §3.2: the absolute epsilon sees metres as millimetres only because of the scaling inside.
TEST(Moller, IsRightOnGenericPairsOfFiveMillimetres) {
    std::mt19937_64 random(6);
    int wrong = 0;
    for (int n = 0; n < 20000; ++n) {
        const TrianglePairCase pair = test::random_pair(random);
        const Corners first = test::scaled(pair.first, 0.005);
        const Corners second = test::scaled(pair.second, 0.005);
        wrong += moller_intersect(first, second) != triangles_intersect(first, second) ? 1 : 0;
    }
    EXPECT_LE(wrong, 2);
}

TEST(Moller, AnEdgeInTheOthersPlaneMeetsItWhereItRunsThroughItAlone) {
    // In the plane of the face, along y = 1 mm, where the face reaches from x = 0 to 3 mm. Seen from above the triangle
    // that stands on the edge overlaps the face in any case.
    const Corners flat = test::scaled({Vector3(0, 0, 0), Vector3(4, 0, 0), Vector3(0, 4, 0)}, 1e-3);
    for (const double begin : {1.0, 10.0}) {
        const Corners standing = test::scaled({Vector3(1, 1.5, 3), Vector3(begin, 1, 0), Vector3(20, 1, 0)}, 1e-3);
        for (const auto& order : test::corner_orders) {
            const Corners turned = test::reordered(standing, order);
            EXPECT_EQ(moller_intersect(flat, turned), begin < 3.0) << begin;
            EXPECT_EQ(moller_intersect(turned, flat), begin < 3.0) << begin;
        }
    }
}

TEST(Moller, FailsWhereTheReferenceFails) {
    // 1 µm triangles: all distances are below the absolute epsilon, so that crossing at a right angle appears coplanar.
    const Corners small{Vector3(-1e-6, -1e-6, 0), Vector3(1e-6, -1e-6, 0), Vector3(0, 1e-6, 0)};
    const Corners apart{Vector3(0, 0, 1e-6), Vector3(0, 0.2e-6, 2e-6), Vector3(0, -0.2e-6, 2e-6)};
    EXPECT_FALSE(triangles_intersect(small, apart));
    EXPECT_TRUE(moller_intersect(small, apart));
    // A millimetre triangle 1000 m off: float has lost its shape.
    const Vector3 far(1000.0, 1000.0, 1000.0);
    const Corners here{Vector3(far + Vector3(0, 0, 0)), Vector3(far + Vector3(1e-3, 0, 0)),
                       Vector3(far + Vector3(0, 1e-3, 0))};
    const Corners there{Vector3(far + Vector3(2e-4, 2e-4, 1e-5)), Vector3(far + Vector3(3e-4, 2e-4, 1e-3)),
                        Vector3(far + Vector3(2e-4, 3e-4, 1e-3))};
    EXPECT_FALSE(triangles_intersect(here, there));
    EXPECT_TRUE(moller_intersect(here, there));
}

/// As stated at interval_intersect, with size for the largest distance of a corner of both triangles.
double tolerance(const TrianglePairCase& pair) {
    double extent = 0.0;
    for (const Corners* t : {&pair.first, &pair.second}) {
        for (const Vector3& corner : *t) extent = std::max(extent, (corner - pair.first[0]).norm());
    }
    std::array<Vector3, 2> unit;
    double altitude = extent;
    for (std::size_t k = 0; k < 2; ++k) {
        const Corners& t = k == 0 ? pair.first : pair.second;
        const Vector3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
        for (std::size_t i = 0; i < 3; ++i) {
            altitude = std::min(altitude, normal.norm() / (t[(i + 1) % 3] - t[i]).norm());
        }
        unit[k] = normal.normalized();
    }
    return 1e-12 + 1e-15 * extent * extent / (altitude * unit[0].cross(unit[1]).norm());
}

TEST(IntervalTest, IsRightWhereTheDataLeavesMoreThanItsTolerance) {
    int judged = 0;
    for (const char* family :
         {"random", "lattice", "near_coplanar", "sliver", "huge_offset", "tiny", "shared", "coplanar", "needle_ulp"}) {
        TROCAR_DATA_OR_SKIP(file, "tritri/" + std::string(family) + ".txt");
        const std::vector<KnownPair> pairs = test::read_pairs(file);
        std::ifstream margins(std::filesystem::path(file).replace_extension(".margin"));
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            double margin = 0.0;
            ASSERT_TRUE(margins >> margin);
            if (std::abs(margin) <= tolerance(pairs[i])) continue;
            ++judged;
            EXPECT_EQ(interval_intersect(pairs[i].first, pairs[i].second), pairs[i].truth == 1)
                << family << " line " << i + 1 << " margin " << margin;
        }
    }
    EXPECT_GT(judged, 1000);
}

}  // namespace
}  // namespace trocar
