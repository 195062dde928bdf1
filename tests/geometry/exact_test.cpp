#include "geometry/exact.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstdint>

#include "geometry/triangle_families.hpp"
#include "support/data.hpp"
#include "support/meshes.hpp"

namespace trocar {
namespace {

using test::corner_orders;
using test::KnownPair;
using test::reordered;
using test::scaled;
using test::TrianglePairCase;

/// Sign of det[a-d; b-d; c-d] in integers, for integer coordinates below 2^40.
int integer_orientation(const std::array<std::array<std::int64_t, 3>, 4>& p) {
    using Wide = boost::multiprecision::int256_t;
    std::array<std::array<Wide, 3>, 3> m;
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t i = 0; i < 3; ++i) m[row][i] = Wide(p[row][i]) - Wide(p[3][i]);
    }
    const Wide value = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                       m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                       m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    return value.sign();
}

Vector3 vector_of(const std::array<std::int64_t, 3>& p) {
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

TEST(Orientation, IsPositiveBelowACounterClockwiseTriangle) {
    const Vector3 a(0, 0, 0);
    const Vector3 b(1, 0, 0);
    const Vector3 c(0, 1, 0);
    EXPECT_EQ(orientation_sign(a, b, c, {0.2, 0.2, -1.0}), 1);
    EXPECT_EQ(orientation_sign(a, b, c, {0.2, 0.2, 1.0}), -1);
    EXPECT_EQ(orientation_sign(a, b, c, {5.0, -7.0, 0.0}), 0);
}

TEST(Orientation, EqualsIntegerArithmeticOnNearlyCoplanarPoints) {
    std::mt19937_64 random(1);
    std::uniform_int_distribution<std::int64_t> coordinate(-(std::int64_t{1} << 38), std::int64_t{1} << 38);
    std::uniform_int_distribution<std::int64_t> weight(-8, 8);
    std::uniform_int_distribution<std::int64_t> nudge(-1, 1);
    int zeros = 0;
    for (int n = 0; n < 20000; ++n) {
        std::array<std::array<std::int64_t, 3>, 4> p{};
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t k = 0; k < 3; ++k) p[k][i] = coordinate(random) / 16;
        }
        const std::int64_t s = weight(random);
        const std::int64_t t = weight(random);
        for (std::size_t i = 0; i < 3; ++i) {
            p[3][i] = p[0][i] + s * (p[1][i] - p[0][i]) + t * (p[2][i] - p[0][i]) + nudge(random) * nudge(random);
        }
        const int truth = integer_orientation(p);
        zeros += truth == 0 ? 1 : 0;
        ASSERT_EQ(orientation_sign(vector_of(p[0]), vector_of(p[1]), vector_of(p[2]), vector_of(p[3])), truth);
    }
    EXPECT_GT(zeros, 100);
}

TEST(Orientation, RoundingOfOneLargeProductIsNotTakenForASign) {
    // n² - (n + 1)(n - 1) = 1, but rounded to doubles the two products are 256 apart: n² = 256 k + 129 goes up, and
    // 256 k + 128 to the even k. Times the 2^30 of the far point that outweighs -16 (n - 1), which decides.
    constexpr std::int64_t far = std::int64_t{1} << 30;
    constexpr std::int64_t n = far + 65;
    static_assert(far - 16 * (n - 1) < 0);
    std::array<std::array<std::int64_t, 3>, 4> p{};
    p[0] = {0, 16, far};
    p[1] = {n, n + 1, -1};
    p[2] = {n - 1, n, 0};
    for (int turn = 0; turn < 3; ++turn) {
        ASSERT_EQ(integer_orientation(p), -1);
        EXPECT_EQ(orientation_sign(vector_of(p[0]), vector_of(p[1]), vector_of(p[2]), vector_of(p[3])), -1) << turn;
        std::rotate(p.begin(), p.begin() + 1, p.begin() + 3);
    }
}

TEST(Orientation, IsExactAtTheEndsOfTheExponentRange) {
    std::mt19937_64 random(2);
    std::uniform_int_distribution<std::int64_t> coordinate(-3, 3);
    for (int n = 0; n < 2000; ++n) {
        std::array<std::array<std::int64_t, 3>, 4> p{};
        for (auto& point : p) {
            for (auto& x : point) x = coordinate(random);
        }
        const int truth = integer_orientation(p);
        for (const int exponent : {-1074, -1000, -400, -340, 0, 330, 345, 700, 1021}) {
            std::array<Vector3, 4> scaled_points;
            for (std::size_t k = 0; k < 4; ++k) {
                for (int i = 0; i < 3; ++i) {
                    scaled_points[k][i] = std::ldexp(static_cast<double>(p[k][static_cast<std::size_t>(i)]), exponent);
                }
            }
            ASSERT_EQ(orientation_sign(scaled_points[0], scaled_points[1], scaled_points[2], scaled_points[3]), truth)
                << "exponent " << exponent;
        }
        // One axis tiny, one huge, one plain: the sign of the determinant is that of the unscaled one.
        std::array<Vector3, 4> stretched;
        for (std::size_t k = 0; k < 4; ++k) {
            stretched[k] = {std::ldexp(static_cast<double>(p[k][0]), -1074),
                            std::ldexp(static_cast<double>(p[k][1]), 1021), static_cast<double>(p[k][2])};
        }
        ASSERT_EQ(orientation_sign(stretched[0], stretched[1], stretched[2], stretched[3]), truth);
    }
}

TEST(Orientation, SeesTheSmallestNumberBesideTheLargest) {
    const double huge = std::numeric_limits<double>::max();
    const double tiny = std::numeric_limits<double>::denorm_min();
    const Vector3 a(huge, huge, 0);
    const Vector3 b(-huge, huge, 0);
    const Vector3 c(0, -huge, 0);
    EXPECT_EQ(orientation_sign(a, b, c, {0, 0, tiny}), -1);
    EXPECT_EQ(orientation_sign(a, b, c, {0, 0, -tiny}), 1);
    EXPECT_EQ(orientation_sign(a, b, c, {huge, -huge, 0}), 0);
}

/// Every self-made family: name and maker.
struct Family {
    const char* name;
    TrianglePairCase (*make)(std::mt19937_64& random);
};
const std::array<Family, 8> families{{
    {"lattice2", [](std::mt19937_64& random) { return test::lattice_pair(random, 2); }},
    {"lattice3", [](std::mt19937_64& random) { return test::lattice_pair(random, 3); }},
    {"lattice5", [](std::mt19937_64& random) { return test::lattice_pair(random, 5); }},
    {"lattice_tenths", [](std::mt19937_64& random) { return test::lattice_pair(random, 3, 0.1, 0.3); }},
    {"lattice_far", [](std::mt19937_64& random) { return test::lattice_pair(random, 3, 1e-3, 1e6); }},
    {"planar",
     [](std::mt19937_64& random) {
         TrianglePairCase pair = test::lattice_pair(random, 5);
         for (Corners* t : {&pair.first, &pair.second}) {
             for (Vector3& corner : *t) corner.z() = 2.0 * corner.x() - corner.y();
         }
         return pair;
     }},
    {"random", test::random_pair},
    {"nearly_touching", test::nearly_touching_pair},
}};

TEST(ClassifyPair, AndVerdictEqualRationalConstructionOnAllSelfMadeFamilies) {
    std::mt19937_64 random(4);
    std::array<int, 6> seen{};
    for (const Family& family : families) {
        int meet = 0;
        for (int n = 0; n < 4000; ++n) {
            const TrianglePairCase pair = family.make(random);
            const PairClass truth = oracle_class(pair.first, pair.second);
            ++seen[static_cast<std::size_t>(truth)];
            ASSERT_EQ(name_of(classify_pair(pair.first, pair.second)), name_of(truth)) << family.name << " " << n;
            const bool verdict = oracle_intersect(pair.first, pair.second);
            meet += verdict ? 1 : 0;
            ASSERT_EQ(triangles_intersect(pair.first, pair.second), verdict) << family.name << " " << n;
            if (truth != PairClass::degenerate) {
                ASSERT_EQ(verdict, truth != PairClass::disjoint);
            }
        }
        EXPECT_GT(meet, 20) << family.name;
        EXPECT_LT(meet, 3990) << family.name;
    }
    for (const int count : seen) EXPECT_GT(count, 100);
}

/// All triangles with corners among `points`, each corner set once, segments and points included.
std::vector<Corners> all_triangles(const std::vector<Vector3>& points) {
    std::vector<Corners> triangles;
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = i; j < points.size(); ++j) {
            for (std::size_t k = j; k < points.size(); ++k) triangles.push_back({points[i], points[j], points[k]});
        }
    }
    return triangles;
}

void expect_every_pair_exact(const std::vector<Corners>& triangles) {
    for (const Corners& first : triangles) {
        for (const Corners& second : triangles) {
            ASSERT_EQ(triangles_intersect(first, second), oracle_intersect(first, second));
            ASSERT_EQ(classify_pair(first, second), oracle_class(first, second));
        }
    }
}

TEST(TrianglesIntersect, EqualsRationalConstructionOnEveryPairOfTheUnitCube) {
    expect_every_pair_exact(all_triangles(test::cube_points(Vector3::Zero(), Vector3::Ones())));
}

TEST(TrianglesIntersect, EqualsRationalConstructionOnEveryPairOfAPlaneGrid) {
    std::vector<Vector3> points;
    points.reserve(9);
    for (int n = 0; n < 9; ++n) points.emplace_back(n % 3, n / 3, 0.0);
    expect_every_pair_exact(all_triangles(points));
}

TEST(TrianglesIntersect, IsTheSameForAllCornerOrdersAndAfterExchange) {
    std::mt19937_64 random(5);
    for (const Family& family : families) {
        for (int n = 0; n < 150; ++n) {
            const TrianglePairCase pair = family.make(random);
            const bool verdict = triangles_intersect(pair.first, pair.second);
            const PairClass pair_class = classify_pair(pair.first, pair.second);
            for (const auto& first_order : corner_orders) {
                for (const auto& second_order : corner_orders) {
                    const Corners first = reordered(pair.first, first_order);
                    const Corners second = reordered(pair.second, second_order);
                    ASSERT_EQ(triangles_intersect(first, second), verdict) << family.name;
                    ASSERT_EQ(triangles_intersect(second, first), verdict) << family.name;
                    ASSERT_EQ(classify_pair(first, second), pair_class) << family.name;
                    ASSERT_EQ(classify_pair(second, first), pair_class) << family.name;
                    ASSERT_EQ(oracle_class(second, first), pair_class) << family.name;
                }
            }
        }
    }
}

TEST(TrianglesIntersect, IsTheSameAtEveryPowerOfTwo) {
    std::mt19937_64 random(6);
    for (const Family& family : families) {
        for (int n = 0; n < 100; ++n) {
            const TrianglePairCase pair = family.make(random);
            const bool verdict = triangles_intersect(pair.first, pair.second);
            for (const int exponent : {-900, -400, -120, -20, 13, 100, 335, 500, 1000}) {
                const double factor = std::ldexp(1.0, exponent);
                const Corners first = scaled(pair.first, factor);
                const Corners second = scaled(pair.second, factor);
                ASSERT_EQ(triangles_intersect(first, second), verdict) << family.name << " 2^" << exponent;
                ASSERT_EQ(oracle_intersect(first, second), verdict) << family.name << " 2^" << exponent;
            }
        }
    }
}

TEST(TrianglesIntersect, DecidesSegmentsAndPoints) {
    const Corners face{Vector3(0, 0, 0), Vector3(4, 0, 0), Vector3(0, 4, 0)};
    const auto point = [](double x, double y, double z) {
        const Vector3 p(x, y, z);
        return Corners{p, p, p};
    };
    const auto segment = [](const Vector3& p, const Vector3& q) { return Corners{p, Vector3(0.5 * (p + q)), q}; };
    const struct {
        Corners first;
        Corners second;
        bool meet;
    } cases[] = {
        {face, point(1, 1, 0), true},
        {face, point(2, 2, 0), true},
        {face, point(0, 0, 0), true},
        {face, point(3, 2, 0), false},
        {face, point(1, 1, 1e-300), false},
        {face, segment({1, 1, -1}, {1, 1, 1}), true},
        {face, segment({3, 3, -1}, {3, 3, 1}), false},
        {face, segment({1, 1, 0}, {1, 1, 5}), true},
        {face, segment({-1, 1, 0}, {5, 1, 0}), true},
        {face, segment({5, 0, 0}, {9, 0, 0}), false},
        {face, segment({4, 0, 0}, {9, 0, 0}), true},
        {face, segment({-1, -1, 0}, {5, -1, 0}), false},
        {segment({0, 0, 0}, {2, 2, 2}), segment({2, 0, 0}, {0, 2, 2}), true},
        {segment({0, 0, 0}, {2, 2, 2}), segment({2, 0, 0}, {0, 2, 2.0000001}), false},
        {segment({0, 0, 0}, {2, 2, 2}), segment({1, 1, 1}, {5, 5, 5}), true},
        {segment({0, 0, 0}, {2, 2, 2}), segment({3, 3, 3}, {5, 5, 5}), false},
        {segment({0, 0, 0}, {2, 2, 2}), segment({1, 1, 0}, {3, 3, 2}), false},
        {segment({0, 0, 0}, {2, 2, 2}), point(1, 1, 1), true},
        {segment({0, 0, 0}, {2, 2, 2}), point(1, 1, 2), false},
        {point(1, 2, 3), point(1, 2, 3), true},
        {point(1, 2, 3), point(1, 2, 4), false},
    };
    for (std::size_t i = 0; i < std::size(cases); ++i) {
        EXPECT_EQ(triangles_intersect(cases[i].first, cases[i].second), cases[i].meet) << i;
        EXPECT_EQ(triangles_intersect(cases[i].second, cases[i].first), cases[i].meet) << i;
        EXPECT_EQ(oracle_intersect(cases[i].first, cases[i].second), cases[i].meet) << i;
        EXPECT_EQ(classify_pair(cases[i].first, cases[i].second), PairClass::degenerate) << i;
        EXPECT_EQ(oracle_class(cases[i].first, cases[i].second), PairClass::degenerate) << i;
    }
}

TEST(TrianglesIntersect, KeepsANeedleTipOneRoundingUnitApart) {
    const Corners face{Vector3(0, 0, 0.1), Vector3(1, 0, 0.1), Vector3(0, 1, 0.1)};
    const auto needle = [](double tip) {
        return Corners{Vector3(0.25, 0.25, tip), Vector3(0.3, 0.25, 1), Vector3(0.25, 0.3, 1)};
    };
    EXPECT_EQ(classify_pair(face, needle(0.1)), PairClass::touch_vertex);
    EXPECT_EQ(classify_pair(face, needle(std::nextafter(0.1, 1.0))), PairClass::disjoint);
    EXPECT_EQ(classify_pair(face, needle(std::nextafter(0.1, 0.0))), PairClass::transversal);
}

class TritriData : public testing::TestWithParam<const char*> {};

TEST_P(TritriData, AllVerdictsAndClassesAreExact) {
    TROCAR_DATA_OR_SKIP(file, "tritri/" + std::string(GetParam()) + ".txt");
    const std::vector<KnownPair> pairs = test::read_pairs(file);
    ASSERT_EQ(pairs.size(), 500U);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const KnownPair& pair = pairs[i];
        EXPECT_EQ(triangles_intersect(pair.first, pair.second), pair.truth == 1) << "line " << i + 1;
        EXPECT_EQ(oracle_intersect(pair.first, pair.second), pair.truth == 1) << "line " << i + 1;
        EXPECT_EQ(name_of(classify_pair(pair.first, pair.second)), pair.pair_class) << "line " << i + 1;
        EXPECT_EQ(name_of(oracle_class(pair.first, pair.second)), pair.pair_class) << "line " << i + 1;
    }
}

INSTANTIATE_TEST_SUITE_P(Families, TritriData, testing::ValuesIn(test::data_families),
                         [](const auto& family) { return std::string(family.param); });

}  // namespace
}  // namespace trocar
