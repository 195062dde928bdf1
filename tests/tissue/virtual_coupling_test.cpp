#include "tissue/virtual_coupling.hpp"

#include <gtest/gtest.h>

#include <array>

#include "support/tissue_samples.hpp"

namespace trocar {
namespace {

/// Two one-vertex instruments; the operator drives the first.
struct Pair {
    Topology topology = make_topology({Body{.name = "tool", .kind = BodyKind::instrument, .vertex_count = 1},
                                       Body{.name = "other", .kind = BodyKind::instrument, .vertex_count = 1}});
    Frame frame;
    OperatorModel model;
    OperatorState state;
    VirtualCouplings operators;
    std::vector<ContactForce> contact_forces;
    const Index body = 0;
    Pair() {
        frame.position = Matrix3X::Zero(3, 2);
        frame.previous = frame.position;
        frame.velocity = Matrix3X::Zero(3, 2);
    }
    /// Wrench over one tick of 1 ms.
    Wrench advance(const Vector3& target, const ResponseOutput& output, const Wrench& external, int substeps) {
        DrivenOperator coupling{
            .model = &model, .bodies = {&body, 1}, .target = target, .external = external, .state = state};
        contact_forces.assign(output.contacts.size(), {});
        operators.advance(topology, frame, output, 1e-3, substeps, {&coupling, 1}, contact_forces);
        state = coupling.state;
        return coupling.load;
    }
};

TEST(VirtualCoupling, RestsWhereVirtualCouplingAndContactBalance) {
    // Target 4 mm inside a wall of 1000 N/m, virtual coupling 300 N/m: depth = 0.004 * 300/1300. Once as the pushed
    // body at its vertex, once as the body that takes the reaction at the contact's point.
    for (const bool pushed : {true, false}) {
        Pair p;
        p.frame.position.col(0) = Vector3(0.03, 0.0, 0.0);
        ResponseOutput output = test::empty_output(p.topology);
        Wrench load;
        for (int tick = 0; tick < 3000; ++tick) {
            output.clear();
            ContactForceLaw contact =
                test::plane_contact(pushed ? 0 : 1, pushed ? Vector3(Vector3::UnitZ()) : Vector3(-Vector3::UnitZ()),
                                    p.state.position.z(), 1000.0, 2.0);
            if (!pushed) contact.reaction_body = 0;
            contact.reaction_point = Vector3(0.02, 0.01, 0.0);
            p.frame.operator_motion = {1e-3 * p.state.velocity, Vector3::Zero()};
            if (pushed) p.frame.velocity.col(0) = p.state.velocity;
            if (!pushed) contact.face_velocity = -p.state.velocity.z();
            if (contact.gap < 0.0) output.contacts.push_back(contact);
            load = p.advance(Vector3(0, 0, -0.004), output, Wrench{}, 4);
        }
        EXPECT_NEAR(p.state.position.z(), -0.004 * 300.0 / 1300.0, 1e-9) << pushed;
        const double force = 0.004 * 300.0 / 1300.0 * 1000.0;
        EXPECT_LT((load.force - Vector3(0.0, 0.0, force)).norm(), 1e-6) << pushed;
        const Vector3 moment = pushed ? Vector3(0.0, -0.03 * force, 0.0) : Vector3(0.01 * force, -0.02 * force, 0.0);
        EXPECT_LT((load.moment - moment).norm(), 1e-8) << pushed;
    }
}

TEST(VirtualCoupling, AWallThatYieldsGivesItsLimitAndReportsIt) {
    // Target 4 mm inside, virtual coupling 300 N/m: the wall would give 0.92 N and yields at 0.5 N.
    Pair p;
    ResponseOutput output = test::empty_output(p.topology);
    Wrench load;
    for (int tick = 0; tick < 3000; ++tick) {
        output.clear();
        ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), p.state.position.z(), 1000.0, 2.0);
        contact.limit = 0.5;
        p.frame.velocity.col(0) = p.state.velocity;
        p.frame.operator_motion = {1e-3 * p.state.velocity, Vector3::Zero()};
        if (contact.gap < 0.0) output.contacts.push_back(contact);
        load = p.advance(Vector3(0, 0, -0.004), output, Wrench{}, 4);
    }
    EXPECT_NEAR(load.force.z(), 0.5, 1e-9);
    EXPECT_NEAR(p.state.position.z(), -0.004 + 0.5 / 300.0, 1e-9);
    ASSERT_EQ(p.contact_forces.size(), 1U);
    EXPECT_NEAR(p.contact_forces[0].normal, 0.5, 1e-9);
    EXPECT_TRUE(p.contact_forces[0].at_limit);
}

TEST(VirtualCoupling, ExternalForceMovesItByForceOverOperatorStiffness) {
    Pair p;
    const ResponseOutput output = test::empty_output(p.topology);
    Wrench load;
    for (int tick = 0; tick < 3000; ++tick) {
        load = p.advance(Vector3::Zero(), output, {.force = Vector3(0.0, 0.6, 0.0)}, 1);
    }
    EXPECT_NEAR(p.state.position.y(), 0.002, 1e-9);
    EXPECT_NEAR(load.force.y(), 0.6, 1e-12);
}

TEST(VirtualCoupling, OneStepAgainstAMovingWallIsTheBackwardEulerOfItsEquation) {
    // A wall that moves up at w under an operator 0.2 mm inside it that goes down at u: with the operator's spring and
    // damper explicit, m (v - u) / h = pull + F, F = k (d - h (v - w)) - mu (v - w) for a damper, and with mu below
    // zero F = k (d - h (v - w)) - mu (u - w). Solved for v by hand.
    const double h = 1e-3, k = 800.0, d = 2e-4, u = -0.03, w = 0.05;
    for (const double mu : {1.5, -0.4}) {
        Pair p;
        const OperatorModel& model = p.model;
        p.state.velocity = Vector3(0.0, 0.0, u);
        p.frame.velocity.col(0) = p.state.velocity;
        p.frame.operator_motion = {h * p.state.velocity, Vector3::Zero()};
        ResponseOutput output = test::empty_output(p.topology);
        output.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), -d, k, mu));
        output.contacts[0].face_velocity = w;
        p.advance(Vector3::Zero(), output, Wrench{}, 1);
        const double pull = -(model.coupling_damping + model.damping) * u;
        const double implicit = h * k + std::max(mu, 0.0);
        const double v = (u + h / model.mass * (pull + k * d + implicit * w - std::min(mu, 0.0) * (u - w))) /
                         (1.0 + h / model.mass * implicit);
        const double force = k * d - implicit * (v - w) - std::min(mu, 0.0) * (u - w);
        ASSERT_GT(force, 0.0);
        EXPECT_NEAR(p.state.velocity.z(), v, 1e-14) << mu;
        EXPECT_NEAR(p.contact_forces[0].normal, force, 1e-12) << mu;
    }
}

/// Two masses with a spring and damper between them, pushed together by virtual couplings: motion of the middle and of
/// the distance are uncoupled and known, however stiff the contact is.
TEST(VirtualCoupling, TwoOperatorsThatPressOnEachOtherAreSolvedTogether) {
    for (const double k : {1e3, 1e5}) {
        Topology topology = make_topology({Body{.name = "left", .kind = BodyKind::instrument, .vertex_count = 1},
                                           Body{.name = "right", .kind = BodyKind::instrument, .vertex_count = 1}});
        Frame frame;
        frame.position = Matrix3X::Zero(3, 2);
        frame.previous = frame.position;
        frame.velocity = Matrix3X::Zero(3, 2);
        const OperatorModel model;
        const std::array<Index, 2> body{0, 1};
        std::array<OperatorState, 2> state;
        VirtualCouplings operators;
        const double mu = 3e-3 * k;
        double last_gap = 0.0;
        for (int tick = 0; tick < 2000; ++tick) {
            ResponseOutput output = test::empty_output(topology);
            const double gap = state[1].position.z() - state[0].position.z();
            for (Index i = 0; i < 2; ++i) frame.velocity.col(i) = state[static_cast<std::size_t>(i)].velocity;
            frame.operator_motion = {1e-3 * state[0].velocity, 1e-3 * state[1].velocity};
            ContactForceLaw contact = test::plane_contact(1, Vector3::UnitZ(), gap, k, mu);
            contact.face_velocity = state[0].velocity.z();
            contact.reaction_body = 0;
            if (gap < 0.0) output.contacts.push_back(contact);
            std::array<DrivenOperator, 2> held;
            for (std::size_t i = 0; i < 2; ++i) {
                held[i] = {.model = &model, .bodies = {&body[i], 1}, .target = Vector3(0, 0, i == 0 ? 0.002 : -0.002)};
                held[i].state = state[i];
            }
            std::vector<ContactForce> contact_forces(output.contacts.size());
            operators.advance(topology, frame, output, 1e-3, 4, held, contact_forces);
            for (std::size_t i = 0; i < 2; ++i) state[i] = held[i].state;
            EXPECT_NEAR(held[0].load.force.z(), -held[1].load.force.z(), 1e-9) << "momentum";
            last_gap = gap;
        }
        // k d = 300 (0.002 - d/2) on either side.
        EXPECT_NEAR(-last_gap, 0.6 / (k + 150.0), 1e-9) << k;
        EXPECT_NEAR(state[0].position.z() + state[1].position.z(), 0.0, 1e-12) << "no operator comes first";
    }
}

}  // namespace
}  // namespace trocar
