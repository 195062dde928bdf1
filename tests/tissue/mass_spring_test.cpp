#include "tissue/mass_spring.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "support/energy.hpp"
#include "support/tissue_samples.hpp"

namespace trocar {
namespace {

using test::energy_of;
using test::make_chain;
using test::make_disc;
using test::make_tissue;
using test::momentum_of;
using test::plane_contact;
using test::Stepped;
using test::TissueSample;

constexpr double mass = 69e-6;

TEST(MassSpring, DampedEnergyNeverGrows) {
    TissueSample s = make_disc(0.02, 0.005, 100.0, 0.2, mass);
    s.materials.drag.assign(s.materials.mass.size(), 5.0 * mass);
    for (Spring& spring : s.materials.springs) spring.damping = 0.002;
    const double rest_energy = energy_of(s.materials, s.frame);
    const LargestMode mode = largest_mode(s.materials, s.frame.position);
    s.frame.velocity = 1e-3 * mode.shape;
    s.frame.velocity(2, 0) += 1e-2;
    s.frame.velocity(0, 4) += 1e-2;
    for (Index v = 0; v < s.topology.vertex_count; ++v) {
        if (s.materials.pinned[static_cast<std::size_t>(v)] != 0) s.frame.velocity.col(v).setZero();
    }
    Stepped p(s);
    // A small step, so that the scheme's own ripple of the energy (proportional to omega dt) stays below the decay.
    const double dt = 0.02 * critical_time_step(mode.omega, 12.0 * 0.002 / mass);
    const double first = energy_of(p.s.materials, p.s.frame) - rest_energy;
    double previous = first;
    for (int tick = 0; tick < 20000; ++tick) {
        ASSERT_TRUE(p.advance(dt).ok());
        if (tick % 100 != 99) continue;
        const double now = energy_of(p.s.materials, p.s.frame) - rest_energy;
        ASSERT_LE(now, previous + 1e-3 * first) << "tick " << tick;
        previous = now;
    }
    EXPECT_LT(previous, 0.5 * first);
}

TEST(MassSpring, AnyStepBeyondTheLimitEndsUnstableHoweverFar) {
    // The largest mode grows by about (omega dt)² a step: far beyond the limit it overflows within one tick.
    for (const double factor : {1.05, 1.2, 10.0, 1e3, 1e6, 1e30, 1e100, 1e160}) {
        for (const int substeps : {1, 4, 200}) {
            TissueSample s = make_disc(0.02, 0.005, 100.0, 0.2, mass);
            const LargestMode mode = largest_mode(s.materials, s.frame.position);
            s.frame.velocity = 1e-3 * mode.shape;
            s.materials.substeps = substeps;
            Stepped p(s);
            Outcome outcome;
            const double dt = factor * critical_time_step(mode.omega, 0.0) * substeps;
            for (int tick = 0; tick < 2000 && outcome.ok(); ++tick) {
                outcome = p.advance(dt);
            }
            EXPECT_EQ(outcome.kind, OutcomeKind::unstable) << factor << " times the limit, " << substeps;
            EXPECT_TRUE(p.s.frame.all_finite());
        }
    }
}

TEST(MassSpring, SurelyUnstableIsTheExactLimitOfAChain) {
    // Fixed-fixed chain of n: omega = 2 sqrt(k/m) sin(n pi / (2 n + 2)); along it, damping c of springs adds
    // c/k omega² to the rate: h² w² + 2 h (drag/m + c/k w²) = 4.
    for (const auto& [n, drag, damping] : {std::tuple{8, 0.0, 0.0}, {5, 0.3, 0.0}, {11, 0.0, 0.05}, {6, 0.1, 0.2}}) {
        TissueSample s = make_chain(n + 2, 1e-3, {.rest = 0.01, .k = 400.0, .damping = damping});
        s.materials.drag.assign(s.materials.drag.size(), drag);
        const double omega = 2.0 * std::sqrt(400.0 / 1e-3) * std::sin(n * std::numbers::pi / (2.0 * n + 2.0));
        const double rate = drag / 1e-3 + damping / 400.0 * omega * omega;
        const double critical = (-rate + std::sqrt(rate * rate + 4.0 * omega * omega)) / (omega * omega);
        EXPECT_FALSE(surely_unstable(s.materials, s.frame.position, 0.999 * critical)) << n;
        EXPECT_TRUE(surely_unstable(s.materials, s.frame.position, 1.01 * critical)) << n;
    }
}

TEST(MassSpring, TheStrainLimiterDoesNotHideABlowUp) {
    // With sub-steps that are too long any small motion grows until the limiter alone keeps the disc together.
    for (const int substeps : {1, 4}) {
        TissueSample s = make_disc(0.03, 0.005, 100.0, 0.2, mass);
        s.materials.drag.assign(s.materials.mass.size(), 5.0 * mass);
        for (Spring& spring : s.materials.springs) spring.damping = 0.02;
        s.materials.substeps = substeps;
        s.frame.velocity(2, 0) = -1e-3;
        Stepped p(s);
        Outcome outcome;
        for (int tick = 0; tick < 2000 && outcome.ok(); ++tick) outcome = p.advance();
        EXPECT_EQ(outcome.kind, substeps == 1 ? OutcomeKind::unstable : OutcomeKind::ok) << outcome.message;
        EXPECT_TRUE(p.s.frame.all_finite());
    }
}

TEST(MassSpring, ContactsOnOneVertexShareTheLoadInAnyOrder) {
    // 44 contacts of 100 N/m under 1 N: depth = 1/4400 m whatever their damping, the step or their order.
    TissueSample s = make_tissue({Vector3::Zero()}, {mass}, {0}, {});
    Stepped p(s);
    p.output.held_force(2, 0) = -1.0;
    for (int tick = 0; tick < 3000; ++tick) {
        p.output.contacts.clear();
        for (int c = 0; c < 44; ++c) {
            const double mu = c % 2 == tick % 2 ? 2.0 : 0.1;
            p.output.contacts.push_back(plane_contact(0, Vector3::UnitZ(), p.s.frame.position(2, 0), 100.0, mu));
        }
        ASSERT_TRUE(p.advance().ok());
    }
    EXPECT_NEAR(p.s.frame.position(2, 0), -1.0 / 4400.0, 1e-9);
    EXPECT_NEAR(p.stepper->contact_forces()[7].normal, 1.0 / 44.0, 1e-6);
}

TEST(MassSpring, SingleContactFollowsTheImplicitFormula) {
    // METHODS §4: v' = (v + dt (f + k d + (mu + dt k) v_face)/m) / (1 + dt mu/m + dt² k/m).
    TissueSample s = make_tissue({Vector3::Zero()}, {0.002}, {0}, {});
    s.frame.velocity.col(0) = Vector3(0.3, 0.0, -0.4);
    Stepped p(s);
    p.output.held_force.col(0) = Vector3(0.0, 0.0, -0.7);
    p.output.contacts.push_back(plane_contact(0, Vector3::UnitZ(), -0.001, 500.0, 1.5));
    p.output.contacts.back().face_velocity = 0.05;
    const double dt = 1e-3;
    ASSERT_TRUE(p.advance(dt).ok());
    const double expected = (-0.4 + dt * (-0.7 + 0.5 + (1.5 + dt * 500.0) * 0.05) / 0.002) /
                            (1.0 + dt * 1.5 / 0.002 + dt * dt * 500.0 / 0.002);
    EXPECT_NEAR(p.s.frame.velocity(2, 0), expected, 1e-14);
    EXPECT_DOUBLE_EQ(p.s.frame.velocity(0, 0), 0.3);
}

TEST(MassSpring, ContactThatWouldPullLetsGoUnlessAdhesive) {
    for (const bool adhesive : {false, true}) {
        TissueSample s = make_tissue({Vector3::Zero()}, {0.01}, {0}, {});
        s.frame.velocity(2, 0) = 0.5;
        Stepped p(s);
        p.output.contacts.push_back(plane_contact(0, Vector3::UnitZ(), -0.01, 10.0, 2.0));
        p.output.contacts.back().adhesive = adhesive;
        ASSERT_TRUE(p.advance().ok());
        if (adhesive) {
            EXPECT_LT(p.s.frame.velocity(2, 0), 0.45);
        } else {
            EXPECT_DOUBLE_EQ(p.s.frame.velocity(2, 0), 0.5);
        }
    }
}

TEST(MassSpring, PlacedVertexStartsWhereItWasPut) {
    TissueSample s = make_tissue({Vector3::Zero()}, {1e-3}, {0}, {});
    Stepped p(s);
    p.output.position_corrections.push_back({0, Vector3(0.1, 0.2, 0.3), Vector3(1.0, 0.0, 0.0)});
    ASSERT_TRUE(p.advance().ok());
    EXPECT_LT((p.s.frame.position.col(0) - Vector3(0.101, 0.2, 0.3)).norm(), 1e-15);
    EXPECT_LT((p.s.frame.previous.col(0) - Vector3(0.1, 0.2, 0.3)).norm(), 1e-15);
}

TEST(MassSpring, StrainLimiterHoldsAnOverstretchedEdge) {
    TissueSample s = make_tissue({Vector3::Zero(), Vector3(0.01, 0, 0)}, {1e-3, 1e-3}, {1, 0},
                                 {Spring{.i = 0, .j = 1, .rest = 0.01, .k = 1.0}});
    s.materials.strain_limit = 1.0;
    s.frame.velocity(0, 1) = 9.0;
    Stepped p(s);
    for (int tick = 0; tick < 5; ++tick) ASSERT_TRUE(p.advance().ok());
    EXPECT_LE(p.stepper->max_strain(), 1.0 + 1e-12);
    EXPECT_LE(p.s.frame.position(0, 1), 0.02 + 1e-12);
    EXPECT_GT(p.s.frame.position(0, 1), 0.019);
    EXPECT_EQ(p.s.frame.position(0, 0), 0.0);
}

TEST(MassSpring, StrainLimiterKeepsTheMomentumOfTwoThatFlyApart) {
    // 1 g and 3 g at -3 and 3 m/s are torn back at the limit of 20 mm: both go on at the speed of their centre,
    // (-3 + 9) / 4 m/s, on either side of where it is after a tick, (3 · 19 mm) / 4 + 1.5 mm.
    TissueSample s = make_tissue({Vector3::Zero(), Vector3(0.019, 0, 0)}, {1e-3, 3e-3}, {0, 0},
                                 {Spring{.i = 0, .j = 1, .rest = 0.01, .k = 1.0}});
    s.materials.strain_limit = 1.0;
    s.frame.velocity(0, 0) = -3.0;
    s.frame.velocity(0, 1) = 3.0;
    Stepped p(s);
    ASSERT_TRUE(p.advance().ok());
    EXPECT_NEAR(p.s.frame.velocity(0, 0), 1.5, 1e-12);
    EXPECT_NEAR(p.s.frame.velocity(0, 1), 1.5, 1e-12);
    EXPECT_NEAR(p.s.frame.position(0, 0), 0.01575 - 0.015, 1e-12);
    EXPECT_NEAR(p.s.frame.position(0, 1), 0.01575 + 0.005, 1e-12);
}

TEST(MassSpring, LargestMoveOfAFlightAlongADiagonalIsThePathItself) {
    // The bound by coordinates is exact where all three are alike: 2 m/s in each for 1 ms, and before that a position
    // correction by 1 mm in each.
    const Vector3 diagonal(1.0, -1.0, 1.0);
    for (const double put : {0.0, 1e-3}) {
        TissueSample s = make_tissue({Vector3(0.1, 0.2, 0.3)}, {1e-3}, {0}, {});
        s.materials.substeps = 4;
        s.frame.velocity.col(0) = 2.0 * diagonal;
        Stepped p(s);
        EXPECT_EQ(p.stepper->largest_move(), 0.0) << "before the first tick";
        if (put > 0.0)
            p.output.position_corrections.push_back({0, p.s.frame.position.col(0) + put * diagonal, 2.0 * diagonal});
        ASSERT_TRUE(p.advance().ok());
        EXPECT_NEAR(p.stepper->largest_move(), std::sqrt(3.0) * (put + 2e-3), 1e-15);
        EXPECT_NEAR((p.s.frame.position.col(0) - Vector3(0.1, 0.2, 0.3)).norm(), p.stepper->largest_move(), 1e-15);
    }
}

}  // namespace
}  // namespace trocar
