// One meaning of time (CONTACT §2): what a response measures where scripts have moved already closes at the end of the
// tick, not one tick's motion beyond it, and a contact force is the mean over the tick.
#include <gtest/gtest.h>

#include "method/registry.hpp"
#include "support/methods.hpp"
#include "support/response_samples.hpp"

namespace trocar {
namespace {

using test::PairSample;

constexpr double k = 1000.0;     // N/m
constexpr double dt = 1e-3;      // s
constexpr double speed = 0.2;    // m/s, of the tool towards the tissue
constexpr double deep = 1.5e-3;  // m, at the frame

/// A tool's vertex in the face of tissue that is too heavy to yield within a tick.
PairSample pressed() {
    PairSample s = test::vertex_of_a_in_b(BodyKind::instrument, BodyKind::tissue);
    s.materials.mass.assign(6, 0.0);
    for (std::size_t v = 3; v < 6; ++v) s.materials.mass[v] = 1e6;
    s.materials.substeps = 4;
    for (Index v = 0; v < 3; ++v) {
        s.frame.velocity.col(v) = Vector3(0.0, 0.0, -speed);
        s.frame.previous.col(v) = s.frame.position.col(v) - dt * s.frame.velocity.col(v);
    }
    return s;
}

/// Force on the tool, mean over the tick, N.
double load(PairSample& s, const std::string& method) {
    s.step(method);
    EXPECT_TRUE(s.outcome.ok()) << s.outcome.message;
    return (s.load[0].force + s.output.wrench[0].force).z();
}

TEST(TickStart, SpringsOfEveryResponseEndTheTickWhereTheScriptDoes) {
    for (const std::string method : {"penalty:k=1000,mu=0", "god_object:k=1000,mu=0", "global_intersection:k=1000,mu=0",
                                     "thesis:k=1000,mu=0,n_back=0", "thesis:profile=corrected,k=1000,mu=0,n_back=0"}) {
        PairSample s = pressed();
        // Four sub-steps by backward Euler: the mean of 1.35, 1.4, 1.45 and 1.5 mm.
        EXPECT_NEAR(load(s, method), k * (deep - 1.5 * speed * dt / 4.0), 1e-9) << method;
        ASSERT_EQ(s.output.contacts.size(), 1U) << method;
        EXPECT_NEAR(s.output.contacts[0].gap, -deep + speed * dt, 1e-15) << method;
        EXPECT_NEAR(s.shown_force(0).z(), k * deep, 1e-9) << method << ": at the frame";
    }
}

TEST(TickStart, WhatOperatorsMovedIsNotTheScripts) {
    // The same motion as the end of an operator's last tick: at the start of this one the tool is where the frame has
    // it.
    for (const std::string method : {"penalty:k=1000,mu=0", "thesis:k=1000,mu=0,n_back=0"}) {
        PairSample s = pressed();
        s.frame.operator_motion = {Vector3(0.0, 0.0, -speed * dt), Vector3::Zero()};
        s.respond(method);
        ASSERT_EQ(s.output.contacts.size(), 1U) << method;
        EXPECT_NEAR(s.output.contacts[0].gap, -deep, 1e-15) << method;
    }
}

TEST(TickStart, JointsOfALibraryAreNotATickAhead) {
    if (!test::is_registered(registry().responses(), "ode_joints")) GTEST_SKIP() << "this build has no ode_joints";
    PairSample s = pressed();
    const double force = load(s, "ode_joints:k=1000,mu=0");
    EXPECT_GT(force, k * (deep - speed * dt));
    EXPECT_LE(force, k * deep * (1.0 + 1e-9));
}

}  // namespace
}  // namespace trocar
