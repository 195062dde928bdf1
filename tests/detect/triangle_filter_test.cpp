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

/// Two bodies whose i-th triangles are the i-th pair.
struct PairWorld {
    explicit PairWorld(const Pairs& pairs) {
        const auto count = static_cast<Index>(pairs.first.size());
        std::vector<Body> bodies(2);
        bodies[0].name = "first";
        bodies[1].name = "second";
        frame.position.resize(3, 6 * count);
        for (std::size_t b = 0; b < 2; ++b) {
            bodies[b].vertex_count = 3 * count;
            bodies[b].triangles.resize(3, count);
            for (Index t = 0; t < count; ++t) {
                for (Index k = 0; k < 3; ++k) {
                    bodies[b].triangles(k, t) = 3 * t + k;
                    const auto& corners = (b == 0 ? pairs.first : pairs.second)[static_cast<std::size_t>(t)];
                    frame.position.col(static_cast<Index>(b) * 3 * count + 3 * t + k) =
                        corners[static_cast<std::size_t>(k)];
                }
                if (b == 0) candidates.push_back({t, count + t});
            }
        }
        topology = make_topology(bodies, {{0, 1}});
    }
    Topology topology;
    Frame frame;
    std::vector<TrianglePair> candidates;
};

TriangleBatch batch_of(const Corners& a, const Corners& b) {
    TriangleBatch batch{};
    for (std::size_t lane = 0; lane < TriangleBatch::most; ++lane) put({a, b}, lane, batch);
    return batch;
}

/// Holds every target against the oracle; returns the share of pairs that the filter left open.
double hold_against_truth(const Pairs& pairs) {
    const PairWorld world(pairs);
    std::vector<TrianglePair> expected;
    std::size_t open = 0;
    for (std::size_t i = 0; i < pairs.first.size(); ++i) {
        const bool meet = oracle_intersect(pairs.first[i], pairs.second[i]);
        if (meet) expected.push_back(world.candidates[i]);
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
        test_pairs(TriangleTest::exact, world.topology, world.frame, world.candidates, found, filter);
        EXPECT_EQ(found, expected) << filter.target;
    }
    return static_cast<double>(open) / static_cast<double>(pairs.first.size());
}

class RandomCorners {
public:
    explicit RandomCorners(std::uint32_t seed) : random_(seed) {}
    Vector3 point(double size) {
        std::uniform_real_distribution<double> uniform(-size, size);
        return {uniform(random_), uniform(random_), uniform(random_)};
    }
    Vector3 lattice_point(int most) {
        std::uniform_int_distribution<int> number(-most, most);
        return {static_cast<double>(number(random_)), static_cast<double>(number(random_)),
                static_cast<double>(number(random_))};
    }
    Corners triangle(double size) { return {point(size), point(size), point(size)}; }
    Corners lattice_triangle(int most) { return {lattice_point(most), lattice_point(most), lattice_point(most)}; }
    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    int below(int limit) { return std::uniform_int_distribution<int>(0, limit - 1)(random_); }
    /// Moves each coordinate by −1, 0 or +1 unit in the last place.
    void nudge(Corners& corners) {
        for (Vector3& corner : corners) {
            for (double& x : corner) {
                const int step = below(3) - 1;
                if (step != 0) x = std::nextafter(x, step * std::numeric_limits<double>::infinity());
            }
        }
    }

private:
    std::mt19937 random_;
};

TEST(TriangleFilter, DecidesOrdinaryPairsItself) {
    RandomCorners random(1);
    Pairs pairs;
    for (int i = 0; i < 3000; ++i) pairs.add(random.triangle(0.005), random.triangle(0.005));
    EXPECT_LT(hold_against_truth(pairs), 0.01);
}

TEST(TriangleFilter, DecidesSmallTrianglesAgainstLargeOnes) {
    RandomCorners random(2);
    Pairs pairs;
    for (int i = 0; i < 2000; ++i) {
        const Corners large = random.triangle(0.002);
        // Around a point of the large one, so that many meet.
        const double s = random.uniform(0.1, 0.5);
        const Vector3 centre = large[0] + s * (large[1] - large[0]) + s * (large[2] - large[0]);
        Corners small = random.triangle(0.0002);
        for (Vector3& corner : small) corner += centre;
        pairs.add(i % 2 == 0 ? large : small, i % 2 == 0 ? small : large);
    }
    EXPECT_LT(hold_against_truth(pairs), 0.03);
}

TEST(TriangleFilter, FarFromTheOriginDecidesAsWell) {
    RandomCorners random(3);
    Pairs pairs;
    for (int i = 0; i < 1000; ++i) {
        Corners a = random.triangle(0.005);
        Corners b = random.triangle(0.005);
        for (Corners* corners : {&a, &b}) {
            for (Vector3& corner : *corners) corner += Vector3(1e4, -2e4, 3e4);
        }
        pairs.add(a, b);
    }
    EXPECT_LT(hold_against_truth(pairs), 0.01);
}

TEST(TriangleFilter, NeverErrsOnLatticesWhereMuchTouches) {
    RandomCorners random(4);
    Pairs pairs;
    for (int i = 0; i < 4000; ++i) pairs.add(random.lattice_triangle(1 + i % 4), random.lattice_triangle(1 + i % 4));
    hold_against_truth(pairs);
}

TEST(TriangleFilter, NeverErrsOneRoundingUnitOffATouch) {
    RandomCorners random(5);
    Pairs pairs;
    for (int i = 0; i < 3000; ++i) {
        // Corners of b on a corner, on an edge or in the face of a, as nearly as doubles go.
        const Corners a = random.triangle(1.0);
        Corners b = random.triangle(1.0);
        const double s = random.uniform(0.0, 0.5);
        const double t = i % 3 == 0 ? 0.0 : random.uniform(0.0, 0.5);
        b[0] = i % 5 == 0 ? a[1] : Vector3(a[0] + s * (a[1] - a[0]) + t * (a[2] - a[0]));
        if (i % 7 == 0) b[1] = a[2];
        if (i % 11 == 0) b[2] = Vector3(a[0] + 0.25 * (a[1] - a[0]) + 0.25 * (a[2] - a[0]));
        random.nudge(b);
        pairs.add(a, b);
    }
    hold_against_truth(pairs);
}

TEST(TriangleFilter, NeverErrsNearTheLimitOfFloat) {
    // Heights of a few float units over a plane: where the error bound is at work.
    RandomCorners random(6);
    Pairs pairs;
    for (int i = 0; i < 4000; ++i) {
        const Corners a = random.triangle(1.0);
        const Vector3 normal = (a[1] - a[0]).cross(a[2] - a[0]).normalized();
        Corners b;
        for (Vector3& corner : b) {
            corner = a[0] + random.uniform(-0.2, 1.0) * (a[1] - a[0]) + random.uniform(-0.2, 1.0) * (a[2] - a[0]) +
                     random.uniform(-4e-6, 4e-6) * normal;
        }
        pairs.add(a, b);
    }
    hold_against_truth(pairs);
}

TEST(TriangleFilter, NeverErrsAtAnyScale) {
    for (const double scale : {1e-300, 1e-160, 1e-45, 1e-38, 1e-20, 1e-12, 1e-9, 1e-6, 1e6, 1e11, 1e12, 1e30, 1e150}) {
        SCOPED_TRACE(scale);
        RandomCorners random(7);
        Pairs pairs;
        for (int i = 0; i < 150; ++i) {
            Corners a = i % 2 == 0 ? random.triangle(1.0) : random.lattice_triangle(2);
            Corners b = i % 2 == 0 ? random.triangle(1.0) : random.lattice_triangle(2);
            for (Vector3& corner : a) corner *= scale;
            for (Vector3& corner : b) corner *= i % 3 == 0 ? scale * 1e-4 : scale;
            pairs.add(a, b);
        }
        hold_against_truth(pairs);
    }
}

TEST(TriangleFilter, NeverErrsOnSubnormalNumbersAndMixedMagnitudes) {
    RandomCorners random(8);
    Pairs pairs;
    const std::array<double, 8> magnitude{5e-324, 1e-310, 1e-200, 1e-46, 1e-40, 1.0, 1e18, 1e100};
    for (int i = 0; i < 1000; ++i) {
        Corners a = random.lattice_triangle(3);
        Corners b = random.lattice_triangle(3);
        for (Corners* corners : {&a, &b}) {
            for (Vector3& corner : *corners) {
                for (double& x : corner) x *= magnitude[static_cast<std::size_t>(random.below(i % 2 == 0 ? 5 : 8))];
            }
        }
        pairs.add(a, b);
    }
    hold_against_truth(pairs);
}

TEST(TriangleFilter, NeverErrsOnSegmentsPointsAndNeedles) {
    RandomCorners random(9);
    Pairs pairs;
    for (int i = 0; i < 2000; ++i) {
        Corners a = i % 2 == 0 ? random.triangle(1.0) : random.lattice_triangle(2);
        Corners b = i % 2 == 0 ? random.triangle(1.0) : random.lattice_triangle(2);
        if (i % 3 == 0) a[2] = a[1];
        if (i % 5 == 0) b[1] = b[0];
        if (i % 15 == 0) b[2] = b[0];
        if (i % 7 == 0) b[2] = 0.5 * (b[0] + b[1]) + 1e-9 * random.point(1.0);
        if (i % 4 == 0) a[0] = 0.5 * (b[0] + b[1]);
        pairs.add(a, b);
    }
    hold_against_truth(pairs);
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
