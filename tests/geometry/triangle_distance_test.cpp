// Distances of triangles against closed forms, against sampling, and against a proof of their own: closest points name
// a direction along which the two triangles cannot be nearer, whatever way they were found.
#include "geometry/triangle_distance.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "geometry/triangle_families.hpp"
#include "support/random_vectors.hpp"

namespace trocar {
namespace {

using test::TrianglePairCase;

double extent(const TrianglePairCase& pair) {
    double most = 0.0;
    for (const Corners* t : {&pair.first, &pair.second}) {
        for (const Vector3& corner : *t) most = std::max(most, (corner - pair.first[0]).cwiseAbs().maxCoeff());
    }
    return most;
}

/// How much nearer the hulls of two sets of points can be than the two points: rounding aside, 0 proves them closest.
template <typename First, typename Second>
double doubt(const First& first, const Second& second, const Vector3& p, const Vector3& q) {
    const double distance = (q - p).norm();
    if (distance == 0.0) return 0.0;
    const Vector3 along = (q - p) / distance;
    double end = -std::numeric_limits<double>::infinity();
    double start = -end;
    for (const Vector3& corner : first) end = std::max(end, along.dot(corner - p));
    for (const Vector3& corner : second) start = std::min(start, along.dot(corner - p));
    return distance - std::max(0.0, start - end);
}

/// What rounding leaves of the direction between points `distance` apart, over `size`.
double tolerance(double size, double distance) {
    return 1e-13 * size + 1e-14 * size * size / std::max(distance, 1e-300);
}

bool are_weights(const Vector3& weights) { return weights.minCoeff() >= 0.0 && std::abs(weights.sum() - 1.0) < 1e-14; }

/// Pairs that do not meet: general ones, and with corners, edges and planes in common often.
std::vector<TrianglePairCase> pairs_apart() {
    std::vector<TrianglePairCase> pairs;
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int k = 0; k < 20000; ++k) {
        TrianglePairCase pair;
        if (k % 5 == 0) pair = test::lattice_pair(random, 4, 0.25, 3.0);
        if (k % 5 == 1) pair = test::random_pair(random);
        if (k % 5 == 2) pair = test::nearly_touching_pair(random);
        if (k % 5 == 3) {
            // Needles, nearly parallel.
            for (Corners* t : {&pair.first, &pair.second}) {
                for (Vector3& corner : *t) corner = {uniform(random), 1e-5 * uniform(random), 1e-5 * uniform(random)};
            }
            for (Vector3& corner : pair.second) corner[2] += 1e-3 * (k % 7);
        }
        if (k % 5 == 4) pair = test::without_area(random, test::random_pair(random));
        if (!triangles_intersect(pair.first, pair.second)) pairs.push_back(pair);
    }
    return pairs;
}

TEST(TriangleDistance, NothingIsNearerThanTheClosestPoints) {
    const std::vector<TrianglePairCase> pairs = pairs_apart();
    ASSERT_GT(pairs.size(), 5000U);
    for (const TrianglePairCase& pair : pairs) {
        const TriangleDistance found = triangle_distance(pair.first, pair.second);
        ASSERT_TRUE(are_weights(found.first) && are_weights(found.second));
        const Vector3 p = point_at(pair.first, found.first);
        const Vector3 q = point_at(pair.second, found.second);
        const double size = extent(pair);
        const double distance = std::sqrt(found.squared_distance);
        ASSERT_NEAR((q - p).norm(), distance, 1e-14 * size);
        ASSERT_LE(doubt(pair.first, pair.second, p, q), tolerance(size, distance));
    }
}

TEST(TriangleDistance, ClosedFormsOfEachKindOfFeature) {
    const Corners floor{Vector3(0, 0, 0), Vector3(4, 0, 0), Vector3(0, 4, 0)};
    const auto above = [](const Vector3& tip) {
        return Corners{tip, Vector3(tip + Vector3(1, 0.2, 2)), Vector3(tip + Vector3(-0.3, 1, 3))};
    };
    // A corner over the face, beside an edge, beyond a corner.
    TriangleDistance found = triangle_distance(floor, above({1, 1, 0.5}));
    EXPECT_DOUBLE_EQ(found.squared_distance, 0.25);
    EXPECT_TRUE(found.first.isApprox(Vector3(0.5, 0.25, 0.25)));
    EXPECT_EQ(found.second, Vector3(1, 0, 0));
    found = triangle_distance(floor, {Vector3(1, -3, 4), Vector3(1, -5, 6), Vector3(3, -5, 9)});
    EXPECT_DOUBLE_EQ(found.squared_distance, 25.0);
    EXPECT_EQ(found.first, Vector3(0.75, 0.25, 0));
    found = triangle_distance(floor, {Vector3(6, -1, 2), Vector3(9, -1, 2), Vector3(9, -5, 9)});
    EXPECT_DOUBLE_EQ(found.squared_distance, 9.0);
    EXPECT_EQ(found.first, Vector3(0, 1, 0));
    EXPECT_EQ(found.second, Vector3(1, 0, 0));
    // Two edges that cross at 1/4 and 1/2 of their lengths, 2 apart.
    const Corners upper{Vector3(1, -3, 2), Vector3(1, 3, 2), Vector3(1, 0, 9)};
    const Corners lower{Vector3(0, 0, 0), Vector3(4, 0, 0), Vector3(2, 0, -9)};
    found = triangle_distance(lower, upper);
    EXPECT_DOUBLE_EQ(found.squared_distance, 4.0);
    EXPECT_EQ(found.first, Vector3(0.75, 0.25, 0));
    EXPECT_EQ(found.second, Vector3(0.5, 0.5, 0));
    // Parallel faces one over the other, faces in one plane, equal triangles.
    EXPECT_DOUBLE_EQ(triangle_distance(floor, {Vector3(1, 1, 3), Vector3(2, 1, 3), Vector3(1, 2, 3)}).squared_distance,
                     9.0);
    EXPECT_DOUBLE_EQ(
        triangle_distance(floor, {Vector3(-2, 1, 0), Vector3(-3, 5, 0), Vector3(-3, -5, 0)}).squared_distance, 4.0);
    EXPECT_EQ(triangle_distance(floor, floor).squared_distance, 0.0);
    // Points and segments.
    const Vector3 point(1, 1, -2);
    EXPECT_DOUBLE_EQ(triangle_distance(floor, {point, point, point}).squared_distance, 4.0);
    EXPECT_DOUBLE_EQ(triangle_distance({point, point, point}, {point, point, point}).squared_distance, 0.0);
    EXPECT_DOUBLE_EQ(triangle_distance({Vector3(0, 0, 0), Vector3(2, 0, 0), Vector3(1, 0, 0)},
                                       {Vector3(1, -1, 3), Vector3(1, 1, 3), Vector3(1, 0, 3)})
                         .squared_distance,
                     9.0);
}

TEST(TriangleDistance, SwappedTrianglesOtherUnitsAndExactMovesMakeNoDifference) {
    std::mt19937_64 random(7);
    for (int k = 0; k < 2000; ++k) {
        const TrianglePairCase pair = test::lattice_pair(random, 64, 0x1p-6);
        const TriangleDistance found = triangle_distance(pair.first, pair.second);
        EXPECT_NEAR(triangle_distance(pair.second, pair.first).squared_distance, found.squared_distance, 1e-14);
        for (const double unit : {0x1p-20, 0x1p20}) {
            const TriangleDistance other =
                triangle_distance(test::scaled(pair.first, unit), test::scaled(pair.second, unit));
            EXPECT_EQ(other.squared_distance, found.squared_distance * unit * unit);
            EXPECT_EQ(other.first, found.first);
        }
        TrianglePairCase there = pair;
        for (Corners* t : {&there.first, &there.second}) {
            for (Vector3& corner : *t) corner += Vector3(64.0, -32.0, 16.0);
        }
        EXPECT_NEAR(triangle_distance(there.first, there.second).squared_distance, found.squared_distance, 1e-12);
    }
}

TEST(TriangleDistance, WithinQueryDistanceIsWhatTheDistanceSays) {
    std::size_t within = 0;
    std::size_t beyond = 0;
    for (const TrianglePairCase& pair : pairs_apart()) {
        const double distance = std::sqrt(triangle_distance(pair.first, pair.second).squared_distance);
        for (const double query_distance : {0.003, 0.05, 0.2, 0.5, distance * (1 + 1e-8), distance * (1 - 1e-8)}) {
            if (distance < 1e-6 || std::abs(distance - query_distance) < 1e-9 * distance) continue;
            ASSERT_EQ(is_within_query_distance(pair.first, pair.second, query_distance), distance <= query_distance)
                << distance << " " << query_distance;
            ++(distance <= query_distance ? within : beyond);
        }
    }
    EXPECT_GT(within, 10000U);
    EXPECT_GT(beyond, 10000U);
}

TEST(ClosestPointOnTriangle, NothingIsNearerAndCornersLeftOutWeighNothing) {
    std::mt19937_64 random(8);
    std::uniform_real_distribution<double> uniform(-1.0, 2.0);
    std::array<int, 3> left_out{};
    for (const TrianglePairCase& pair : pairs_apart()) {
        const Vector3 point = test::random_vector(uniform, random);
        const Vector3 weights = closest_point_on_triangle(pair.first, point);
        ASSERT_TRUE(are_weights(weights));
        const Vector3 foot = point_at(pair.first, weights);
        ASSERT_LE(doubt(std::array<Vector3, 1>{point}, pair.first, point, foot), tolerance(4.0, (point - foot).norm()));
        const auto zeros = (weights.array() == 0.0).count();
        ASSERT_LT(zeros, 3);
        ++left_out[static_cast<std::size_t>(zeros)];
    }
    for (const int count : left_out) EXPECT_GT(count, 100);
}

}  // namespace
}  // namespace trocar
