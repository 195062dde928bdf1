#include "measure/force_without_touch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "scene/world.hpp"
#include "support/meshes.hpp"

namespace trocar {
namespace {

/// A triangle of a body at a height (m) above a triangle of tissue, and a second body far away.
struct Stack {
    Topology topology;
    Frame frame;
    explicit Stack(BodyKind above = BodyKind::instrument, BodyKind far = BodyKind::instrument) {
        topology = make_topology({test::triangle_body("tool", above), test::triangle_body("other", far),
                                  test::triangle_body("tissue", BodyKind::tissue)});
        frame.position.resize(3, 9);
        for (Index body = 0; body < 3; ++body) {
            frame.position.middleCols(3 * body, 3) << 0, 0.01, 0, 0, 0, 0.01, 0, 0, 0;
        }
        frame.position.row(2).segment(3, 3).setConstant(1.0);
        place(1e-3);
    }
    void place(double height) { frame.position.row(2).segment(0, 3).setConstant(height); }
};

ContactForceLaw contact_on(Index vertex, Index reaction_body) {
    ContactForceLaw contact;
    contact.vertices = {vertex, -1, -1};
    contact.weights = {1.0, 0.0, 0.0};
    contact.normal = -Vector3::UnitZ();
    contact.reaction_body = reaction_body;
    return contact;
}

/// Follows heights (m, after each tick) and forces (N) of the first pair. Bounds are `slack` times the distance.
double follow(const std::vector<std::pair<double, double>>& ticks,
              const std::function<void(ResponseOutput&)>& more = {}, double slack = 1.0, Stack stack = Stack()) {
    const std::vector<std::uint8_t> counted(stack.topology.body_pairs.size(), 1);
    ForceWithoutTouch figure(stack.topology, stack.frame, counted);
    ResponseOutput output;
    output.resize(9, 3);
    for (const auto& [height, force] : ticks) {
        stack.place(height);
        output.clear();
        output.contacts = {contact_on(6, 0)};
        if (more) more(output);
        std::vector<ContactForce> contact_forces(output.contacts.size());
        contact_forces[0] = {.normal = force, .force = Vector3(0.0, 0.0, -force)};
        figure.observe(stack.frame, output, contact_forces, [&](Index a, Index b) {
            return a == 0 && b == 2 ? slack * height : 1.0;  // parallel triangles: the height is the distance
        });
    }
    return figure.largest();
}

TEST(ForceWithoutTouch, IsTheLargestOfTheSmallerClearancesOfTicksWithForce) {
    // Starts 1 mm apart. With force: 1 → 0.3 mm, 0.3 → 0.2, 0.2 → 0.5, and 0.5 → 0.4 with too little of it.
    const std::vector<std::pair<double, double>> ticks{{3e-4, 2.0}, {2e-4, 2.0}, {5e-4, 2.0}, {4e-4, 0.019}};
    EXPECT_NEAR(follow(ticks), 3e-4, 1e-15);
    // One with more than 1 % of the peak counts, however early the peak was; an early one with less than 1 % of a later
    // peak does not.
    EXPECT_NEAR(follow({{3e-4, 2.0}, {5e-4, 0.0}, {4e-4, 0.021}}), 4e-4, 1e-15);
    EXPECT_NEAR(follow({{6e-4, 0.019}, {1e-4, 2.0}}), 1e-4, 1e-15);
    EXPECT_NEAR(follow({{3e-4, 0.0}, {0.0, 1.0}}), 0.0, 1e-15);
    EXPECT_TRUE(std::isnan(follow({{3e-4, 0.0}}))) << "no force is no figure";
}

TEST(ForceWithoutTouch, IsUnknownWhereForcesArePutDownToNoPair) {
    const std::vector<std::pair<double, double>> ticks{{3e-4, 1.0}};
    EXPECT_NEAR(follow(ticks), 3e-4, 1e-15);
    EXPECT_TRUE(std::isnan(
        follow(ticks, [](ResponseOutput& output) { output.position_corrections.push_back({.vertex = 6}); })));
    EXPECT_TRUE(std::isnan(follow(ticks, [](ResponseOutput& output) { output.wrench[0].force = Vector3::UnitX(); })));
    EXPECT_TRUE(std::isnan(follow(ticks, [](ResponseOutput& output) { output.held_force(2, 6) = 1.0; })));
}

TEST(ForceWithoutTouch, ABoundThatIsTooLargeHidesNoClearanceAtTheStart) {
    // The start is 0.1 mm apart and bounded by 1 mm, the end 0.5 mm.
    EXPECT_NEAR(follow({{1e-4, 0.0}, {5e-4, 1.0}}, {}, 10.0), 1e-4, 1e-15);
}

TEST(ForceWithoutTouch, APointOnAnEdgeNamesItsBodyByTheVerticesThatAreSet) {
    const std::vector<std::pair<double, double>> ticks{{3e-4, 1.0}};
    const auto on_edge = [](ResponseOutput& output) {
        output.contacts[0].vertices = {-1, 7, 8};
        output.contacts[0].weights = {0.0, 0.5, 0.5};
    };
    EXPECT_NEAR(follow(ticks, on_edge), 3e-4, 1e-15);
    EXPECT_NEAR(follow(ticks,
                       [&](ResponseOutput& output) {
                           on_edge(output);
                           output.contacts[0].reaction_body = -1;
                           output.contacts[0].reaction_vertices = {-1, -1, 2};
                       }),
                3e-4, 1e-15);
    EXPECT_TRUE(std::isnan(follow(ticks, [](ResponseOutput& output) { output.contacts[0].vertices = {-1, -1, -1}; })));
}

TEST(ForceWithoutTouch, AContactThatNamesNoBodyIsWithTheOnlyRigidOne) {
    const std::vector<std::pair<double, double>> ticks{{3e-4, 1.0}};
    const auto nobody = [](ResponseOutput& output) { output.contacts[0].reaction_body = -1; };
    EXPECT_TRUE(std::isnan(follow(ticks, nobody))) << "no rigid body";
    EXPECT_TRUE(std::isnan(follow(ticks, nobody, 1.0, Stack(BodyKind::rigid, BodyKind::rigid)))) << "one of two";
    // The instrument is 0.3 mm away and the rigid body 1 m: the force is put down to the latter.
    EXPECT_NEAR(follow(ticks, nobody, 1.0, Stack(BodyKind::instrument, BodyKind::rigid)), 1.0, 1e-15);
}

TEST(ForceWithoutTouch, AContactWithoutForceNeedsNoPair) {
    const auto one_more = [](ResponseOutput& output) {
        output.contacts.push_back(contact_on(6, 0));
        output.contacts.back().vertices = {-1, -1, -1};
    };
    EXPECT_NEAR(follow({{3e-4, 1.0}}, one_more), 3e-4, 1e-15);
}

TEST(ForceWithoutTouch, LeavesOutWhatPullsByDesign) {
    for (const ContactRole role : {ContactRole::grasp, ContactRole::damper}) {
        EXPECT_TRUE(
            std::isnan(follow({{3e-4, 1.0}}, [role](ResponseOutput& output) { output.contacts[0].role = role; })));
    }
}

}  // namespace
}  // namespace trocar
