// The float filter for near pairs: never wrong on anything, with every instruction set, and decisive on ordinary pairs.
#include "detect/near_filter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "detect/triangle_batch.hpp"
#include "geometry/triangle_distance.hpp"
#include "geometry/triangle_families.hpp"
#include "support/random_vectors.hpp"

namespace trocar::test {
namespace {

using Random = std::mt19937_64;

/// Holds every target against double precision at a query distance that is `factor` times the distance; returns the
/// share of pairs that the best filter left open.
double hold(const std::function<TrianglePairCase(Random&)>& family, double factor, std::uint64_t seed) {
    Random random(seed);
    int count = 0;
    int open = 0;
    for (int k = 0; k < 4000; ++k) {
        const TrianglePairCase pair = family(random);
        if (triangles_intersect(pair.first, pair.second)) continue;
        const double distance = std::sqrt(triangle_distance(pair.first, pair.second).squared_distance);
        if (!(distance > 0.0)) continue;
        const auto query_distance = static_cast<float>(factor * distance);
        if (!(query_distance > 0.0F)) continue;
        TriangleBatch batch{};
        const std::size_t lane = static_cast<std::size_t>(k) % TriangleBatch::most;
        put(pair, lane, batch);
        const std::uint64_t asked = std::uint64_t{1} << lane;
        ++count;
        for (const TriangleFilter& filter : triangle_filters()) {
            const NearVerdicts verdicts = filter.decide_near(batch, asked, query_distance);
            EXPECT_EQ((verdicts.near | verdicts.undecided) & ~asked, 0U) << "reported lanes that were not asked for";
            EXPECT_EQ(verdicts.near & verdicts.undecided, 0U);
            if (&filter == &triangle_filters().front()) open += verdicts.undecided != 0 ? 1 : 0;
            if (verdicts.undecided != 0) continue;
            const bool near = verdicts.near != 0;
            EXPECT_TRUE(near ? distance <= query_distance : distance > query_distance)
                << filter.target << ": distance " << distance << ", query distance " << query_distance << ", said "
                << (near ? "proximity" : "far");
        }
    }
    EXPECT_GT(count, 500);
    return static_cast<double>(open) / count;
}

/// Two triangles of edge about 1, of which the second is moved by up to 1.5.
TrianglePairCase ordinary(Random& random) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto point = [&] { return random_vector(uniform, random); };
    const Vector3 away = 1.5 * point();
    return {{point(), point(), point()}, {Vector3(away + point()), Vector3(away + point()), Vector3(away + point())}};
}
/// Corners in two parallel planes, edges often parallel.
TrianglePairCase layered(Random& random) {
    TrianglePairCase pair = lattice_pair(random, 5, 0.25);
    for (Vector3& corner : pair.first) corner[2] = 0.0;
    for (Vector3& corner : pair.second) corner[2] = 0.125;
    return pair;
}
TrianglePairCase coplanar(Random& random) {
    TrianglePairCase pair = ordinary(random);
    for (Corners* t : {&pair.first, &pair.second}) {
        for (Vector3& corner : *t) corner[2] = 0.25;
    }
    return pair;
}
TrianglePairCase needles(Random& random) {
    TrianglePairCase pair = ordinary(random);
    for (Corners* t : {&pair.first, &pair.second}) (*t)[2] = (*t)[1] + 1e-5 * ((*t)[2] - (*t)[1]);
    return pair;
}
TrianglePairCase segments(Random& random) { return without_area(random, ordinary(random)); }

TEST(NearFilter, IsRightAndDecidesNearlyAllOrdinaryPairs) {
    for (const double factor : {0.3, 0.9, 0.999, 1.001, 1.1, 4.0}) {
        EXPECT_LT(hold(ordinary, factor, 1), 0.01) << factor;
        EXPECT_LT(hold(layered, factor, 2), 0.05) << factor;
        EXPECT_LT(hold(coplanar, factor, 3), 0.05) << factor;
    }
}

TEST(NearFilter, IsRightWhereDistanceAndQueryDistanceDifferByRounding) {
    for (const double factor : {1.0, 1.0 - 1e-5, 1.0 + 1e-5, 1.0 - 1e-6, 1.0 + 1e-6, 1.0 - 1e-7, 1.0 + 1e-7}) {
        for (const auto& family : {ordinary, layered, coplanar, needles, segments}) hold(family, factor, 4);
    }
}

TEST(NearFilter, IsRightOnNeedlesSegmentsPointsAndNearlyTouchingPairs) {
    for (const double factor : {0.5, 0.99, 1.01, 2.0}) {
        hold(needles, factor, 5);
        hold(segments, factor, 6);
        hold(nearly_touching_pair, factor, 7);
        hold([](Random& random) { return lattice_pair(random, 4, 0.25, 1000.0); }, factor, 8);
    }
}

TEST(NearFilter, IsRightInAnyUnitAndFarApart) {
    for (const double unit : {1e-30, 1e-12, 1e-6, 1e-3, 1e3, 1e9, 1e15, 1e30}) {
        for (const double factor : {0.9, 1.1}) {
            const double open = hold(
                [unit](Random& random) {
                    const TrianglePairCase pair = ordinary(random);
                    return TrianglePairCase{scaled(pair.first, unit), scaled(pair.second, unit)};
                },
                factor, 9);
            EXPECT_LT(open, unit >= 1e-3 && unit <= 1e9 ? 0.01 : 1.1) << unit;
        }
    }
    for (const double away : {1e2, 1e4, 1e7}) {
        hold(
            [away](Random& random) {
                TrianglePairCase pair = ordinary(random);
                for (Vector3& corner : pair.second) corner += Vector3(away, 0.5 * away, 0.0);
                return pair;
            },
            1.0001, 10);
    }
}

}  // namespace
}  // namespace trocar::test
