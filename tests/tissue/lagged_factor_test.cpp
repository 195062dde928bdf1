// The lagged factor against a dense solve of the same system, and what the stepper `implicit` makes of it.
#include "tissue/lagged_factor.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "measure/allocations.hpp"
#include "method/registry.hpp"
#include "support/tangles.hpp"
#include "tissue/moving_tissue.hpp"

namespace trocar {
namespace {

constexpr double dt = 1e-3;  // s

/// A tangle, its system for a step from where it stands, and a right side for all that moves.
struct TangledSystem {
    test::TissueSample sample;
    MovingTissue tissue;
    const SpringArrays& springs = tissue.spring_arrays();
    SpringSystem system;
    Matrix4X right_side;  ///< N s

    explicit TangledSystem(unsigned seed)
        : sample(test::tangle(seed)),
          tissue(sample.topology, sample.materials),
          system(springs.size(), tissue.state().size()) {
        tissue.take_over(test::empty_output(sample.topology), sample.frame);
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> unit(-1.0, 1.0);
        right_side.setZero(4, static_cast<Eigen::Index>(tissue.state().size()));
        for (Eigen::Index v = 0; v < right_side.cols(); ++v) {
            const Vector3 push = test::random_vector(unit, random);
            if (tissue.state().moves(static_cast<Index>(v))) right_side.col(v).head<3>() = push;
        }
        linearise();
    }
    void linearise() {
        system_kernels().front().linearise(dt, springs, tissue.state(), system);
        system_kernels().front().invert_blocks(springs, system);
    }
    void hold(Index v, bool held) {
        tissue.state().inverse_mass[static_cast<std::size_t>(v)] =
            held ? 0.0 : 1.0 / sample.materials.mass[static_cast<std::size_t>(v)];
        linearise();
    }
    [[nodiscard]] LaggedFactor factor() { return {springs, system, tissue.state()}; }
    [[nodiscard]] Matrix4X by_blocks() const {
        Matrix4X solution = Matrix4X::Zero(4, right_side.cols());
        GradientVectors vectors{
            .residual = right_side, .preconditioned = solution, .direction = solution, .image = solution};
        system_kernels().front().advance(system, 0.0, solution, vectors);
        return vectors.preconditioned;
    }
    [[nodiscard]] Matrix4X by_factor(LaggedFactor& factor) const {
        Matrix4X result = by_blocks();
        const double product = factor.precondition(system, right_side, result);
        const double expected = right_side.cwiseProduct(result).sum();
        EXPECT_NEAR(product, expected, 1e-12 * std::abs(expected));
        return result;
    }
    [[nodiscard]] Matrix4X exact() const {
        const Eigen::LDLT<Eigen::MatrixXd> whole(test::dense(springs, system));
        Eigen::VectorXd pushes(3 * right_side.cols());
        for (Eigen::Index v = 0; v < right_side.cols(); ++v) pushes.segment<3>(3 * v) = right_side.col(v).head<3>();
        const Eigen::VectorXd solved = whole.solve(pushes);
        Matrix4X result = Matrix4X::Zero(4, right_side.cols());
        for (Eigen::Index v = 0; v < result.cols(); ++v) result.col(v).head<3>() = solved.segment<3>(3 * v);
        return result;
    }
};

TEST(LaggedFactorOf, SolvesTheSystemThatItIsOf) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
        TangledSystem tangled(seed);
        LaggedFactor factor = tangled.factor();
        factor.renew(tangled.system);
        EXPECT_FALSE(factor.is_ready()) << "before it is taken over";
        factor.renew(tangled.system);
        ASSERT_TRUE(factor.is_ready());
        const Matrix4X expected = tangled.exact();
        EXPECT_LT((tangled.by_factor(factor) - expected).norm(), 1e-10 * expected.norm()) << seed;
    }
}

TEST(LaggedFactorOf, StaysThatOfTheSystemBeforeUntilTheNextIsTakenOver) {
    TangledSystem tangled(1);
    LaggedFactor factor = tangled.factor();
    factor.renew(tangled.system);
    const Matrix4X first = tangled.exact();
    tangled.tissue.state().position.col(10) *= 1.2;
    tangled.linearise();
    factor.renew(tangled.system);
    EXPECT_LT((tangled.by_factor(factor) - first).norm(), 1e-10 * first.norm());
    factor.renew(tangled.system);
    const Matrix4X second = tangled.exact();
    EXPECT_GT((first - second).norm(), 1e-3 * first.norm());
    EXPECT_LT((tangled.by_factor(factor) - second).norm(), 1e-10 * second.norm());
}

TEST(LaggedFactorOf, LeavesToTheBlocksWhatWasHeldThenAndAtRestWhatIsHeldNow) {
    TangledSystem tangled(2);
    LaggedFactor factor = tangled.factor();
    tangled.hold(10, true);
    factor.renew(tangled.system);
    Matrix4X expected = tangled.exact();
    factor.renew(tangled.system);
    EXPECT_EQ(tangled.by_factor(factor).col(10), Eigen::Vector4d(Eigen::Vector4d::Zero()));
    tangled.hold(10, false);
    const Matrix4X answer = tangled.by_factor(factor);
    expected.col(10) = tangled.by_blocks().col(10);
    EXPECT_LT((answer - expected).norm(), 1e-10 * expected.norm());
    tangled.hold(20, true);
    EXPECT_EQ(tangled.by_factor(factor).col(20), Eigen::Vector4d(Eigen::Vector4d::Zero()));
}

TEST(LaggedFactorOf, ASystemWithoutOneLeavesTheOneInUse) {
    TangledSystem tangled(3);
    const SpringSystem good = tangled.system;
    SpringSystem endless = good;
    endless.alpha[7] = std::numeric_limits<double>::infinity();
    SpringSystem undefined = good;
    undefined.inertia[7] = std::numeric_limits<double>::quiet_NaN();
    SpringSystem negative = good;
    for (double& inertia : negative.inertia) inertia *= -1e6;
    for (const SpringSystem* bad : {&endless, &undefined, &negative}) {
        LaggedFactor factor = tangled.factor();
        factor.renew(*bad);
        factor.renew(good);
        EXPECT_FALSE(factor.is_ready()) << "none before";
        factor.renew(*bad);
        ASSERT_TRUE(factor.is_ready());
        const Matrix4X before = tangled.by_factor(factor);
        ASSERT_TRUE(before.allFinite());
        factor.renew(good);
        EXPECT_EQ(tangled.by_factor(factor), before);
        factor.renew(good);
        EXPECT_EQ(tangled.by_factor(factor), before) << "that of the same system";
    }
}

using Settings = std::map<std::string, std::string>;

/// A pinned disc of 0.5 mm triangles, k N/m, that a plane presses or a force pushes in the middle.
struct PressedDisc : test::Stepped {
    PressedDisc(const Settings& settings, double k)
        : Stepped(test::make_disc(0.006, 5e-4, k, 0.2, 1e-6), make_stepper("implicit", settings)) {}

    void step(int tick) {
        output.clear();
        const double gap = -(s.frame.position(2, 0) + 2e-5 * tick);
        output.contacts.push_back(test::plane_contact(0, -Vector3::UnitZ(), gap, 1e3, 0.1));
        ASSERT_TRUE(advance().ok());
    }
    void press(int ticks) {
        for (int tick = 0; tick < ticks; ++tick) step(tick);
    }
};

/// Furthest that a vertex of one stands from that of the other, m.
double apart(const PressedDisc& one, const PressedDisc& other) {
    return (one.s.frame.position - other.s.frame.position).colwise().norm().maxCoeff();
}

constexpr int ticks = 40;

TEST(ImplicitFactor, FollowsTheBlocks) {
    for (const char* steps : {"1", "3"}) {
        PressedDisc blocks({{"tolerance", "1e-10"}, {"steps", steps}}, 100.0);
        PressedDisc factor({{"tolerance", "1e-10"}, {"steps", steps}, {"factor", "3"}}, 100.0);
        double furthest = 0.0;
        for (int tick = 0; tick < ticks; ++tick) {
            blocks.step(tick);
            factor.step(tick);
            furthest = std::max(furthest, apart(blocks, factor));
        }
        EXPECT_LT(blocks.s.frame.position(2, 0), -1e-4) << "it is pressed";
        EXPECT_LT(furthest, 1e-10);
    }
}

TEST(ImplicitFactor, IsTakenOverAfterThatManyTicksWhateverTheStepsOfATick) {
    for (const char* steps : {"1", "4"}) {
        PressedDisc blocks({{"steps", steps}}, 100.0);
        PressedDisc factor({{"steps", steps}, {"factor", "5"}}, 100.0);
        for (int tick = 0; tick < 6; ++tick) {
            blocks.step(tick);
            factor.step(tick);
            EXPECT_EQ(blocks.s.frame.hash() == factor.s.frame.hash(), tick < 5) << tick << " of " << steps;
        }
    }
}

TEST(ImplicitFactor, EndsOnTheSameBitsTwiceBesideASecondThread) {
    PressedDisc one({{"factor", "2"}}, 100.0);
    PressedDisc two({{"factor", "2"}}, 100.0);
    for (int tick = 0; tick < ticks; ++tick) {
        one.step(tick);
        two.step(tick);
        ASSERT_EQ(one.s.frame.hash(), two.s.frame.hash()) << tick;
    }
    // The same stepper once more, with a factor of the run before still in the making.
    const Matrix3X last = one.s.frame.position;
    one.s.frame = PressedDisc({}, 100.0).s.frame;
    one.stepper->prepare(one.s.topology, one.s.materials);
    one.press(ticks);
    EXPECT_EQ(one.s.frame.position, last);
}

TEST(ImplicitFactor, NeedsFewIterationsWhereTheTissueIsStiff) {
    constexpr double k = 1e5;  // N/m
    PressedDisc exact({{"tolerance", "1e-12"}, {"iterations", "100000"}}, k);
    PressedDisc blocks({{"tolerance", "1e-8"}, {"iterations", "4"}}, k);
    PressedDisc factor({{"tolerance", "1e-8"}, {"iterations", "4"}, {"factor", "2"}}, k);
    const double start = exact.s.frame.position(2, 0);
    double furthest_by_blocks = 0.0;
    double furthest_by_factor = 0.0;
    for (int tick = 0; tick < ticks; ++tick) {
        for (PressedDisc* disc : {&exact, &blocks, &factor}) {
            // Until the factor is there all is at rest.
            disc->output.held_force(2, 0) = tick < 2 ? 0.0 : -0.1 * k * 5e-4;
            ASSERT_TRUE(disc->advance().ok());
        }
        furthest_by_blocks = std::max(furthest_by_blocks, apart(exact, blocks));
        furthest_by_factor = std::max(furthest_by_factor, apart(exact, factor));
    }
    EXPECT_LT(exact.s.frame.position(2, 0), start - 1e-5) << "it is pushed";
    EXPECT_LT(furthest_by_factor, 1e-3 * furthest_by_blocks) << furthest_by_blocks << " m by the blocks";
}

TEST(ImplicitFactor, AsksForNoMemoryInTheTicksOwnThread) {
    if (allocation_count() < 0) GTEST_SKIP() << "a sanitizer has replaced the allocator: nothing is counted";
    PressedDisc disc({{"factor", "2"}}, 100.0);
    disc.s.materials.strain_limit = 0.5;
    disc.press(10);
    const std::int64_t before = allocation_count();
    for (int tick = 10; tick < 30; ++tick) disc.step(tick);
    EXPECT_EQ(allocation_count() - before, 0);
}

}  // namespace
}  // namespace trocar
