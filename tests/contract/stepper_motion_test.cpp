// What every stepper owes of motion: momentum that nothing takes, no energy from nowhere, rest that lasts, closed forms
// met ever better as its steps shrink, and a name for what cannot go on.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "contract/stepper_methods.hpp"
#include "method/registry.hpp"
#include "support/energy.hpp"
#include "support/random_vectors.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

using test::TissueSample;

class StepperMotion : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Every, StepperMotion, ::testing::ValuesIn(test::stepper_methods()),
                         [](const auto& one) { return test::test_name(one.param); });

/// Runs without contacts; false when an outcome is not ok.
bool run(Stepper& stepper, const ResponseOutput& output, double dt, int ticks, Frame& frame) {
    std::vector<Wrench> reaction(1);
    for (int tick = 0; tick < ticks; ++tick) {
        if (!stepper.advance(output, dt, frame, frame, reaction).ok()) return false;
    }
    return true;
}

/// Ends with the frame that has nothing late in it.
bool run(const std::string& name, const TissueSample& s, const ResponseOutput& output, double dt, int ticks,
         Frame& frame) {
    const auto stepper = test::stepper_of(name);
    stepper->prepare(s.topology, s.materials);
    const bool ok = run(*stepper, output, dt, ticks, frame);
    stepper->complete(frame);
    return ok;
}

/// Pushes every vertex by next to nothing: what nothing touches need not be followed at the full rate.
ResponseOutput touch_of_all(const TissueSample& s) {
    ResponseOutput output = test::empty_output(s.topology);
    output.held_force.setConstant(1e-30);
    return output;
}

/// Points at random in a cube, all pairs nearer than 4 cm tied, thrown with random velocities; nothing holds it.
TissueSample make_cloud(double damping) {
    std::mt19937 random(17);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    std::vector<Vector3> points;
    std::vector<double> mass;
    for (int i = 0; i < 60; ++i) {
        points.emplace_back(0.05 * test::random_vector(number, random));
        mass.push_back(1e-3 * (1.0 + 0.5 * number(random)));
    }
    std::vector<Spring> springs;
    for (Index i = 0; i < 60; ++i) {
        for (Index j = i + 1; j < 60; ++j) {
            const double length = (points[static_cast<std::size_t>(i)] - points[static_cast<std::size_t>(j)]).norm();
            if (length > 0.04) continue;
            springs.push_back({.i = i, .j = j, .rest = length, .k = 20.0, .damping = damping});
        }
    }
    TissueSample s = test::make_tissue(points, mass, std::vector<std::uint8_t>(60, 0), springs);
    for (Index v = 0; v < 60; ++v) {
        s.frame.velocity.col(v) = Vector3::UnitX() + test::random_vector(number, random);
    }
    s.materials.substeps = 4;
    return s;
}

TEST_P(StepperMotion, MomentumStaysWhereNothingHolds) {
    for (const double damping : {0.0, 0.05}) {
        const TissueSample s = make_cloud(damping);
        Frame frame = s.frame;
        const Vector3 before = test::momentum_of(s.materials, frame);
        ASSERT_TRUE(run(GetParam(), s, test::empty_output(s.topology), 1e-3, 500, frame));
        EXPECT_LT((test::momentum_of(s.materials, frame) - before).norm(), 1e-9 * before.norm()) << damping;
        EXPECT_GT((frame.position - s.frame.position).colwise().norm().minCoeff(), 0.1) << "it flies";
    }
}

TEST_P(StepperMotion, NoEnergyComesFromNowhereWithoutDamping) {
    const TissueSample s = make_cloud(0.0);
    Frame frame = s.frame;
    const auto stepper = test::stepper_of(GetParam());
    stepper->prepare(s.topology, s.materials);
    const double before = test::energy_of(s.materials, frame);
    double most = 0.0;
    for (int tick = 0; tick < 3000; ++tick) {
        ASSERT_TRUE(run(*stepper, test::empty_output(s.topology), 1e-3, 1, frame));
        Frame complete = frame;
        stepper->complete(complete);
        most = std::max(most, test::energy_of(s.materials, complete));
    }
    // A symplectic scheme swings about the energy by half of omega h, here at most 5 %.
    EXPECT_LT(most, 1.05 * before);
}

TEST_P(StepperMotion, RestLasts) {
    TissueSample s = test::make_disc(0.05, 0.01, 100.0, 0.2, 1e-4);
    s.materials.substeps = 4;
    s.materials.drag.assign(s.materials.mass.size(), 5e-4);
    // Irregular: the bias must hold the vertices that have no symmetric neighbourhood.
    s.frame.position.col(3) += Vector3(0.0007, -0.0004, 0.0003);
    for (Spring& spring : s.materials.springs) {
        spring.rest = (s.frame.position.col(spring.j) - s.frame.position.col(spring.i)).norm();
    }
    Matrix3X force;
    internal_force(s.materials, s.frame.position, s.frame.velocity, force);
    s.materials.rest_bias = -force;
    Frame frame = s.frame;
    ASSERT_TRUE(run(GetParam(), s, test::empty_output(s.topology), 1e-3, 10000, frame));
    EXPECT_LT(frame.velocity.cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((frame.position - s.frame.position).cwiseAbs().maxCoeff(), 1e-12);
}

/// Error of a run against a closed form for ever more ticks in the same time: least slope of log error against log
/// step.
template <typename Error>
double observed_order(const Error& error) {
    double least = std::numeric_limits<double>::infinity();
    double before = error(1);
    for (int finer = 2; finer <= 8; finer *= 2) {
        const double now = error(finer);
        least = std::min(least, std::log2(before / now));
        before = now;
    }
    return least;
}

TEST_P(StepperMotion, ADampedSwingIsMetWithTheFirstOrderOfTheStep) {
    // One mass between two walls, along the line: m x'' = -2 k x - 2 c x'. x = a e^-gt (cos wt + g/w sin wt).
    const double k = 50.0;
    const double c = 0.02;
    const double m = 1e-2;
    const double a = 1e-3;
    const double g = c / m;
    const double w = std::sqrt(2.0 * k / m - g * g);
    const double time = 0.08;
    const auto error = [&](int finer) {
        TissueSample s = test::make_tissue(
            {Vector3(-0.1, 0, 0), Vector3(a, 0, 0), Vector3(0.1, 0, 0)}, {m, m, m}, {1, 0, 1},
            {{.i = 0, .j = 1, .rest = 0.1, .k = k, .damping = c}, {.i = 1, .j = 2, .rest = 0.1, .k = k, .damping = c}});
        Frame frame = s.frame;
        const int ticks = 160 * finer;
        EXPECT_TRUE(run(GetParam(), s, touch_of_all(s), time / ticks, ticks, frame));
        const double exact = a * std::exp(-g * time) * (std::cos(w * time) + g / w * std::sin(w * time));
        EXPECT_NEAR(frame.position(0, 1), exact, 0.1 * a);
        return std::abs(frame.position(0, 1) - exact);
    };
    EXPECT_GT(observed_order(error), 0.9);
}

TEST_P(StepperMotion, AWaveOnAChainIsMetWithTheFirstOrderOfTheStep) {
    // Ten masses between walls, along the line: mode n swings with w = 2 sqrt(k / m) sin(n pi / 22).
    constexpr Index masses = 10;
    constexpr int mode = 3;
    const double k = 80.0;
    const double m = 5e-3;
    const double a = 1e-4;
    const double w = 2.0 * std::sqrt(k / m) * std::sin(mode * std::numbers::pi / (2.0 * (masses + 1)));
    const double time = 0.04;
    const auto shape = [&](Index i) { return std::sin(mode * std::numbers::pi * i / (masses + 1)); };
    const auto error = [&](int finer) {
        TissueSample s = test::make_chain(masses + 2, m, {.rest = 0.01, .k = k});
        for (Index i = 0; i <= masses + 1; ++i) s.frame.position(0, i) += a * shape(i);
        Frame frame = s.frame;
        const int ticks = 160 * finer;
        EXPECT_TRUE(run(GetParam(), s, touch_of_all(s), time / ticks, ticks, frame));
        double worst = 0.0;
        for (Index i = 1; i <= masses; ++i) {
            worst = std::max(worst, std::abs(frame.position(0, i) - 0.01 * i - a * shape(i) * std::cos(w * time)));
        }
        EXPECT_LT(worst, 0.3 * a);
        return worst;
    };
    EXPECT_GT(observed_order(error), 0.85);
}

TEST_P(StepperMotion, ALoadedMembraneSinksAsItsEquationSays) {
    // z(r) = F ln(R / r) / (2 pi sigma), sigma = sqrt(3) p k (METHODS §14, I25).
    constexpr double radius = 0.05;
    constexpr double edge = 0.0025;
    constexpr double mass = 5e-5;
    TissueSample s = test::make_disc(radius, edge, 100.0, 0.2, mass);
    s.materials.drag.assign(s.materials.drag.size(), 60.0 * mass);
    s.materials.substeps = 4;
    const auto stepper = test::stepper_of(GetParam());
    stepper->prepare(s.topology, s.materials);
    ResponseOutput output = test::empty_output(s.topology);
    const double load = 1e-3;
    output.held_force(2, 0) = -load;
    Frame frame = s.frame;
    ASSERT_TRUE(run(*stepper, output, 1e-3, 1000, frame));
    const double tension = std::sqrt(3.0) * 0.2 * 100.0;
    int checked = 0;
    for (Index v = 0; v < s.topology.vertex_count; ++v) {
        const double r = s.frame.position.col(v).norm();
        if (r < 4.0 * edge || r > 0.7 * radius) continue;
        const double exact = load * std::log(radius / r) / (2.0 * std::numbers::pi * tension);
        EXPECT_NEAR(-frame.position(2, v), exact, 0.03 * exact) << r;
        ++checked;
    }
    EXPECT_GT(checked, 100);
}

TEST_P(StepperMotion, APlaneCarriesWhatLiesOnItAndHoldsWhatSticks) {
    TissueSample s = test::free_vertex();
    for (const int substeps : {1, 4}) {
        s.materials.substeps = substeps;
        test::Stepped p(s, test::stepper_of(GetParam()));
        ASSERT_NO_FATAL_FAILURE(test::press_and_pull(p, 0.15));
        EXPECT_NEAR(p.stepper->contact_forces()[0].normal, 0.5, 1e-9);
        EXPECT_NEAR(p.s.frame.position(2, 0), -0.5 / 1e4, 1e-9);
        EXPECT_NEAR(p.stepper->contact_forces()[0].friction, 0.15, 1e-6);
        EXPECT_NEAR(p.stepper->contact_forces()[0].slip, 0.15 / 2000.0, 1e-7);
        EXPECT_NEAR(p.s.frame.position(0, 0), 0.15 / 2000.0, 1e-8);
        // More than 0.4 of 0.5 N can hold: 0.1 N is left for 1 g.
        p.s.frame = s.frame;
        ASSERT_NO_FATAL_FAILURE(test::press_and_pull(p, 0.3));
        EXPECT_NEAR(p.stepper->contact_forces()[0].friction, 0.2, 1e-9);
        EXPECT_NEAR(p.stepper->contact_forces()[0].slip, 0.2 / 2000.0, 1e-7);
        EXPECT_NEAR(p.s.frame.velocity(0, 0), 100.0 * 0.4, 0.4);
    }
}

TEST_P(StepperMotion, WhatCannotGoOnHasANameAndLeavesTheFrameAlone) {
    const TissueSample s = test::make_disc(0.05, 0.01, 100.0, 0.2, 1e-4);
    test::Stepped p(s, test::stepper_of(GetParam()));
    p.output.held_force(2, 0) = 1e12;
    EXPECT_EQ(test::refused_tick(*p.stepper, p.s, p.output, p.s.frame), OutcomeKind::unstable);
    p.output.clear();
    for (const double number : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        Frame broken = p.s.frame;
        broken.velocity(1, 0) = number;
        EXPECT_EQ(test::refused_tick(*p.stepper, p.s, p.output, broken), OutcomeKind::not_finite) << number;
        p.output.held_force(1, 0) = number;
        EXPECT_EQ(test::refused_tick(*p.stepper, p.s, p.output, p.s.frame), OutcomeKind::not_finite) << number;
        p.output.clear();
    }
    Frame to = p.s.frame;
    EXPECT_TRUE(p.stepper->advance(p.output, 1e-3, p.s.frame, to, p.reaction).ok()) << "it goes on with the next frame";
    EXPECT_LT((to.position - p.s.frame.position).cwiseAbs().maxCoeff(), 1e-12) << "at rest, as that frame is";
}

}  // namespace
}  // namespace trocar
