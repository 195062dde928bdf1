// The search for the contacts that are on, against all guesses there are.
#include "tissue/active_set.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "support/random_vectors.hpp"

namespace trocar {
namespace {

constexpr double h = 1e-3;  // s
constexpr int count = 9;

/// Contacts of a mass of 1 kg in space: the rate of each is its row times the velocity.
struct Problem {
    explicit Problem(std::mt19937& random) {
        std::normal_distribution<double> normal(0.0, 1.0);
        velocity = test::random_vector(normal, random);
        for (int i = 0; i < count; ++i) {
            rows.row(i) = test::random_vector(normal, random).normalized().transpose();
            TickContact contact;
            contact.depth = 1e-3 * normal(random);
            contact.stiffness = std::pow(10.0, 8.0 + normal(random));  // stiff: each moves the others
            contact.limit = std::numeric_limits<double>::infinity();
            contact.on = contact.depth >= 0.0;
            contacts.push_back(contact);
        }
    }
    /// Backward Euler with springs where a contact is on: (I + h² Σ k Jᵀ J) v' = v + h Σ k d Jᵀ.
    [[nodiscard]] Eigen::Vector3d after() const {
        Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
        Eigen::Vector3d right = velocity;
        for (int i = 0; i < count; ++i) {
            const TickContact& contact = contacts[static_cast<std::size_t>(i)];
            if (!contact.on) continue;
            matrix += h * h * contact.stiffness * rows.row(i).transpose() * rows.row(i);
            right += h * contact.stiffness * contact.depth * rows.row(i).transpose();
        }
        return matrix.inverse() * right;
    }
    [[nodiscard]] double spring_force(int i, const Eigen::Vector3d& speed) const {
        const TickContact& contact = contacts[static_cast<std::size_t>(i)];
        return contact.stiffness * (contact.depth - h * rows.row(i).dot(speed));
    }

    Eigen::Matrix<double, count, 3> rows;
    Eigen::Vector3d velocity;
    std::vector<TickContact> contacts;
};

/// The one guess in which whatever is on presses and whatever is off would pull.
std::vector<bool> right_guess(Problem problem) {
    std::vector<bool> right;
    for (unsigned guess = 0; guess < (1U << count); ++guess) {
        for (unsigned i = 0; i < count; ++i) problem.contacts[i].on = ((guess >> i) & 1U) != 0;
        const Eigen::Vector3d speed = problem.after();
        bool fits = true;
        for (unsigned i = 0; i < count; ++i) {
            fits = fits && (problem.spring_force(static_cast<int>(i), speed) > 0.0) == problem.contacts[i].on;
        }
        if (!fits) continue;
        EXPECT_TRUE(right.empty()) << "two answers";
        for (const TickContact& contact : problem.contacts) right.push_back(contact.on);
    }
    return right;
}

TEST(ActiveSet, SettlesOnTheOneGuessThatFitsAlsoWhereChangingAllAtOnceGoesRoundInCircles) {
    std::mt19937 random(11);
    int many_rounds = 0;
    for (int round = 0; round < 2000; ++round) {
        Problem problem(random);
        Eigen::Vector3d speed;
        int solutions = 0;
        const bool settled = find_active(
            std::span<TickContact>(problem.contacts), h,
            [&] {
                speed = problem.after();
                ++solutions;
                return true;
            },
            [&](const TickContact& contact) {
                return problem.rows.row(&contact - problem.contacts.data()).dot(speed);
            });
        many_rounds += solutions > 9 ? 1 : 0;
        if (solutions <= 4 && round % 20 != 0) continue;  // all guesses of every problem would take long
        const std::vector<bool> right = right_guess(problem);
        ASSERT_EQ(right.size(), problem.contacts.size());
        ASSERT_TRUE(settled) << round;
        for (std::size_t i = 0; i < right.size(); ++i) {
            EXPECT_EQ(problem.contacts[i].on, right[i]) << round;
            EXPECT_NEAR(problem.contacts[i].force, right[i] ? problem.spring_force(static_cast<int>(i), speed) : 0.0,
                        1e-9 * (1.0 + std::abs(problem.contacts[i].force)));
        }
    }
    EXPECT_GT(many_rounds, 0) << "no problem that needs more than the rounds in which all change at once";
}

}  // namespace
}  // namespace trocar
