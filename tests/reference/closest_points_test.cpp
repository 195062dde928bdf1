// The gap functions of the reference solver against the distance of triangles, dense sampling and closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "geometry/triangle_distance.hpp"
#include "measure/surface_distance.hpp"
#include "reference/closest_points.hpp"
#include "reference/signed_distance.hpp"
#include "support/meshes.hpp"
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

TEST(ClosestPoints, DistanceIsTheSmallestOverBothFeatures) {
    std::mt19937 random(7);
    for (const auto kind : {FeaturePair::Kind::vertex_face, FeaturePair::Kind::edge_edge}) {
        for (int i = 0; i < tries; ++i) {
            const auto p = random_points(random);
            const double found = distance_of({kind, {0, 1, 2, 3}}, p).distance;
            // Second derivation: the point and the edges as triangles without area.
            const TriangleDistance expected = kind == FeaturePair::Kind::edge_edge
                                                  ? triangle_distance({p[0], p[1], p[1]}, {p[2], p[3], p[3]})
                                                  : triangle_distance({p[0], p[0], p[0]}, {p[1], p[2], p[3]});
            EXPECT_NEAR(found, std::sqrt(expected.squared_distance), 1e-12);
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
    const Matrix3X x = test::matrix_of(test::cube_points(-Vector3::Ones(), Vector3::Constant(2.0)));
    const Triangles t = test::matrix_of(test::cube_faces);
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

TEST(SignedDistance, ToSharpTetrahedraHasTheSignOfTheirPlanes) {
    // Where faces meet at less than a right angle, one face alone does not decide on which side of the edge a point is.
    std::mt19937 random(11);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Triangles t(3, 4);
    t.col(0) << 0, 2, 1;
    t.col(1) << 0, 1, 3;
    t.col(2) << 1, 2, 3;
    t.col(3) << 0, 3, 2;
    int inside = 0;
    for (int i = 0; i < tries; ++i) {
        Matrix3X x(3, 4);
        for (int corner = 0; corner < 4; ++corner) x.col(corner) = test::random_vector(uniform, random);
        const Vector3 a = x.col(0);
        const double six_volumes = (x.col(1) - a).cross(x.col(2) - a).dot(x.col(3) - a);
        if (std::abs(six_volumes) < 0.05) continue;
        if (six_volumes < 0.0) x.col(0).swap(x.col(1));
        SignedDistance surface;
        surface.prepare(t, {0, 4}, x);
        for (int j = 0; j < 30; ++j) {
            const Vector3 p = (j < 10 ? 0.3 : 1.5) * test::random_vector(uniform, random) +
                              (j < 10 ? Vector3(x.rowwise().mean()) : Vector3::Zero().eval());
            double square = std::numeric_limits<double>::infinity();
            bool behind_all = true;
            for (int face = 0; face < 4; ++face) {
                const Vector3 u = x.col(t(0, face));
                const Vector3 v = x.col(t(1, face));
                const Vector3 w = x.col(t(2, face));
                square = std::min(square, squared_distance_to_triangle(u, v, w, p));
                behind_all = behind_all && (v - u).cross(w - u).dot(p - u) < 0.0;
            }
            const SurfacePoint near = surface.nearest(t, x, p);
            EXPECT_NEAR(near.signed_distance, (behind_all ? -1.0 : 1.0) * std::sqrt(square), 1e-9);
            EXPECT_FALSE(near.beyond_rim) << "a closed surface has none";
            Vector3 foot = Vector3::Zero();
            for (int corner = 0; corner < 3; ++corner) foot += near.weights[corner] * x.col(t(corner, near.triangle));
            EXPECT_LT((p - near.signed_distance * near.normal - foot).norm(), 1e-9);
            inside += behind_all ? 1 : 0;
        }
    }
    EXPECT_GT(inside, 100);
}

TEST(SignedDistance, ToARoofKnowsItsRidgeFromItsRim) {
    // Ridge from (-1, 0, 0) to (1, 0, 0), a slope of 45 degrees down to y = 1 and to y = -1; the outside is above.
    Matrix3X x(3, 6);
    x << -1, 1, -1, 1, -1, 1,  //
        0, 0, 1, 1, -1, -1,    //
        0, 0, -1, -1, -1, -1;
    Triangles roof(3, 4);
    roof << 0, 0, 0, 0,  //
        1, 3, 4, 5,      //
        3, 2, 5, 1;
    struct Case {
        Vector3 point;
        double distance;
        bool beyond_rim;
    };
    const double root = std::sqrt(0.5);
    const std::vector<Case> cases{
        {{0.3, 0.0, 0.5}, 0.5, false},              // over the ridge
        {{0.2, 0.1, -0.7}, -0.6 * root, false},     // under one slope
        {{0.2, -0.1, -0.7}, -0.6 * root, false},    // under the other
        {{0.0, 0.8, -0.2}, 0.6 * root, false},      // over the edge between the triangles of a slope
        {{0.2, 2.0, -1.5}, std::sqrt(1.25), true},  // beyond an eave
        {{0.2, -2.0, -1.5}, std::sqrt(1.25), true},
        {{1.5, 0.4, -0.2}, std::sqrt(0.27), true},  // beyond a gable: nearest is (1, 0.3, -0.3)
        {{2.0, 2.0, -1.5}, 1.5, true},              // beyond a corner
        {{-1.5, 0.0, 0.5}, root, true}};            // beyond an end of the ridge
    for (int turn = 0; turn < 3; ++turn) {
        Triangles triangles(3, 4);  // that begin at another corner
        for (int corner = 0; corner < 3; ++corner) triangles.row(corner) = roof.row((corner + turn) % 3);
        SignedDistance surface;
        surface.prepare(triangles, {0, 4}, x);
        for (const Case& one : cases) {
            const SurfacePoint near = surface.nearest(triangles, x, one.point);
            EXPECT_NEAR(near.signed_distance, one.distance, 1e-12) << one.point.transpose() << " turn " << turn;
            EXPECT_EQ(near.beyond_rim, one.beyond_rim) << one.point.transpose() << " turn " << turn;
        }
    }
}

TEST(SignedDistance, ToTrianglesAtOnePlaceIsThatToOne) {
    test::Shape copies;
    for (int i = 0; i < 8; ++i) copies.add(test::triangle({0, 0, 1}, {3, 0, 1}, {0, 4, 1}));
    const Matrix3X x = test::matrix_of(copies.vertices);
    const Triangles triangles = test::matrix_of(copies.triangles);
    SignedDistance surface;
    surface.prepare(triangles, {0, 8}, x);
    EXPECT_NEAR(surface.nearest(triangles, x, {1.0, 1.0, 3.0}).signed_distance, 2.0, 1e-12);
    EXPECT_NEAR(surface.nearest(triangles, x, {1.0, 1.0, -3.0}).signed_distance, -4.0, 1e-12);
}

}  // namespace
}  // namespace trocar
