// What step the explicit stepper says it bears, against a dense eigenvalue problem made from differences of forces.
#include "tissue/stability.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>
#include <tuple>

#include "method/registry.hpp"
#include "support/random_vectors.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

using test::make_disc;
using test::make_tissue;
using test::TissueSample;

/// A heap of springs between random points, each of its own mass, stiffness, tension and damping.
TissueSample random_tissue(unsigned seed, double damping) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::vector<Vector3> points;
    std::vector<double> mass;
    std::vector<std::uint8_t> pinned;
    std::vector<Spring> springs;
    for (Index i = 0; i < 14; ++i) {
        points.push_back(0.01 * test::random_vector(unit, random));
        mass.push_back(std::pow(10.0, -4.0 + unit(random)));
        pinned.push_back(i < 3 ? 1 : 0);
        for (Index j = 0; j < i; ++j) {
            if (unit(random) > 0.5) continue;
            const double length = (points[static_cast<std::size_t>(j)] - points.back()).norm();
            const double k = 50.0 + 500.0 * unit(random);
            springs.push_back({.i = j,
                               .j = i,
                               .rest = length,
                               .k = k,
                               .preload = 0.3 * unit(random) * k * length,
                               .damping = damping * unit(random)});
        }
    }
    TissueSample sample = make_tissue(points, mass, pinned, springs);
    for (std::size_t v = 0; v < mass.size(); ++v) sample.materials.drag[v] = 3.0 * mass[v];
    return sample;
}

/// Largest h with h² K + 2 h C < 4 M, by bisection on the eigenvalues of matrices made from differences of forces.
double exact_step(const TissueSample& sample) {
    std::vector<Index> free;
    for (Index v = 0; v < sample.topology.vertex_count; ++v) {
        if (sample.materials.is_free(v)) free.push_back(v);
    }
    const auto n = static_cast<Eigen::Index>(3 * free.size());
    Eigen::MatrixXd k(n, n);
    Eigen::MatrixXd c(n, n);
    Eigen::VectorXd scale(n);
    const auto forces = [&](const Matrix3X& position, const Matrix3X& velocity) {
        Matrix3X force;
        internal_force(sample.materials, position, velocity, force);
        Eigen::VectorXd column(n);
        for (std::size_t i = 0; i < free.size(); ++i) {
            column.segment<3>(static_cast<Eigen::Index>(3 * i)) = force.col(free[i]);
        }
        return column;
    };
    for (Eigen::Index a = 0; a < n; ++a) {
        const Index v = free[static_cast<std::size_t>(a / 3)];
        scale[a] = 1.0 / std::sqrt(sample.materials.mass[static_cast<std::size_t>(v)]);
        Matrix3X step = Matrix3X::Zero(3, sample.topology.vertex_count);
        step(a % 3, v) = 1e-7;
        const Matrix3X& x = sample.frame.position;
        const Matrix3X& u = sample.frame.velocity;
        k.col(a) = (forces(x - step, u) - forces(x + step, u)) / 2e-7;
        c.col(a) = (forces(x, u - step) - forces(x, u + step)) / 2e-7;
    }
    k = scale.asDiagonal() * k * scale.asDiagonal();
    c = scale.asDiagonal() * c * scale.asDiagonal();
    double low = 0.0;
    double high = 0.1;
    for (int i = 0; i < 60; ++i) {
        const double h = 0.5 * (low + high);
        const Eigen::MatrixXd matrix = h * h * k + 2.0 * h * c;
        const double largest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (matrix + matrix.transpose()))
                                   .eigenvalues()
                                   .maxCoeff();
        (largest < 4.0 ? low : high) = h;
    }
    return low;
}

TEST(StepEstimate, TheExactLimitLiesBetweenWhatIsProvenStableAndProvenUnstable) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
        for (const double damping : {0.0, 0.05, 0.5}) {
            const TissueSample sample = random_tissue(seed, damping);
            const StepEstimate estimate = explicit_step(sample.materials, sample.frame.position, 1e-3, true);
            const double exact = exact_step(sample);
            EXPECT_LE(estimate.stable_step, exact * (1.0 + 1e-6));
            EXPECT_GE(estimate.unstable_step, exact * (1.0 - 1e-6));
            EXPECT_LE(estimate.unstable_step, 1.01 * exact) << "100 turns of power iteration come close";
            EXPECT_GE(estimate.stable_step, 0.4 * exact) << "row sums are no further off than this";
            EXPECT_EQ(estimate.stable_step_undamped > estimate.stable_step, true) << "drag counts";
            EXPECT_EQ(estimate.substeps_stable, static_cast<int>(std::ceil(1e-3 / estimate.stable_step)));
            EXPECT_TRUE(sample.materials.is_free(estimate.vertex));
            EXPECT_TRUE(estimate.edge[0] == estimate.vertex || estimate.edge[1] == estimate.vertex);
        }
    }
}

TEST(StepEstimate, OneMassOnOneSpringIsExact) {
    // Along the spring: h² k/m + 2 h c/m = 4. k = 400, m = 1 g, c = 0.3: h² 4e5 + 600 h = 4.
    TissueSample s = make_tissue({Vector3::Zero(), Vector3(0.01, 0.0, 0.0)}, {1e-3, 1e-3}, {1, 0},
                                 {{.i = 0, .j = 1, .rest = 0.01, .k = 400.0, .damping = 0.3}});
    const StepEstimate damped = explicit_step(s.materials, s.frame.position, 0.05, true);
    const double exact = (-600.0 + std::sqrt(600.0 * 600.0 + 16.0 * 4e5)) / (2.0 * 4e5);
    EXPECT_NEAR(damped.stable_step, exact, 1e-12);
    EXPECT_NEAR(damped.unstable_step, exact, 1e-9);
    EXPECT_NEAR(damped.stable_step_undamped, 2.0 / std::sqrt(400.0 / 1e-3), 1e-12);
    EXPECT_FALSE(damped.damping_decides) << "600 h of 4 is 1.53";
    EXPECT_TRUE(damped.surely_unstable(0.05));
    EXPECT_EQ(damped.vertex, 1);
    EXPECT_EQ(damped.edge_stiffness, 400.0);
    EXPECT_EQ(damped.springs, 1);
    s.materials.springs.front().damping = 2.0;
    EXPECT_TRUE(explicit_step(s.materials, s.frame.position, 0.05, false).damping_decides);
}

TEST(StepEstimate, WhatIsSurelyUnstableIsOnlySearchedForWhereSubStepsAreNotSurelyStable) {
    TissueSample s = make_tissue({Vector3::Zero(), Vector3(0.01, 0.0, 0.0)}, {1e-3, 1e-3}, {1, 0},
                                 {{.i = 0, .j = 1, .rest = 0.01, .k = 400.0, .damping = 0.3}});
    s.materials.substeps = 4;
    const double stable = explicit_step(s.materials, s.frame.position, 1e-3, true).stable_step;
    for (const double part : {0.3, 0.99, 1.01, 3.0}) {  // of what is stable, a sub-step
        const StepEstimate estimate = explicit_step(s.materials, s.frame.position, 4.0 * part * stable, false);
        EXPECT_EQ(estimate.unstable_step > 0.0 && std::isfinite(estimate.unstable_step), part > 1.0) << part;
    }
}

/// The integrator itself blows up above the one and not below the other.
TEST(StepEstimate, TheIntegratorAgrees) {
    for (const double damping : {0.0, 0.1}) {
        TissueSample s = make_disc(0.03, 0.005, 100.0, 0.2, 7e-5);
        for (Spring& spring : s.materials.springs) spring.damping = damping;
        const StepEstimate estimate = explicit_step(s.materials, s.frame.position, 1e-3, true);
        for (const auto& [h, stable] :
             {std::pair{estimate.stable_step, true}, {1.02 * estimate.unstable_step, false}}) {
            MassSpring tissue(s.topology, s.materials);
            const ResponseOutput output = test::empty_output(s.topology);
            std::vector<Wrench> reaction(1);
            Frame frame = s.frame;
            for (Index v = 0; v < s.topology.vertex_count; ++v) {
                if (s.materials.is_free(v)) frame.velocity.col(v) = 1e-4 * Vector3::Random();
            }
            Outcome outcome;
            for (int tick = 0; tick < 3000 && outcome.ok(); ++tick)
                outcome = tissue.advance(output, h, frame, reaction);
            const double speed = frame.velocity.cwiseAbs().maxCoeff();
            EXPECT_EQ(outcome.ok() && speed < 1e-2, stable) << h << " s, damping " << damping << ", " << speed;
        }
    }
}

TEST(StepEstimate, TheRegistrysSteppersReportAtLeastWhatTheyTake) {
    TissueSample s = make_disc(0.03, 0.005, 100.0, 0.2, 7e-5);
    s.materials.substeps = 3;
    for (const StepperEntry& entry : registry().steppers()) {
        const auto stepper = entry.make(checked_values(entry, {}));
        const StepEstimate estimate = stepper->estimate(s.topology, s.materials, s.frame.position, 1e-3, false);
        EXPECT_GE(estimate.substeps, 1) << entry.name;
        EXPECT_LE(estimate.stable_step, estimate.stable_step_undamped) << entry.name;
        EXPECT_LE(estimate.stable_step, estimate.unstable_step) << entry.name;
        if (entry.is_default) {
            EXPECT_EQ(estimate.substeps, 3);
        }
    }
}

TEST(StableSubSteps, AreTheFewestBelowTheLimitWithATwentiethToSpareWhicheverVertexDecides) {
    // One free mass of 1 g on a spring along x whose other end is held: w² = k/m, and a rate of drag/m and of
    // 2 sqrt(3) damping/m, a damper's bound in whatever direction it lies. The longest step is the root of
    // h² w² + 2 h rate = 4; the drag of the held end does not count.
    constexpr double m = 1e-3;
    for (const Index free : {0, 1}) {
        for (const auto& [k, damping, drag] :
             {std::tuple{0.0, 0.0, 10.0}, {400.0, 0.0, 0.0}, {0.0, 0.3, 0.0}, {400.0, 0.2, 0.5}}) {
            TissueSample s = make_tissue({Vector3::Zero(), Vector3(0.01, 0.0, 0.0)}, {m, m}, {1, 1},
                                         {{.i = 0, .j = 1, .rest = 0.01, .k = k, .damping = damping}});
            s.materials.drag = {50.0, 50.0};
            EXPECT_EQ(stable_substeps(s.materials, s.frame.position, 1e3), 1) << "nothing moves";
            s.materials.pinned[at(free)] = 0;
            s.materials.drag[at(free)] = drag;
            const double rate = (drag + 2.0 * std::sqrt(3.0) * damping) / m;
            const double longest = 4.0 / (rate + std::sqrt(rate * rate + 4.0 * k / m));
            for (const int steps : {1, 5}) {
                for (const double beside : {-0.01, 0.01}) {
                    const double tick = 0.95 * longest * (steps + beside);
                    EXPECT_EQ(stable_substeps(s.materials, s.frame.position, tick), beside < 0.0 ? steps : steps + 1)
                        << "vertex " << free << ", k " << k << ", damping " << damping << ", drag " << drag;
                }
            }
            EXPECT_EQ(stable_substeps(s.materials, s.frame.position, 1e9), 1000000) << "and no more than this";
        }
    }
}

}  // namespace
}  // namespace trocar
