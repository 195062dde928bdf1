// A response that lies: each kind of lie, one at a time, in a response output that is right otherwise.
#include "contact/usable.hpp"

#include <gtest/gtest.h>

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
    std::function<void(ResponseOutput&)> report;
    OutcomeKind kind;
    std::string reported;  ///< part of the message
};

class UsableOutput : public testing::Test {
protected:
    UsableOutput() {
        output.resize(scene.topology.vertex_count, scene.topology.body_count());
        ContactForceLaw contact;
        contact.vertices = {0, 1, -1};
        contact.weights = {0.25, 0.75, 0.0};
        contact.normal = Vector3::UnitZ();
        contact.gap = -1e-3;
        contact.k = 100.0;
        contact.reaction_body = 0;
        output.contacts.assign(3, contact);
        output.position_corrections.push_back({.vertex = 2});
    }
    Scene scene = test::scene_from_text(test::poke_text());
    ResponseOutput output;
};

TEST_F(UsableOutput, AnHonestOneIsOk) {
    EXPECT_TRUE(check_output(scene.topology, output).ok()) << check_output(scene.topology, output).message;
    output.contacts[1].limit = infinite;
    output.contacts[1].vertices = {-1, -1, -1};
    output.contacts[1].weights = {0.0, 0.0, 0.0};
    EXPECT_TRUE(check_output(scene.topology, output).ok()) << "an infinite limit is none; a contact of bodies alone";
}

TEST_F(UsableOutput, EveryLieHasAName) {
    const Index beyond = scene.topology.vertex_count;
    const Index no_body = scene.topology.body_count();
    using Kind = OutcomeKind;
    const std::vector<Lie> lies{
        {"NaN gap", [](ResponseOutput& e) { e.contacts[1].gap = none; }, Kind::not_finite, "contact 1"},
        {"infinite gap", [](ResponseOutput& e) { e.contacts[1].gap = infinite; }, Kind::not_finite, "contact 1"},
        {"NaN normal", [](ResponseOutput& e) { e.contacts[1].normal.y() = none; }, Kind::not_finite, "contact 1"},
        {"NaN weight", [](ResponseOutput& e) { e.contacts[1].weights[0] = none; }, Kind::not_finite, "contact 1"},
        {"NaN stiffness", [](ResponseOutput& e) { e.contacts[1].k = none; }, Kind::not_finite, "contact 1"},
        {"infinite stiffness", [](ResponseOutput& e) { e.contacts[1].k = infinite; }, Kind::not_finite, "contact 1"},
        {"NaN limit", [](ResponseOutput& e) { e.contacts[1].limit = none; }, Kind::not_finite, "contact 1"},
        {"vertex beyond", [=](ResponseOutput& e) { e.contacts[1].vertices[2] = beyond; }, Kind::threw, "vertex"},
        {"vertex below", [](ResponseOutput& e) { e.contacts[1].vertices[0] = -2; }, Kind::threw, "vertex"},
        {"reaction vertex", [=](ResponseOutput& e) { e.contacts[1].reaction_vertices[0] = beyond; }, Kind::threw,
         "vertex"},
        {"body beyond", [=](ResponseOutput& e) { e.contacts[1].reaction_body = no_body; }, Kind::threw, "body"},
        {"no normal", [](ResponseOutput& e) { e.contacts[1].normal.setZero(); }, Kind::threw, "not a unit"},
        {"long normal", [](ResponseOutput& e) { e.contacts[1].normal *= 2.0; }, Kind::threw, "not a unit"},
        {"weights", [](ResponseOutput& e) { e.contacts[1].weights[0] = 0.5; }, Kind::threw, "sum is not 1"},
        {"pull by stiffness", [](ResponseOutput& e) { e.contacts[1].k = -1.0; }, Kind::threw, "below 0"},
        {"pull by limit", [](ResponseOutput& e) { e.contacts[1].limit = -1.0; }, Kind::threw, "below 0"},
        {"pushing friction", [](ResponseOutput& e) { e.contacts[1].friction = -0.1; }, Kind::threw, "below 0"},
        {"placed vertex", [=](ResponseOutput& e) { e.position_corrections[0].vertex = beyond; }, Kind::threw,
         "position correction 0"},
        {"unset position correction", [](ResponseOutput& e) { e.position_corrections[0].vertex = -1; }, Kind::threw,
         "position correction 0"},
        {"NaN place", [](ResponseOutput& e) { e.position_corrections[0].position.x() = none; }, Kind::not_finite,
         "position correction 0"},
        {"NaN force", [](ResponseOutput& e) { e.held_force(1, 4) = none; }, Kind::not_finite, "held force"},
        {"NaN wrench", [](ResponseOutput& e) { e.wrench[0].moment.x() = none; }, Kind::not_finite, "body 0"},
    };
    for (const Lie& lie : lies) {
        ResponseOutput reported = output;
        lie.report(reported);
        const Outcome outcome = check_output(scene.topology, reported);
        EXPECT_EQ(outcome.kind, lie.kind) << lie.what << ": " << outcome.message;
        EXPECT_NE(outcome.message.find(lie.reported), std::string::npos) << lie.what << ": " << outcome.message;
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
            ContactSet reported = contacts;
            reported.contacts[1].*body = number;
            const Outcome outcome = check_contacts(scene.topology, reported);
            EXPECT_EQ(outcome.kind, OutcomeKind::threw);
            EXPECT_NE(outcome.message.find("a body that there is not of contact 1"), std::string::npos)
                << outcome.message;
        }
    }
    contacts.contacts[1] = Contact();
    EXPECT_TRUE(check_contacts(scene.topology, contacts).ok()) << "who reports neither triangles nor features";
}

}  // namespace
}  // namespace trocar
