#include "geometry/dihedral.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "geometry/enclosed_volume.hpp"
#include "support/random_vectors.hpp"

namespace trocar {
namespace {

HingeCorners random_hinge(std::mt19937& random) {
    std::uniform_real_distribution<double> some(-0.3, 0.3);
    const auto near = [&](double x, double y) {
        return Vector3(Vector3(x, y, 0.0) + test::random_vector(some, random));
    };
    return {near(0, 0), near(0, 1), near(-1, 0.5), near(1, 0.5)};
}

TEST(AngleOf, IsTheArctangentOfBothArguments) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> turn(-std::numbers::pi, std::numbers::pi);
    std::uniform_real_distribution<double> power(-40.0, 40.0);
    for (int trial = 0; trial < 100000; ++trial) {
        const double angle = trial % 3 == 0 ? std::pow(10.0, 0.3 * power(random)) : turn(random);
        const double size = std::pow(10.0, power(random));
        const double y = size * std::sin(angle);
        const double x = size * std::cos(angle);
        const double expected = std::atan2(y, x);
        EXPECT_NEAR(angle_of(y, x), expected, 2e-15 * std::abs(expected)) << y << " " << x;
    }
    EXPECT_EQ(angle_of(0.0, 2.0), 0.0);
    EXPECT_EQ(angle_of(0.0, -2.0), std::numbers::pi);
    EXPECT_NEAR(angle_of(-3.0, 0.0), -0.5 * std::numbers::pi, 1e-15);
    EXPECT_TRUE(std::isnan(angle_of(0.0, 0.0)));
}

TEST(Dihedral, IsTheAngleOfAFoldPositiveWhereTheEdgeStandsOut) {
    // Seen from above the edge runs along y, the wings hang down (or stand up) by an angle each.
    for (const double degrees : {-80.0, -30.0, 0.0, 10.0, 45.0, 85.0}) {
        const double down = degrees * std::numbers::pi / 180.0;
        const HingeCorners corner{Vector3(0, 0, 0), Vector3(0, 0.3, 0),
                                  Vector3(-2.0 * std::cos(down), 0.1, -2.0 * std::sin(down)),
                                  Vector3(0.5 * std::cos(down), 0.4, -0.5 * std::sin(down))};
        const Dihedral fold = dihedral(corner);
        ASSERT_TRUE(fold.has_angle);
        EXPECT_NEAR(fold.angle, 2.0 * down, 1e-14);
        // A far corner that is lifted by dz off its wing turns it by dz over its height, 2 and 0.5 here.
        EXPECT_NEAR(fold.gradient[2].norm(), 1.0 / 2.0, 1e-14);
        EXPECT_NEAR(fold.gradient[3].norm(), 1.0 / 0.5, 1e-14);
        EXPECT_LT(fold.gradient[2].dot(Vector3(-std::sin(down), 0, std::cos(down))), 0.0) << "lifting flattens";
    }
}

TEST(Dihedral, GradientAndItsChangeAreThoseOfFiniteDifferences) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> some(-1.0, 1.0);
    constexpr double h = 1e-5;
    for (int trial = 0; trial < 50; ++trial) {
        const HingeCorners corner = random_hinge(random);
        const Dihedral here = dihedral(corner);
        std::array<Vector3, 4> way;
        for (Vector3& one : way) one = test::random_vector(some, random);
        HingeCorners ahead = corner;
        HingeCorners behind = corner;
        double slope = 0.0;
        for (std::size_t c = 0; c < 4; ++c) {
            ahead[c] += h * way[c];
            behind[c] -= h * way[c];
            slope += here.gradient[c].dot(way[c]);
        }
        EXPECT_NEAR(slope, (dihedral(ahead).angle - dihedral(behind).angle) / (2.0 * h), 1e-7);
        const std::array<Vector3, 4> change = gradient_change(corner, way);
        for (std::size_t c = 0; c < 4; ++c) {
            const Vector3 expected = (dihedral(ahead).gradient[c] - dihedral(behind).gradient[c]) / (2.0 * h);
            EXPECT_LT((change[c] - expected).norm(), 1e-6 * (1.0 + expected.norm())) << c;
        }
    }
}

TEST(Dihedral, NoMotionOfARigidBodyTurnsIt) {
    std::mt19937 random(8);
    for (int trial = 0; trial < 50; ++trial) {
        const HingeCorners corner = random_hinge(random);
        const Dihedral here = dihedral(corner);
        Vector3 sum = Vector3::Zero();
        Vector3 moment = Vector3::Zero();
        for (std::size_t c = 0; c < 4; ++c) {
            sum += here.gradient[c];
            moment += corner[c].cross(here.gradient[c]);
        }
        EXPECT_LT(sum.norm(), 1e-13);
        EXPECT_LT(moment.norm(), 1e-13);
    }
}

TEST(Dihedral, TriangleWithoutAreaHasNone) {
    for (const Vector3& far : {Vector3(0, 0.5, 0), Vector3(0, 0, 0), Vector3(0, 7, 0)}) {
        const HingeCorners corner{Vector3(0, 0, 0), Vector3(0, 1, 0), far, Vector3(1, 0, 0)};
        const Dihedral none = dihedral(corner);
        EXPECT_FALSE(none.has_angle);
        EXPECT_EQ(none.angle, 0.0);
        for (const Vector3& slope : none.gradient) EXPECT_EQ(slope, Vector3::Zero());
        for (const Vector3& slope : gradient_change(corner, corner)) EXPECT_EQ(slope, Vector3::Zero());
    }
}

/// Corner and three points on the axes, faces counter-clockwise from outside: a volume of a b c / 6.
struct Tetrahedron {
    Triangles triangles = Triangles(3, 4);
    Matrix3X position = Matrix3X::Zero(3, 4);
    Tetrahedron(double a, double b, double c) {
        triangles << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
        position.rightCols(3) = Vector3(a, b, c).asDiagonal();
    }
};

TEST(EnclosedVolume, OfATetrahedronWhereverItLies) {
    Tetrahedron body(0.1, 0.2, 0.3);
    EXPECT_EQ(open_edges(body.triangles), 0);
    EXPECT_NEAR(enclosed_volume(body.triangles, body.position), 1e-3, 1e-18);
    body.position.colwise() += Vector3(100.0, -200.0, 50.0);
    EXPECT_NEAR(enclosed_volume(body.triangles, body.position), 1e-3, 1e-14);
    body.triangles.row(0).swap(body.triangles.row(1));
    EXPECT_NEAR(enclosed_volume(body.triangles, body.position), -1e-3, 1e-14);
    EXPECT_EQ(open_edges(body.triangles.leftCols(3)), 3);
}

TEST(EnclosedVolume, GrowsAsItsGradientSays) {
    const Tetrahedron body(0.1, 0.2, 0.3);
    Matrix3X gradient = Matrix3X::Constant(3, 4, 1.0);
    add_volume_gradient(body.triangles, body.position, 2.0, gradient);
    // The corner on the x axis alone: dV/da = b c / 6; its share of the area normals lies along x too.
    EXPECT_NEAR(gradient(0, 1), 1.0 + 2.0 * 0.2 * 0.3 / 6.0, 1e-16);
    EXPECT_NEAR(gradient(1, 1), 1.0, 1e-16);
    EXPECT_NEAR(gradient(2, 3), 1.0 + 2.0 * 0.1 * 0.2 / 6.0, 1e-16);
    EXPECT_NEAR(gradient(1, 0), 1.0 - 2.0 * 0.1 * 0.3 / 6.0, 1e-16);
}

}  // namespace
}  // namespace trocar
