// Coulomb friction of contacts on tissue (METHODS §6, option) where it has a closed form: a block on an incline, a
// surface drawn away under a pressed block, and the spring that holds it while it sticks.
#include <gtest/gtest.h>

#include <cmath>

#include "support/tissue_samples.hpp"

namespace trocar {
namespace {

constexpr double mass = 1e-4;      // kg
constexpr double dt = 1e-3;        // s
constexpr double tangent_k = 500;  // N/m

/// A block of one vertex on the plane z = 0 under a constant force; the plane slides at `drawn`.
struct Block : test::Stepped {
    Block() : Stepped(test::make_tissue({Vector3::Zero()}, {mass}, {0}, {})) {}

    void step(const Vector3& force, double friction, const Vector3& drawn = Vector3::Zero()) {
        output.clear();
        output.held_force.col(0) = force;
        ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), s.frame.position(2, 0), 1e4, 1.0);
        contact.friction = friction;
        contact.tangent_k = tangent_k;
        contact.surface_velocity = drawn;
        contact.slip_key = 0;
        contact.reaction_body = 0;
        output.contacts.push_back(contact);
        ASSERT_TRUE(advance().ok());
    }
};

TEST(Friction, BlockOnAnInclineStaysBelowTheAngleAndSlidesAboveIt) {
    constexpr double weight = 0.05;  // N
    constexpr double friction = 0.3;
    for (const double slope : {0.15, 0.29, 0.31, 0.6}) {
        const double angle = std::atan(slope);
        const Vector3 force(weight * std::sin(angle), 0.0, -weight * std::cos(angle));
        Block block;
        for (int tick = 0; tick < 200; ++tick) block.step(force, friction);
        const double x = block.s.frame.position(0, 0);
        const double v = block.s.frame.velocity(0, 0);
        if (slope < friction) {
            EXPECT_NEAR(x, force.x() / tangent_k, 1e-9) << slope;
            EXPECT_NEAR(v, 0.0, 1e-9) << slope;
        } else {
            const double acceleration = weight / mass * (std::sin(angle) - friction * std::cos(angle));
            block.step(force, friction);
            EXPECT_NEAR(block.s.frame.velocity(0, 0) - v, acceleration * dt, 1e-9) << slope;
            EXPECT_NEAR(v, acceleration * 0.2, 0.02 * acceleration * 0.2 + 0.02) << slope;
        }
    }
}

TEST(Friction, DrawnSurfaceDragsWithFrictionTimesNormalForce) {
    // The block is tied to its place by a spring of 10 N/m: at rest the spring carries the drag.
    test::TissueSample s = test::make_tissue({Vector3::Zero(), Vector3(0.1, 0.0, 0.0)}, {mass, mass}, {0, 1},
                                             {{.i = 0, .j = 1, .rest = 0.1, .k = 10.0, .damping = 0.02}});
    test::Stepped p(s);
    for (const double friction : {0.1, 0.4}) {
        for (int tick = 0; tick < 3000; ++tick) {
            p.output.clear();
            p.output.held_force(2, 0) = -0.2;
            ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), p.s.frame.position(2, 0), 1e4, 1.0);
            contact.friction = friction;
            contact.tangent_k = tangent_k;
            contact.surface_velocity = Vector3(-0.05, 0.0, 0.0);
            contact.slip_key = 0;
            contact.reaction_body = 0;
            p.output.contacts.push_back(contact);
            ASSERT_TRUE(p.advance().ok());
        }
        EXPECT_NEAR(p.s.frame.position(0, 0), -friction * 0.2 / 10.0, 1e-5);
        EXPECT_NEAR(p.reaction[0].force.x(), friction * 0.2, 1e-4) << "the opposite on the tool";
        EXPECT_NEAR(p.reaction[0].force.z(), -0.2, 1e-4);
    }
}

TEST(Friction, EveryFaceOfAGrooveHasFrictionThoughTheirSpringIsOne) {
    // A block in a V along x: each wall bears W / (2 cos), so it slides from friction × W / cos on. A third contact
    // that does not press comes first and takes nothing away.
    constexpr double weight = 0.05;  // N
    constexpr double friction = 0.3;
    const double angle = 0.5;
    const double most = friction * weight / std::cos(angle);
    for (const double push : {0.95 * most, 1.05 * most, 2.0 * most}) {
        Block block;
        const auto step = [&] {
            block.output.clear();
            block.output.held_force.col(0) = Vector3(push, 0.0, -weight);
            const Vector3 x = block.s.frame.position.col(0);
            for (const double side : {0.0, -1.0, 1.0}) {
                const Vector3 normal(0.0, side * std::sin(angle), side == 0.0 ? 1.0 : std::cos(angle));
                ContactForceLaw contact = test::plane_contact(0, normal, side == 0.0 ? 1e-3 : normal.dot(x), 1e4, 1.0);
                contact.friction = friction;
                contact.tangent_k = tangent_k;
                contact.slip_key = 0;
                contact.reaction_body = 0;
                block.output.contacts.push_back(contact);
            }
            ASSERT_TRUE(block.advance().ok());
        };
        for (int tick = 0; tick < 200; ++tick) step();
        const double v = block.s.frame.velocity(0, 0);
        if (push < most) {
            EXPECT_NEAR(block.s.frame.position(0, 0), push / tangent_k, 1e-9) << push;
            EXPECT_NEAR(v, 0.0, 1e-9) << push;
        } else {
            step();
            EXPECT_NEAR(block.s.frame.velocity(0, 0) - v, (push - most) / mass * dt, 1e-6) << push;
            EXPECT_NEAR(block.reaction[0].force.x(), most, 1e-6) << "the opposite on the tool";
        }
    }
}

TEST(Friction, AContactThatIsNewLeavesTheSpringsOfTheOthersStretched) {
    // Held by a stretched spring; then a contact with a key that nobody had before comes near and does not press.
    // Without its stretch the block would go as far again.
    Block block;
    const Vector3 force(0.01, 0.0, -0.05);
    for (int tick = 0; tick < 200; ++tick) block.step(force, 0.5);
    const double held = block.s.frame.position(0, 0);
    EXPECT_NEAR(held, force.x() / tangent_k, 1e-9);
    for (int tick = 0; tick < 200; ++tick) {
        block.output.clear();
        block.output.held_force.col(0) = force;
        for (const Index key : {0, 5}) {
            const double gap = key == 0 ? block.s.frame.position(2, 0) : 1e-3;
            ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), gap, 1e4, 1.0);
            contact.friction = 0.5;
            contact.tangent_k = tangent_k;
            contact.slip_key = key;
            contact.reaction_body = 0;
            block.output.contacts.push_back(contact);
        }
        ASSERT_TRUE(block.advance().ok());
        ASSERT_NEAR(block.s.frame.position(0, 0), held, 1e-9) << tick;
    }
}

TEST(Friction, OffByDefaultAndForgottenWithTheContact) {
    Block smooth;
    for (int tick = 0; tick < 10; ++tick) smooth.step(Vector3(0.01, 0.0, -0.05), 0.0);
    EXPECT_NEAR(smooth.s.frame.velocity(0, 0), 0.01 / mass * 10 * dt, 1e-12);
    // Sticks 20 µm along; lifted off and set down again it starts without a stretched spring.
    Block block;
    for (int tick = 0; tick < 200; ++tick) block.step(Vector3(0.01, 0.0, -0.05), 0.5);
    const double held = block.s.frame.position(0, 0);
    EXPECT_NEAR(held, 0.01 / tangent_k, 1e-9);
    for (int tick = 0; tick < 3; ++tick) {
        block.output.clear();
        block.s.frame.velocity.setZero();
        ASSERT_TRUE(block.advance().ok());
    }
    block.step(Vector3(0.0, 0.0, -0.05), 0.5);
    for (int tick = 0; tick < 200; ++tick) block.step(Vector3(0.0, 0.0, -0.05), 0.5);
    EXPECT_NEAR(block.s.frame.position(0, 0), held, 1e-9);
}

TEST(Friction, WorkReportedIsThatOfTheWholeForceOnEveryVertexThatItMoves) {
    // In one sub-step: force × weight × path of each vertex, normal force and friction together; where the other side
    // is tissue, it takes the opposite.
    for (const bool two_tissues : {false, true}) {
        test::TissueSample s = test::make_tissue(
            {Vector3::Zero(), Vector3(0.01, 0.0, 0.0), Vector3(0.0, 0.01, 0.0), Vector3(0.003, 0.003, 0.0)},
            {1e-4, 2e-4, 3e-4, 1e-4}, {0, 0, 0, 0}, {});
        s.frame.velocity.col(0) = Vector3(0.3, 0.1, -0.2);
        s.frame.velocity.col(1) = Vector3(-0.1, 0.2, -0.1);
        s.frame.velocity.col(2) = Vector3(0.2, -0.3, -0.3);
        s.frame.velocity.col(3) = Vector3(0.1, 0.1, 0.2);
        test::Stepped p(s);
        ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), -1e-4, 1e3, 0.1);
        contact.vertices = {0, 1, 2};
        contact.weights = {0.5, 0.3, 0.2};
        contact.friction = 0.3;
        contact.tangent_k = tangent_k;
        contact.slip_key = 0;
        if (two_tissues) {
            contact.reaction_vertices = {3, -1, -1};
            contact.reaction_weights = {1.0, 0.0, 0.0};
        } else {
            contact.surface_velocity = Vector3(-0.4, 0.2, 0.0);
        }
        p.output.contacts.push_back(contact);
        ASSERT_TRUE(p.advance().ok());
        Vector3 path = Vector3::Zero();
        for (Index v = 0; v < 3; ++v) path += dt * contact.weights[at(v)] * p.s.frame.velocity.col(v);
        if (two_tissues) path -= dt * p.s.frame.velocity.col(3);
        const ContactForce& load = p.stepper->contact_forces()[0];
        ASSERT_GT(load.normal, 0.01);
        ASSERT_GT(load.friction, 0.001);
        EXPECT_NEAR(load.work, load.force.dot(path), 1e-15) << two_tissues;
    }
}

}  // namespace
}  // namespace trocar
