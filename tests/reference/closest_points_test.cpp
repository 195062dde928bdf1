// The gap functions of the reference solver against dense sampling and closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "reference/closest_points.hpp"
#include "reference/signed_distance.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"

namespace trocar {
namespace {

constexpr int tries = 300;

std::array<Vector3, 4> random_points(std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::array<Vector3, 4> points;
    for (Vector3& p : points) p = test::random_vector(uniform, random);
    return points;
}

/// Smallest distance by sampling both features finely.
double sampled_distance(FeaturePair::Kind kind, const std::array<Vector3, 4>& p) {
    constexpr int n = 60;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j) {
            const double s = static_cast<double>(i) / n;
            const double t = static_cast<double>(j) / n;
            if (kind == FeaturePair::Kind::edge_edge) {
                least = std::min(least, ((1 - s) * p[0] + s * p[1] - (1 - t) * p[2] - t * p[3]).norm());
            } else if (s + t <= 1.0 + 1e-12) {
                least = std::min(least, (p[0] - (1 - s - t) * p[1] - s * p[2] - t * p[3]).norm());
            }
        }
    }
    return least;
}

TEST(ClosestPoints, DistanceIsTheSmallestOverBothFeatures) {
    std::mt19937 random(7);
    for (const auto kind : {FeaturePair::Kind::vertex_face, FeaturePair::Kind::edge_edge}) {
        for (int i = 0; i < tries; ++i) {
            const auto points = random_points(random);
            const double found = distance_of({kind, {0, 1, 2, 3}}, points).distance;
            const double sampled = sampled_distance(kind, points);
            EXPECT_LE(found, sampled + 1e-12);
            EXPECT_NEAR(found, sampled, 0.05);
        }
    }
}

TEST(ClosestPoints, GradientIsThatOfTheDistance) {
    std::mt19937 random(8);
    for (const auto kind : {FeaturePair::Kind::vertex_face, FeaturePair::Kind::edge_edge}) {
        for (int i = 0; i < tries; ++i) {
            auto points = random_points(random);
            const FeaturePair pair{kind, {0, 1, 2, 3}};
            const FeatureDistance near = distance_of(pair, points);
            if (near.distance < 0.05) continue;
            constexpr double h = 1e-6;
            for (std::size_t p = 0; p < 4; ++p) {
                for (int axis = 0; axis < 3; ++axis) {
                    auto forward = points;
                    auto backward = points;
                    forward[p][axis] += h;
                    backward[p][axis] -= h;
                    const double slope =
                        (distance_of(pair, forward).distance - distance_of(pair, backward).distance) / (2.0 * h);
                    EXPECT_NEAR(near.weight[p] * near.normal[axis], slope, 1e-4);
                }
            }
        }
    }
}

TEST(ClosestPoints, SafeMotionNeverLetsFeaturesMeet) {
    std::mt19937 random(9);
    int stopped = 0;
    for (const auto kind : {FeaturePair::Kind::vertex_face, FeaturePair::Kind::edge_edge}) {
        for (int i = 0; i < tries; ++i) {
            const auto points = random_points(random);
            auto motion = random_points(random);
            for (Vector3& m : motion) m *= 2.0;
            const FeaturePair pair{kind, {0, 1, 2, 3}};
            const double first = distance_of(pair, points).distance;
            const double part = safe_part_of_motion(pair, points, motion);
            stopped += part < 1.0 ? 1 : 0;
            for (int step = 0; step <= 200; ++step) {
                auto moved = points;
                for (std::size_t p = 0; p < 4; ++p) moved[p] += part * step / 200.0 * motion[p];
                EXPECT_GT(distance_of(pair, moved).distance, 0.04 * first);
            }
        }
    }
    EXPECT_GT(stopped, 20);
}

TEST(SignedDistance, ToABoxIsItsClosedForm) {
    // Cube of edge 2 around the origin.
    Matrix3X x(3, 8);
    for (int i = 0; i < 8; ++i) x.col(i) = Vector3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    Triangles t(3, 12);
    t << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1, 2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7, 3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
    SignedDistance surface;
    surface.prepare(t, {0, 12}, x);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-2.0, 2.0);
    for (int i = 0; i < tries; ++i) {
        const Vector3 p = test::random_vector(uniform, random);
        const Vector3 q = p.cwiseAbs() - Vector3::Ones();
        const double expected = q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
        EXPECT_NEAR(surface.nearest(t, x, p).signed_distance, expected, 1e-12);
    }
}

}  // namespace
}  // namespace trocar
