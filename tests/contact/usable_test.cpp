// A response that lies: each kind of lie, one at a time, in an effect that is right otherwise.
#include "contact/usable.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "support/scene_samples.hpp"

namespace trocar {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

struct Lie {
    std::string what;
    std::function<void(Effect&)> tell;
    OutcomeKind kind;
    std::string told;  ///< part of the message
};

class UsableEffect : public testing::Test {
protected:
    UsableEffect() {
        effect.resize(scene.topology.vertex_count, scene.topology.body_count());
        LinearContact contact;
        contact.vertices = {0, 1, -1};
        contact.weights = {0.25, 0.75, 0.0};
        contact.normal = Vector3::UnitZ();
        contact.gap = -1e-3;
        contact.k = 100.0;
        contact.reaction_body = 0;
        effect.contacts.assign(3, contact);
        effect.placements.push_back({.vertex = 2});
    }
    Scene scene = test::scene_from_text(test::poke_text());
    Effect effect;
};

TEST_F(UsableEffect, AnHonestOneIsOk) {
    EXPECT_TRUE(check_effect(scene.topology, effect).ok()) << check_effect(scene.topology, effect).message;
    effect.contacts[1].limit = infinite;
    effect.contacts[1].vertices = {-1, -1, -1};
    effect.contacts[1].weights = {0.0, 0.0, 0.0};
    EXPECT_TRUE(check_effect(scene.topology, effect).ok()) << "an infinite limit is none; a contact of bodies alone";
}

TEST_F(UsableEffect, EveryLieHasAName) {
    const Index beyond = scene.topology.vertex_count;
    const Index no_body = scene.topology.body_count();
    using Kind = OutcomeKind;
    const std::vector<Lie> lies{
        {"NaN gap", [](Effect& e) { e.contacts[1].gap = none; }, Kind::not_finite, "contact 1"},
        {"infinite gap", [](Effect& e) { e.contacts[1].gap = infinite; }, Kind::not_finite, "contact 1"},
        {"NaN normal", [](Effect& e) { e.contacts[1].normal.y() = none; }, Kind::not_finite, "contact 1"},
        {"NaN weight", [](Effect& e) { e.contacts[1].weights[0] = none; }, Kind::not_finite, "contact 1"},
        {"NaN stiffness", [](Effect& e) { e.contacts[1].k = none; }, Kind::not_finite, "contact 1"},
        {"infinite stiffness", [](Effect& e) { e.contacts[1].k = infinite; }, Kind::not_finite, "contact 1"},
        {"NaN limit", [](Effect& e) { e.contacts[1].limit = none; }, Kind::not_finite, "contact 1"},
        {"vertex beyond", [=](Effect& e) { e.contacts[1].vertices[2] = beyond; }, Kind::threw, "vertex"},
        {"vertex below", [](Effect& e) { e.contacts[1].vertices[0] = -2; }, Kind::threw, "vertex"},
        {"reaction vertex", [=](Effect& e) { e.contacts[1].reaction_vertices[0] = beyond; }, Kind::threw, "vertex"},
        {"body beyond", [=](Effect& e) { e.contacts[1].reaction_body = no_body; }, Kind::threw, "body"},
        {"no normal", [](Effect& e) { e.contacts[1].normal.setZero(); }, Kind::threw, "not a unit"},
        {"long normal", [](Effect& e) { e.contacts[1].normal *= 2.0; }, Kind::threw, "not a unit"},
        {"weights", [](Effect& e) { e.contacts[1].weights[0] = 0.5; }, Kind::threw, "sum is not 1"},
        {"pull by stiffness", [](Effect& e) { e.contacts[1].k = -1.0; }, Kind::threw, "below 0"},
        {"pull by limit", [](Effect& e) { e.contacts[1].limit = -1.0; }, Kind::threw, "below 0"},
        {"pushing friction", [](Effect& e) { e.contacts[1].friction = -0.1; }, Kind::threw, "below 0"},
        {"placed vertex", [=](Effect& e) { e.placements[0].vertex = beyond; }, Kind::threw, "placement 0"},
        {"unset placement", [](Effect& e) { e.placements[0].vertex = -1; }, Kind::threw, "placement 0"},
        {"NaN place", [](Effect& e) { e.placements[0].position.x() = none; }, Kind::not_finite, "placement 0"},
        {"NaN force", [](Effect& e) { e.held_force(1, 4) = none; }, Kind::not_finite, "held force"},
        {"NaN wrench", [](Effect& e) { e.wrench[0].moment.x() = none; }, Kind::not_finite, "body 0"},
    };
    for (const Lie& lie : lies) {
        Effect told = effect;
        lie.tell(told);
        const Outcome outcome = check_effect(scene.topology, told);
        EXPECT_EQ(outcome.kind, lie.kind) << lie.what << ": " << outcome.message;
        EXPECT_NE(outcome.message.find(lie.told), std::string::npos) << lie.what << ": " << outcome.message;
    }
}

TEST(UsableContacts, WhoKnowsItsTrianglesKnowsItsBodies) {
    const Scene scene = test::scene_from_text(test::poke_text());
    Contact contact;
    contact.a = scene.topology.bodies[0].triangles.first;
    contact.b = scene.topology.bodies[1].triangles.first;
    contact.kind = ContactCase::touch;
    contact.body_a = 0;
    contact.body_b = 1;
    ContactSet contacts;
    contacts.contacts.assign(3, contact);
    EXPECT_TRUE(check_contacts(scene.topology, contacts).ok()) << check_contacts(scene.topology, contacts).message;
    for (Index Contact::*body : {&Contact::body_a, &Contact::body_b}) {
        for (const Index number : {-1, scene.topology.body_count()}) {
            ContactSet told = contacts;
            told.contacts[1].*body = number;
            const Outcome outcome = check_contacts(scene.topology, told);
            EXPECT_EQ(outcome.kind, OutcomeKind::threw);
            EXPECT_NE(outcome.message.find("a body that there is not of contact 1"), std::string::npos)
                << outcome.message;
        }
    }
    contacts.contacts[1] = Contact();
    EXPECT_TRUE(check_contacts(scene.topology, contacts).ok()) << "who tells neither triangles nor features";
}

}  // namespace
}  // namespace trocar
