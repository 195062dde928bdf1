// The float filter in front of the exact test: never wrong on anything, with every instruction set, and decisive on
// ordinary pairs. Truth is the oracle in rational arithmetic, which shares no code with it.
#include "detect/triangle_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "detect/narrow_phase.hpp"
#include "detect/triangle_batch.hpp"
#include "geometry/exact.hpp"
#include "geometry/triangle_families.hpp"
#include "support/data.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"

namespace trocar::test {
namespace {

struct Pairs {
    std::vector<Corners> first;
    std::vector<Corners> second;
    void add(const Corners& a, const Corners& b) {
        first.push_back(a);
        second.push_back(b);
    }
};

Shape shape_of(const std::vector<Corners>& triangles) {
    Shape shape;
    for (const auto& [a, b, c] : triangles) shape.add(triangle(a, b, c));
    return shape;
}

TriangleBatch batch_of(const Corners& a, const Corners& b) {
    TriangleBatch batch{};
    for (std::size_t lane = 0; lane < TriangleBatch::most; ++lane) put({a, b}, lane, batch);
    return batch;
}

/// Holds every target against the oracle; returns the share of pairs that the filter left open.
double hold_against_truth(const Pairs& pairs) {
    const World world =
        make_world("two bodies whose i-th triangles are the i-th pair",
                   {{BodyKind::tissue, shape_of(pairs.first)}, {BodyKind::tissue, shape_of(pairs.second)}});
    const auto count = static_cast<Index>(pairs.first.size());
    std::vector<TrianglePair> candidates;
    candidates.reserve(pairs.first.size());
    for (Index t = 0; t < count; ++t) candidates.push_back({t, count + t});
    std::vector<TrianglePair> expected;
    std::size_t open = 0;
    for (std::size_t i = 0; i < pairs.first.size(); ++i) {
        const bool meet = oracle_intersect(pairs.first[i], pairs.second[i]);
        if (meet) expected.push_back(candidates[i]);
        const TriangleBatch batch = batch_of(pairs.first[i], pairs.second[i]);
        const TriangleVerdicts plain = triangle_filters().back().decide(batch, 1);
        EXPECT_EQ(plain.meet & plain.undecided, 0U);
        if (plain.undecided == 0) {
            EXPECT_EQ(plain.meet == 1, meet) << "pair " << i;
        } else {
            ++open;
        }
        for (const TriangleFilter& filter : triangle_filters()) {
            const TriangleVerdicts verdicts = filter.decide(batch, 1);
            EXPECT_EQ(verdicts.meet, plain.meet) << filter.target << ", pair " << i;
            EXPECT_EQ(verdicts.undecided, plain.undecided) << filter.target << ", pair " << i;
        }
    }
    for (const TriangleFilter& filter : triangle_filters()) {
        std::vector<TrianglePair> found;
        test_pairs(TriangleTest::exact, world.topology, world.frame, candidates, found, filter);
        EXPECT_EQ(found, expected) << filter.target;
    }
    return static_cast<double>(open) / static_cast<double>(pairs.first.size());
}

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
Corners around(Random& random, const Vector3& centre, double size) {
    std::uniform_real_distribution<double> distribution(-size, size);
    Corners corners;
    for (Vector3& corner : corners) corner = centre + random_vector(distribution, random);
    return corners;
}
/// On every other call general corners, else such that much touches.
TrianglePairCase general_or_lattice(Random& random) {
    if (random() % 2 == 0) return lattice_pair(random, 5, 1.0, -2.0);
    return {around(random, Vector3::Zero(), 1.0), around(random, Vector3::Zero(), 1.0)};
}

TrianglePairCase ordinary(Random& random) {
    return {around(random, Vector3::Zero(), 0.005), around(random, Vector3::Zero(), 0.005)};
}
TrianglePairCase small_and_large(Random& random) {
    const Corners large = around(random, Vector3::Zero(), 0.002);
    // Around a point of the large one, so that many meet.
    const double s = uniform(random, 0.1, 0.5);
    const Corners small = around(random, large[0] + s * (large[1] - large[0]) + s * (large[2] - large[0]), 0.0002);
    return random() % 2 == 0 ? TrianglePairCase{large, small} : TrianglePairCase{small, large};
}
TrianglePairCase far_from_the_origin(Random& random) {
    const Vector3 place(1e4, -2e4, 3e4);
    return {around(random, place, 0.005), around(random, place, 0.005)};
}
TrianglePairCase on_a_lattice(Random& random) { return lattice_pair(random, 3 + 2 * static_cast<int>(random() % 4)); }
TrianglePairCase one_rounding_unit_off_a_touch(Random& random) {
    TrianglePairCase pair = nearly_touching_pair(random);
    jitter(random, pair.second);
    return pair;
}
/// Heights of a few float units over a plane: where the error bound is at work.
TrianglePairCase near_the_limit_of_float(Random& random) {
    TrianglePairCase pair;
    const Corners& a = pair.first = around(random, Vector3::Zero(), 1.0);
    const Vector3 normal = (a[1] - a[0]).cross(a[2] - a[0]).normalized();
    for (Vector3& corner : pair.second) {
        corner = a[0] + uniform(random, -0.2, 1.0) * (a[1] - a[0]) + uniform(random, -0.2, 1.0) * (a[2] - a[0]) +
                 uniform(random, -4e-6, 4e-6) * normal;
    }
    return pair;
}
TrianglePairCase subnormal_and_mixed_magnitudes(Random& random) {
    constexpr std::array<double, 8> magnitude{5e-324, 1e-310, 1e-200, 1e-46, 1e-40, 1.0, 1e18, 1e100};
    TrianglePairCase pair = lattice_pair(random, 7, 1.0, -3.0);
    const std::size_t most = random() % 2 == 0 ? 5 : 8;
    for (Corners* corners : {&pair.first, &pair.second}) {
        for (Vector3& corner : *corners) {
            for (double& x : corner) x *= magnitude[random() % most];
        }
    }
    return pair;
}
TrianglePairCase segments_points_and_needles(Random& random) {
    TrianglePairCase pair = general_or_lattice(random);
    Corners& a = pair.first;
    Corners& b = pair.second;
    const std::uint64_t kind = random();
    if (kind % 3 == 0) a[2] = a[1];
    if (kind % 5 == 0) b[1] = b[0];
    if (kind % 15 == 0) b[2] = b[0];
    if (kind % 7 == 0) b[2] = 0.5 * (b[0] + b[1]) + 1e-9 * b[2];
    if (kind % 4 == 0) a[0] = 0.5 * (b[0] + b[1]);
    return pair;
}

struct Family {
    const char* name;
    TrianglePairCase (*make)(Random&);
    int count;
    double most_open = 1.0;  ///< share of the pairs that it may leave open
};
void PrintTo(const Family& family, std::ostream* stream) { *stream << family.name; }

class TriangleFilterFamily : public testing::TestWithParam<Family> {};

TEST_P(TriangleFilterFamily, NeverErrsAndDecidesOrdinaryPairsItself) {
    Random random(1);
    Pairs pairs;
    for (int i = 0; i < GetParam().count; ++i) {
        const TrianglePairCase pair = GetParam().make(random);
        pairs.add(pair.first, pair.second);
    }
    EXPECT_LE(hold_against_truth(pairs), GetParam().most_open);
}

INSTANTIATE_TEST_SUITE_P(Of, TriangleFilterFamily,
                         testing::Values(Family{"ordinary", ordinary, 3000, 0.01},
                                         Family{"small_and_large", small_and_large, 2000, 0.03},
                                         Family{"far_from_the_origin", far_from_the_origin, 1000, 0.01},
                                         Family{"on_a_lattice", on_a_lattice, 4000},
                                         Family{"one_rounding_unit_off_a_touch", one_rounding_unit_off_a_touch, 3000},
                                         Family{"near_the_limit_of_float", near_the_limit_of_float, 4000},
                                         Family{"subnormal_and_mixed_magnitudes", subnormal_and_mixed_magnitudes, 1000},
                                         Family{"segments_points_and_needles", segments_points_and_needles, 2000}),
                         [](const auto& family) { return family.param.name; });

TEST(TriangleFilter, NeverErrsAtAnyScale) {
    for (const double scale : {1e-300, 1e-160, 1e-45, 1e-38, 1e-20, 1e-12, 1e-9, 1e-6, 1e6, 1e11, 1e12, 1e30, 1e150}) {
        SCOPED_TRACE(scale);
        Random random(7);
        Pairs pairs;
        for (int i = 0; i < 150; ++i) {
            const TrianglePairCase pair = general_or_lattice(random);
            pairs.add(scaled(pair.first, scale), scaled(pair.second, i % 3 == 0 ? scale * 1e-4 : scale));
        }
        hold_against_truth(pairs);
    }
}

TEST(TriangleFilter, LeavesNumbersBeyondFloatOpen) {
    const float infinity = std::numeric_limits<float>::infinity();
    for (const float bad : {infinity, std::numeric_limits<float>::quiet_NaN(), 1e30F}) {
        TriangleBatch batch = batch_of({Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)},
                                       {Vector3(0, 0, 5), Vector3(1, 0, 5), Vector3(0, 1, 5)});
        batch.w[2].fill(bad);
        for (const TriangleFilter& filter : triangle_filters()) {
            EXPECT_EQ(filter.decide(batch, 64).undecided, ~std::uint64_t{0}) << filter.target;
        }
    }
}

class TriangleFilterData : public testing::TestWithParam<const char*> {};

TEST_P(TriangleFilterData, NeverErrsOnTheFamilies) {
    TROCAR_DATA_OR_SKIP(file, "tritri/" + std::string(GetParam()) + ".txt");
    Pairs pairs;
    for (const KnownPair& pair : read_pairs(file)) pairs.add(pair.first, pair.second);
    ASSERT_EQ(pairs.first.size(), 500U);
    hold_against_truth(pairs);
}

INSTANTIATE_TEST_SUITE_P(Families, TriangleFilterData, testing::ValuesIn(data_families),
                         [](const auto& family) { return std::string(family.param); });

}  // namespace
}  // namespace trocar::test
