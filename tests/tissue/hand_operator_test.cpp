#include "tissue/hand_operator.hpp"

#include <gtest/gtest.h>

#include "support/tissue_samples.hpp"

namespace trocar {
namespace {

/// Two one-vertex instruments; the operator leads the first.
struct Pair {
    Topology topology = make_topology({Body{.name = "tool", .kind = BodyKind::instrument, .vertex_count = 1},
                                       Body{.name = "other", .kind = BodyKind::instrument, .vertex_count = 1}});
    Frame frame;
    OperatorModel model;
    OperatorState state;
    Pair() {
        frame.position = Matrix3X::Zero(3, 2);
        frame.previous = frame.position;
        frame.velocity = Matrix3X::Zero(3, 2);
    }
};

TEST(HandOperator, RestsWhereHandSpringAndContactBalance) {
    // Target 4 mm inside a wall of 1000 N/m, hand spring 300 N/m: depth = 0.004 * 300/1300. Once as the pushed body,
    // once as the body that takes the reaction.
    for (const bool pushed : {true, false}) {
        Pair p;
        Effect effect = test::empty_effect(p.topology);
        const Index body = 0;
        Wrench load;
        for (int tick = 0; tick < 3000; ++tick) {
            effect.clear();
            LinearContact contact =
                test::plane_contact(pushed ? 0 : 1, pushed ? Vector3(Vector3::UnitZ()) : Vector3(-Vector3::UnitZ()),
                                    p.state.position.z(), 1000.0, 2.0);
            if (!pushed) contact.reaction_body = 0;
            if (pushed) p.frame.velocity.col(0) = p.state.velocity;
            if (!pushed) contact.face_velocity = -p.state.velocity.z();
            if (contact.gap < 0.0) effect.contacts.push_back(contact);
            load = advance_operator(p.model, p.topology, p.frame, {&body, 1}, Vector3(0, 0, -0.004), Vector3::Zero(),
                                    effect, Wrench{}, 1e-3, 4, p.state);
        }
        EXPECT_NEAR(p.state.position.z(), -0.004 * 300.0 / 1300.0, 1e-9) << pushed;
        EXPECT_NEAR(load.force.z(), 0.004 * 300.0 / 1300.0 * 1000.0, 1e-6) << pushed;
    }
}

TEST(HandOperator, ExternalForceMovesItByForceOverHandStiffness) {
    Pair p;
    const Effect effect = test::empty_effect(p.topology);
    const Index body = 0;
    Wrench load;
    for (int tick = 0; tick < 3000; ++tick) {
        load = advance_operator(p.model, p.topology, p.frame, {&body, 1}, Vector3::Zero(), Vector3::Zero(), effect,
                                {.force = Vector3(0.0, 0.6, 0.0)}, 1e-3, 1, p.state);
    }
    EXPECT_NEAR(p.state.position.y(), 0.002, 1e-9);
    EXPECT_NEAR(load.force.y(), 0.6, 1e-12);
}

TEST(HandOperator, MomentIsThatOfTheContactForceAtItsPoint) {
    Pair p;
    p.frame.position.col(0) = Vector3(0.03, 0.0, 0.0);
    const Index body = 0;
    Wrench load;
    for (int tick = 0; tick < 3000; ++tick) {
        Effect effect = test::empty_effect(p.topology);
        p.frame.velocity.col(0) = p.state.velocity;
        effect.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), p.state.position.z(), 1000.0, 2.0));
        load = advance_operator(p.model, p.topology, p.frame, {&body, 1}, Vector3(0, 0, -0.004), Vector3::Zero(),
                                effect, Wrench{}, 1e-3, 4, p.state);
    }
    const double force = 0.004 * 300.0 / 1300.0 * 1000.0;
    EXPECT_LT((load.moment - Vector3(0.0, -0.03 * force, 0.0)).norm(), 1e-8);
}

}  // namespace
}  // namespace trocar
