// Contacts by the hundred between two sheets, more than the exact search for those that are on can settle: work that is
// bounded, momentum and energy that hold, and forces near those of the converged problem.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "contact/response_output.hpp"
#include "method/registry.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

constexpr double mass = 1e-4;  // kg
constexpr double dt = 2.5e-4;  // s, one sub-step
constexpr double k = 25000.0;  // N/m
constexpr double mu = 125.0;   // N s/m

/// Two layers of side × side vertices without springs that fly into each other, every vertex in contact with three
/// neighbours of the other layer.
struct Layers : test::Stepped {
    explicit Layers(int side) : Stepped(sample(side)) {
        std::mt19937 random(7);
        std::uniform_real_distribution<double> speed(-0.1, 0.1);
        std::uniform_real_distribution<double> tilt(-0.3, 0.3);
        const int layer = side * side;
        for (int v = 0; v < 2 * layer; ++v) {
            const double along = speed(random);
            const double across = speed(random);
            s.frame.velocity.col(v) = Vector3(along, across, v < layer ? 0.05 : -0.05);
            s.frame.velocity(2, v) += speed(random);
        }
        for (int v = 0; v < 2 * layer; ++v) {
            const bool upper = v >= layer;
            const int row = v % layer / side;
            const int column = v % side;
            const int other = upper ? 0 : layer;
            const int next_row = (row + 1) % side;
            const int next_column = (column + 1) % side;
            ContactForceLaw contact = test::plane_contact(v, Vector3::UnitZ(), 0.0, k, mu);
            const double along = tilt(random);
            const double across = tilt(random);
            contact.normal = Vector3(along, across, upper ? 1.0 : -1.0).normalized();
            contact.reaction_vertices = {other + row * side + column, other + next_row * side + column,
                                         other + row * side + next_column};
            contact.reaction_weights = {0.5, 0.3, 0.2};
            output.contacts.push_back(contact);
        }
    }
    static test::TissueSample sample(int side) {
        const auto vertices_a_side = static_cast<std::size_t>(side);
        const std::size_t count = 2 * vertices_a_side * vertices_a_side;
        std::vector<Vector3> points;
        for (std::size_t v = 0; v < count; ++v) points.emplace_back(static_cast<double>(v), 0.0, 0.0);
        return test::make_tissue(points, std::vector<double>(count, mass), std::vector<std::uint8_t>(count, 0), {});
    }
    [[nodiscard]] double energy() const { return 0.5 * mass * s.frame.velocity.squaredNorm(); }
};

/// Row of a contact in the space of all velocities.
Eigen::VectorXd row_of(const ContactForceLaw& contact, Eigen::Index vertices) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(3 * vertices);
    for (std::size_t i = 0; i < 3; ++i) {
        if (contact.vertices[i] >= 0) row.segment<3>(3 * contact.vertices[i]) += contact.weights[i] * contact.normal;
        if (contact.reaction_vertices[i] >= 0)
            row.segment<3>(3 * contact.reaction_vertices[i]) -= contact.reaction_weights[i] * contact.normal;
    }
    return row;
}

/// Forces of the same contacts by the dense complementarity problem f = max(0, -c r), r = J v + h/m J Jᵀ f, with
/// c = mu + h k and depth 0, swept until nothing changes.
Eigen::VectorXd converged_forces(const Layers& layers) {
    const Eigen::Index vertices = layers.s.frame.velocity.cols();
    const auto count = static_cast<Eigen::Index>(layers.output.contacts.size());
    Eigen::MatrixXd rows(count, 3 * vertices);
    for (Eigen::Index i = 0; i < count; ++i) {
        rows.row(i) = row_of(layers.output.contacts[static_cast<std::size_t>(i)], vertices);
    }
    const Eigen::MatrixXd response = dt / mass * rows * rows.transpose();
    const Eigen::VectorXd rate = rows * layers.s.frame.velocity.reshaped();
    const double c = mu + dt * k;
    Eigen::VectorXd force = Eigen::VectorXd::Zero(count);
    for (int sweep = 0; sweep < 20000; ++sweep) {
        double change = 0.0;
        for (Eigen::Index i = 0; i < count; ++i) {
            const double others = rate[i] + response.col(i).dot(force) - response(i, i) * force[i];
            const double next = std::max(0.0, -c * others / (1.0 + c * response(i, i)));
            change = std::max(change, std::abs(next - force[i]));
            force[i] = next;
        }
        if (change < 1e-12) break;
    }
    return force;
}

TEST(CrowdedContacts, WorkDoesNotGrowWithTheirNumber) {
    for (const int side : {4, 8, 16, 32}) {
        Layers layers(side);
        layers.s.materials.substeps = 4;
        MassSpring tissue(layers.s.topology, layers.s.materials);
        std::vector<Wrench> reaction(1);
        ASSERT_TRUE(tissue.advance(layers.output, 4 * dt, layers.s.frame, reaction).ok());
        EXPECT_GT(tissue.contact_passes(), 0);
        EXPECT_LE(tissue.contact_passes(), 62 + 4 * 100) << side << ": one exact attempt, then sweeps";
    }
}

TEST(CrowdedContacts, MomentumIsKeptAndNoEnergyGiven) {
    for (const int side : {4, 16, 32}) {
        Layers layers(side);
        const Vector3 momentum = mass * layers.s.frame.velocity.rowwise().sum();
        const double before = layers.energy();
        ASSERT_TRUE(layers.advance(dt).ok());
        EXPECT_LT((mass * layers.s.frame.velocity.rowwise().sum() - momentum).norm(), 1e-15);
        EXPECT_LT(layers.energy(), before) << side;
        for (const ContactForce& load : layers.stepper->contact_forces()) EXPECT_GE(load.normal, 0.0);
    }
}

TEST(CrowdedContacts, NoneGivesMoreThanItsLimit) {
    for (const int side : {4, 16, 32}) {
        Layers layers(side);
        Layers free(side);
        ASSERT_TRUE(free.advance(dt).ok());
        double most = 0.0;
        for (const ContactForce& load : free.stepper->contact_forces()) most = std::max(most, load.normal);
        for (ContactForceLaw& contact : layers.output.contacts) contact.limit = 0.5 * most;
        const Vector3 momentum = mass * layers.s.frame.velocity.rowwise().sum();
        ASSERT_TRUE(layers.advance(dt).ok());
        EXPECT_LT((mass * layers.s.frame.velocity.rowwise().sum() - momentum).norm(), 1e-15);
        int at_limit = 0;
        for (const ContactForce& load : layers.stepper->contact_forces()) {
            EXPECT_LE(load.normal, 0.5 * most * (1.0 + 1e-12)) << side;
            at_limit += load.at_limit ? 1 : 0;
        }
        EXPECT_GT(at_limit, 0) << side;
    }
}

TEST(CrowdedContacts, ReportedForcesAreWhatMovesTheVerticesAndNearTheConvergedOnes) {
    for (const int side : {2, 4, 14}) {
        Layers layers(side);
        const Eigen::VectorXd expected = converged_forces(layers);
        const Matrix3X before = layers.s.frame.velocity;
        ASSERT_TRUE(layers.advance(dt).ok());
        Eigen::VectorXd impulse = Eigen::VectorXd::Zero(before.size());
        Eigen::VectorXd force(expected.size());
        for (Eigen::Index i = 0; i < expected.size(); ++i) {
            force[i] = layers.stepper->contact_forces()[static_cast<std::size_t>(i)].normal;
            impulse += dt * force[i] * row_of(layers.output.contacts[static_cast<std::size_t>(i)], before.cols());
        }
        const Eigen::VectorXd gained = mass * (layers.s.frame.velocity - before).reshaped();
        EXPECT_LT((gained - impulse).norm(), 1e-9 * gained.norm()) << side;
        EXPECT_LT((force - expected).norm(), (side == 2 ? 1e-9 : 1e-3) * expected.norm()) << side;
    }
}

TEST(CrowdedContacts, ARowThatYieldsOneAfterTheOtherIsSolvedWithTheTissuesWholeCompliance) {
    // Light masses on a line of springs, each tied to its place by a contact that yields. The first is pushed by what
    // 90 of them can hold: one passes on to the next what it no longer bears, so that a search which lets one more
    // yield in a round takes more rounds than it has.
    constexpr Index count = 120;
    constexpr double h = 1e-3;  // s
    constexpr double inertia = 1e-7;
    constexpr double spring_k = 1e3;
    constexpr double contact_k = 1e6;
    constexpr double limit = 1e-3;  // N
    constexpr double pushed = 90.0 * limit;
    // Backward Euler of the line where the first so many yield and the others do not; row by row.
    const auto speeds = [&](Index yielded) {
        const double tie = h * h * spring_k;
        std::vector<double> diagonal(count);
        std::vector<double> speed(count);
        for (Index v = 0; v < count; ++v) {
            diagonal[at(v)] = inertia + (v == 0 || v + 1 == count ? tie : 2.0 * tie);
            if (v >= yielded) diagonal[at(v)] += h * h * contact_k;
            speed[at(v)] = (v == 0 ? h * pushed : 0.0) - (v < yielded ? h * limit : 0.0);
            if (v == 0) continue;
            speed[at(v)] += tie / diagonal[at(v - 1)] * speed[at(v - 1)];
            diagonal[at(v)] -= tie * tie / diagonal[at(v - 1)];
        }
        for (Index v = count - 1; v >= 0; --v) {
            if (v + 1 < count) speed[at(v)] += tie * speed[at(v + 1)];
            speed[at(v)] /= diagonal[at(v)];
        }
        return speed;
    };
    // The one number for which those that yield would have to give more than they can, and the others no more.
    std::vector<double> expected;
    for (Index yielded = 0; yielded <= count; ++yielded) {
        std::vector<double> force = speeds(yielded);
        bool fits = true;
        for (Index v = 0; v < count; ++v) {
            force[at(v)] *= -h * contact_k;
            fits = fits && (v < yielded ? force[at(v)] <= -limit : std::abs(force[at(v)]) <= limit);
            force[at(v)] = std::max(force[at(v)], -limit);
        }
        if (!fits) continue;
        EXPECT_TRUE(expected.empty()) << "two answers";
        EXPECT_GT(yielded, 70);
        expected = force;
    }
    ASSERT_EQ(expected.size(), at(count));

    test::TissueSample row = test::make_chain(count, inertia, {.rest = 0.01, .k = spring_k});
    row.materials.pinned.assign(at(count), 0);
    test::Stepped p(row, make_stepper("implicit", {{"tolerance", "1e-12"}, {"iterations", "5000"}}));
    p.output.held_force(0, 0) = pushed;
    for (Index v = 0; v < count; ++v) {
        p.output.contacts.push_back(test::plane_contact(v, Vector3::UnitX(), 0.0, contact_k, 0.0));
        p.output.contacts.back().role = ContactRole::grasp;
        p.output.contacts.back().limit = limit;
    }
    ASSERT_TRUE(p.advance(h).ok());
    for (Index v = 0; v < count; ++v) {
        EXPECT_NEAR(p.stepper->contact_forces()[at(v)].normal, expected[at(v)], 0.02 * limit) << v;
    }
}

}  // namespace
}  // namespace trocar
