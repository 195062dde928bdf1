#include "scene/motion.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "scene/rotation.hpp"

namespace trocar {
namespace {

Motion two_keys(const Vector3& from, const Vector3& to) {
    Motion motion;
    motion.keys = {{.time = 1.0, .translation = {1, 2, 3}, .rotation_degrees = from, .jaw = 1.0},
                   {.time = 3.0, .translation = {3, 2, -3}, .rotation_degrees = to, .jaw = 0.0}};
    return motion;
}

TEST(Rotation, SineAndCosineAgreeWithTheLibraryToTwoUnits) {
    for (double degrees = -1000.0; degrees < 1000.0; degrees += 0.37) {
        const SineCosine at = sine_cosine_of_degrees(degrees);
        const double x = degrees * std::numbers::pi / 180.0;
        // The library's argument carries |x| 2^-53.
        EXPECT_NEAR(at.sine, std::sin(x), 3e-16 + std::fabs(x) * 2e-16) << degrees;
        EXPECT_NEAR(at.cosine, std::cos(x), 3e-16 + std::fabs(x) * 2e-16) << degrees;
    }
}

TEST(Rotation, QuarterTurnsAreExact) {
    const double sines[] = {0, 1, 0, -1};
    for (int quarter = -8; quarter <= 8; ++quarter) {
        const SineCosine at = sine_cosine_of_degrees(90.0 * quarter);
        EXPECT_EQ(at.sine, sines[(quarter + 8) % 4]);
        EXPECT_EQ(at.cosine, sines[(quarter + 9) % 4]);
    }
}

TEST(Rotation, VectorAgreesWithEigensAngleAxis) {
    const Vector3 vector(30.0, -70.0, 110.0);
    const Matrix3 expected =
        Eigen::AngleAxisd(vector.norm() * std::numbers::pi / 180.0, vector.normalized()).toRotationMatrix();
    EXPECT_LT((rotation_from_degrees(vector).toRotationMatrix() - expected).norm(), 1e-15);
    EXPECT_EQ(rotation_from_degrees(Vector3::Zero()).toRotationMatrix(), Matrix3::Identity());
}

TEST(Motion, IsHeldBeforeTheFirstAndAfterTheLastKey) {
    const Motion motion = two_keys({0, 0, 0}, {0, 0, 90});
    EXPECT_EQ(motion.pose_at(0.0).translation, Vector3(1, 2, 3));
    EXPECT_EQ(motion.pose_at(9.0).translation, Vector3(3, 2, -3));
    EXPECT_EQ(motion.pose_at(9.0).jaw, 0.0);
    EXPECT_EQ(motion.last_key_time(), 3.0);
}

TEST(Motion, IsLinearInPositionAndJaw) {
    const Motion motion = two_keys({0, 0, 0}, {0, 0, 90});
    EXPECT_LT((motion.pose_at(1.5).translation - Vector3(1.5, 2.0, 1.5)).norm(), 1e-15);
    EXPECT_DOUBLE_EQ(motion.pose_at(1.5).jaw, 0.75);
}

TEST(Motion, TurnsAlongTheShorterArcAsEigensSlerp) {
    const std::vector<std::array<Vector3, 2>> turns{{Vector3(20, -130, 45), Vector3(-80, 60, 150)},
                                                    {Vector3(0, 0, 0), Vector3(0, 0, 270)}};
    for (const auto& [from, to] : turns) {
        const Motion motion = two_keys(from, to);
        for (double u = 0.0; u <= 1.0; u += 0.125) {
            const Quaternion expected = rotation_from_degrees(from).slerp(u, rotation_from_degrees(to));
            const Matrix3 difference =
                motion.pose_at(1.0 + 2.0 * u).rotation.toRotationMatrix() - expected.toRotationMatrix();
            EXPECT_LT(difference.norm(), 1e-14) << u;
        }
    }
}

TEST(Motion, HalfTurnIsDefinedAndHitsBothEnds) {
    const Motion motion = two_keys({0, 0, 0}, {180, 0, 0});
    EXPECT_LT((motion.pose_at(3.0).rotation * Vector3(0, 1, 0) - Vector3(0, -1, 0)).norm(), 1e-15);
    EXPECT_NEAR(std::fabs((motion.pose_at(2.0).rotation * Vector3(0, 1, 0)).z()), 1.0, 1e-15);
}

}  // namespace
}  // namespace trocar
