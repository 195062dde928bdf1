#include "respond/equations.hpp"

#include <gtest/gtest.h>

#include <random>

namespace trocar::equations {
namespace {

class RandomVectors {
public:
    Vector3 next() { return {spread_(generator_), spread_(generator_), spread_(generator_)}; }
    Corners triangle() { return {next(), next(), next()}; }
    double positive() { return 1.5 + spread_(generator_); }

private:
    std::mt19937_64 generator_{7};
    std::uniform_real_distribution<double> spread_{-1.0, 1.0};
};

TEST(Equation37, HitLiesOnPathAndFaceAndOnlyInside) {
    RandomVectors random;
    int hits = 0;
    for (int i = 0; i < 20000; ++i) {
        const Corners face = random.triangle();
        const Vector3 from = random.next();
        const Vector3 to = random.next();
        const PathHit hit = path_hit(face, from, to);
        // Second derivation: solve a + s (b - a) + t (c - a) = from + f (to - from).
        Matrix3 matrix;
        matrix << face[1] - face[0], face[2] - face[0], from - to;
        const Vector3 solution = matrix.fullPivLu().solve(from - face[0]);
        const double margin =
            std::min({solution[0], solution[1], 1.0 - solution[0] - solution[1], solution[2], 1.0 - solution[2]});
        if (std::abs(margin) < 1e-9) continue;
        ASSERT_EQ(hit.found, margin > 0.0);
        if (!hit.found) continue;
        ++hits;
        EXPECT_NEAR(hit.fraction, solution[2], 1e-8);
    }
    EXPECT_GT(hits, 500);
}

TEST(Equation37, PathInThePlaneOrWithoutLengthHasNoHit) {
    const Corners face{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)};
    EXPECT_FALSE(path_hit(face, Vector3(0.1, 0.1, 0), Vector3(0.2, 0.2, 0)).found);
    EXPECT_FALSE(path_hit(face, Vector3(0.1, 0.1, -1), Vector3(0.1, 0.1, -1)).found);
    EXPECT_FALSE(
        path_hit({Vector3::Zero(), Vector3::Zero(), Vector3::Zero()}, Vector3(0, 0, 1), Vector3(0, 0, -1)).found);
}

TEST(Equation38, EquilibriumSumsStretchPreloadAndDamperAlongEachSpring) {
    // By hand: a neighbour 0.5 m along (0.6, 0.8, 0) that leaves at 0.5 m/s relative to the vertex, and one 0.1 m along
    // -z, shorter than at rest, that comes nearer at 0.2 m/s.
    const std::array<NeighbourSpring, 2> springs{NeighbourSpring{.neighbour = Vector3(1.3, 2.4, 3.0),
                                                                 .neighbour_velocity = Vector3(0.4, 0.5, 0.0),
                                                                 .rest = 0.4,
                                                                 .k = 20.0,
                                                                 .preload = 0.7,
                                                                 .damping = 3.0},
                                                 NeighbourSpring{.neighbour = Vector3(1.0, 2.0, 2.9),
                                                                 .neighbour_velocity = Vector3(0.1, 0.1, 0.2),
                                                                 .rest = 0.15,
                                                                 .k = 50.0,
                                                                 .preload = 0.3,
                                                                 .damping = 2.0}};
    const Vector3 force =
        equilibrium_force(Vector3(1.0, 2.0, 3.0), Vector3(0.1, 0.1, 0.0), springs, Vector3(0.0, 0.0, -1.0));
    const double first = 20.0 * 0.1 + 0.7 + 3.0 * (0.3 * 0.6 + 0.4 * 0.8);
    const double second = 50.0 * -0.05 + 0.3 + 2.0 * -0.2;
    EXPECT_LT((force - Vector3(0.6 * first, 0.8 * first, -second - 1.0)).norm(), 1e-13);
}

TEST(Equation317, TinyAndEqualVelocitiesStayFinite) {
    const Exchange tiny = tissue_tissue(1.0, 3.0, Vector3(3e-200, 0, 0), Vector3(0, 4e-200, 0));
    EXPECT_TRUE(tiny.direction_defined);
    EXPECT_NEAR(tiny.direction.norm(), 1.0, 1e-15);
    const Exchange equal = tissue_tissue(1.0, 3.0, Vector3(1, 2, 3), Vector3(1, 2, 3));
    EXPECT_FALSE(equal.direction_defined);
    EXPECT_EQ(equal.velocity1_after, Vector3(1, 2, 3));
}

TEST(Depths, FollowTheCornerOrder) {
    const Corners face{Vector3(0, 0, 5), Vector3(1, 0, 5), Vector3(0, 1, 5)};
    const Corners other{Vector3(0, 0, 4), Vector3(3, 0, 6), Vector3(0, 9, 2)};
    const auto depths = depths_below(face, other);
    EXPECT_EQ(depths, (std::array<double, 3>{1.0, -1.0, 3.0}));
    EXPECT_EQ(deepest_corner(depths), 2);
    EXPECT_EQ(depths_below({face[0], face[2], face[1]}, other), (std::array<double, 3>{-1.0, 1.0, -3.0}));
}

TEST(Distribution, KeepsForceAndMoment) {
    RandomVectors random;
    for (int i = 0; i < 2000; ++i) {
        const Corners triangle = random.triangle();
        const Vector3 weights = closest_point_on_triangle(triangle, 1.5 * random.next());
        ASSERT_GE(weights.minCoeff(), -1e-12);
        ASSERT_NEAR(weights.sum(), 1.0, 1e-12);
        const Vector3 p = weights[0] * triangle[0] + weights[1] * triangle[1] + weights[2] * triangle[2];
        const Vector3 force = random.next();
        const auto shares = distribute_force(weights, force);
        const Vector3 about = random.next();
        const Wrench sum = resultant(triangle, shares, about);
        EXPECT_LT((sum.force - force).norm(), 1e-13);
        EXPECT_LT((sum.moment - (p - about).cross(force)).norm(), 1e-13);
        const Vector3 masses(random.positive(), random.positive(), random.positive());
        const auto moves = distribute_correction(weights, masses, force);
        EXPECT_LT((weights[0] * moves[0] + weights[1] * moves[1] + weights[2] * moves[2] - force).norm(), 1e-13);
    }
}

}  // namespace
}  // namespace trocar::equations
