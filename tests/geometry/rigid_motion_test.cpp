#include "geometry/rigid_motion.hpp"

#include <gtest/gtest.h>

#include <random>

#include "support/random_vectors.hpp"

namespace trocar {
namespace {

Matrix3X random_points(std::mt19937& random, Index count) {
    std::uniform_real_distribution<double> place(-0.05, 0.05);
    return Matrix3X::NullaryExpr(3, count, [&] { return place(random); });
}

TEST(RigidMotion, FindsTheMotionThatMadeThePoints) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> part(-1.0, 1.0);
    for (int n = 0; n < 200; ++n) {
        const Matrix3X from = random_points(random, 3 + n % 40);
        const Matrix3 rotation = test::random_turn(part, random).toRotationMatrix();
        const Vector3 translation = test::random_vector(part, random);
        const RigidMotion found = rigid_motion(from, (rotation * from).colwise() + translation);
        EXPECT_LT((found.rotation - rotation).cwiseAbs().maxCoeff(), 1e-9);
        EXPECT_LT((found.translation - translation).cwiseAbs().maxCoeff(), 1e-9);
    }
}

// No motion mirrors: the best rotation is found then, and none near it does better.
TEST(RigidMotion, IsTheBestRotationWhereNoneFits) {
    std::mt19937 random(8);
    std::uniform_real_distribution<double> part(-1.0, 1.0);
    for (int n = 0; n < 50; ++n) {
        const Matrix3X from = random_points(random, 12);
        Matrix3X to = from + 0.1 * random_points(random, 12);
        if (n % 2 == 0) to.row(n % 3) *= -1.0;
        const RigidMotion found = rigid_motion(from, to);
        EXPECT_NEAR(found.rotation.determinant(), 1.0, 1e-12);
        EXPECT_LT((found.rotation * found.rotation.transpose() - Matrix3::Identity()).cwiseAbs().maxCoeff(), 1e-12);
        const auto missed = [&](const Matrix3& rotation, const Vector3& translation) {
            return (((rotation * from).colwise() + translation) - to).squaredNorm();
        };
        const double least = missed(found.rotation, found.translation);
        for (int i = 0; i < 100; ++i) {
            const double turn = i % 2 == 0 ? 1e-3 : 1.0;
            const Vector3 imaginary = turn * test::random_vector(part, random);
            const Quaternion other(1.0, imaginary.x(), imaginary.y(), imaginary.z());
            const Vector3 shift = turn * 0.01 * test::random_vector(part, random);
            EXPECT_GE(missed(other.normalized().toRotationMatrix() * found.rotation, found.translation + shift), least);
        }
    }
}

TEST(RigidMotion, OnePointOrALineStillGivesARotationThatFits) {
    for (const Index count : {1, 2, 5}) {
        Matrix3X from(3, count);
        for (Index i = 0; i < count; ++i) from.col(i) = static_cast<double>(i) * Vector3(0.01, 0.0, 0.0);
        Matrix3X to(3, count);
        for (Index i = 0; i < count; ++i)
            to.col(i) = Vector3(0.2, 0.1, 0.0) + static_cast<double>(i) * Vector3(0.0, 0.0, 0.01);
        const RigidMotion found = rigid_motion(from, to);
        EXPECT_NEAR(found.rotation.determinant(), 1.0, 1e-12);
        EXPECT_LT((((found.rotation * from).colwise() + found.translation) - to).cwiseAbs().maxCoeff(), 1e-12);
    }
}

}  // namespace
}  // namespace trocar
