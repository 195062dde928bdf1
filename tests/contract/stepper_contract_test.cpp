// What every stepper owes: what it says the contacts gave is what bodies and tissue got, a limit is a limit, the same
// question has the same answer, no tick asks for memory, and nothing has gone further than it says.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "contract/stepper_methods.hpp"
#include "measure/allocations.hpp"
#include "method/registry.hpp"
#include "support/tissue_samples.hpp"

namespace trocar {
namespace {

constexpr double dt = 1e-3;  // s

class StepperContract : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Every, StepperContract, ::testing::ValuesIn(test::stepper_methods()),
                         [](const auto& one) { return test::test_name(one.param); });

/// A pinned disc that three contacts press on; all react on body 0.
struct Pressed : test::Stepped {
    Matrix3X start = s.frame.position;
    std::vector<Index> free;  ///< vertices that are not pinned

    explicit Pressed(const std::string& name) : Stepped(disc(), test::stepper_of(name)) {
        for (Index v = 0; v < s.topology.vertex_count; ++v) {
            if (s.materials.pinned[static_cast<std::size_t>(v)] == 0) free.push_back(v);
        }
    }
    static test::TissueSample disc() {
        test::TissueSample s = test::make_disc(0.05, 0.01, 100.0, 0.2, 1e-4);
        s.materials.substeps = 4;
        s.materials.strain_limit = 0.1;
        return s;
    }
    /// Planes that come down at 0.1 m/s; the first contact gives way at 20 mN, the second has friction.
    void press(int tick) {
        output.clear();
        for (std::size_t c = 0; c < 3; ++c) {
            const Index vertex = free[c];
            const Vector3 normal = Vector3(0.1 * static_cast<double>(c), 0.2, -1.0).normalized();
            const double path = 1e-3 + 1e-4 * tick;
            const double gap = normal.dot(s.frame.position.col(vertex) - start.col(vertex)) - path;
            ContactForceLaw contact = test::plane_contact(vertex, normal, gap, 2e4, 1.0);
            contact.face_velocity = 0.1;
            contact.reaction_body = 0;
            contact.reaction_point = s.frame.position.col(vertex);
            if (c == 0) contact.limit = 0.02;
            if (c == 1) {
                contact.friction = 0.3;
                contact.tangent_k = 500.0;
                contact.surface_velocity = Vector3(0.05, 0.0, 0.0);
                contact.slip_key = vertex;
            }
            output.contacts.push_back(contact);
        }
    }
    void step(int tick) {
        press(tick);
        const Outcome outcome = advance();
        ASSERT_TRUE(outcome.ok()) << outcome.message;
    }
};

TEST_P(StepperContract, LoadsSumToTheReactionThatTheBodyGets) {
    Pressed p(GetParam());
    for (int tick = 0; tick < 30; ++tick) {
        p.step(tick);
        const auto contact_forces = p.stepper->contact_forces();
        ASSERT_EQ(contact_forces.size(), p.output.contacts.size());
        Vector3 pressed = Vector3::Zero();
        for (std::size_t c = 0; c < contact_forces.size(); ++c)
            pressed += contact_forces[c].normal * p.output.contacts[c].normal;
        const Vector3 rubbed = -p.reaction[0].force - pressed;
        EXPECT_NEAR(rubbed.norm(), contact_forces[1].friction, 1e-12) << tick;
        Vector3 moment = -p.output.contacts[1].reaction_point.cross(rubbed);
        for (std::size_t c = 0; c < contact_forces.size(); ++c) {
            const ContactForceLaw& contact = p.output.contacts[c];
            moment -= contact_forces[c].normal * contact.reaction_point.cross(contact.normal);
        }
        EXPECT_LT((p.reaction[0].moment - moment).norm(), 1e-12) << tick;
        EXPECT_LE(contact_forces[1].friction, 0.3 * contact_forces[1].normal + 1e-12);
        EXPECT_EQ(contact_forces[0].friction + contact_forces[2].friction, 0.0);
        EXPECT_EQ(contact_forces[1].slip > 0.0, contact_forces[1].friction > 0.0) << tick;
    }
}

TEST_P(StepperContract, AContactAtItsLimitGivesExactlyThat) {
    Pressed p(GetParam());
    for (int tick = 0; tick < 30; ++tick) {
        p.step(tick);
        const auto contact_forces = p.stepper->contact_forces();
        EXPECT_LE(contact_forces[0].normal, 0.02 * (1.0 + 1e-12)) << tick;
        EXPECT_FALSE(contact_forces[1].at_limit || contact_forces[2].at_limit);
        if (tick < 5) continue;
        EXPECT_TRUE(contact_forces[0].at_limit);
        EXPECT_NEAR(contact_forces[0].normal, 0.02, 1e-15);
        EXPECT_GT(contact_forces[2].normal, 0.04) << "one without a limit carries on";
    }
}

TEST_P(StepperContract, TheTissueGetsWhatALimitLeaves) {
    // A free vertex without springs: all that moves it is the contact.
    test::TissueSample s = test::free_vertex();
    test::Stepped p(s, test::stepper_of(GetParam()));
    p.output.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), -0.002, 1e4, 0.0));
    p.output.contacts.back().limit = 0.5;
    p.output.contacts.back().reaction_body = 0;
    for (const bool held : {false, true}) {
        p.output.contact_timing = held ? ContactTiming::at_tick_start : ContactTiming::implicit;
        const double before = p.s.frame.velocity(2, 0);
        ASSERT_TRUE(p.advance().ok());
        EXPECT_NEAR(p.s.frame.velocity(2, 0) - before, 0.5 * dt / 1e-3, 1e-12) << held;
        EXPECT_NEAR(p.reaction[0].force.z(), -0.5, 1e-12) << held;
    }
}

TEST_P(StepperContract, TheForceOfAContactIsTakenFromTheStateThatTheOutputNames) {
    // A free vertex of 1 g, 2 mm deep in a plane of 100 N/m that it leaves slowly.
    constexpr double k = 100.0;
    constexpr double m = 1e-3;
    const auto rate_after_a_tick = [&](ContactTiming timing) {
        test::TissueSample s = test::free_vertex(m);
        test::Stepped p(s, test::stepper_of(GetParam()));
        p.output.contact_timing = timing;
        p.output.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), -0.002, k, 0.0));
        EXPECT_TRUE(p.advance().ok());
        return p.s.frame.velocity(2, 0);
    };
    EXPECT_NEAR(rate_after_a_tick(ContactTiming::at_tick_start), k * 0.002 * dt / m, 1e-14);
    const double substep = rate_after_a_tick(ContactTiming::at_substep_start);
    const double implicit = rate_after_a_tick(ContactTiming::implicit);
    // How many sub-steps a tick has is the stepper's own matter.
    int with_start = 0;
    int with_end = 0;
    for (int steps = 1; steps <= 64; ++steps) {
        const double h = dt / steps;
        double rate = 0.0;
        double depth = 0.002;
        double end_rate = 0.0;
        double end_depth = 0.002;
        for (int i = 0; i < steps; ++i) {
            rate += h * k * depth / m;
            depth -= h * rate;
            end_rate = (end_rate + h * k * end_depth / m) / (1.0 + h * h * k / m);
            end_depth -= h * end_rate;
        }
        with_start += std::abs(substep - rate) < 1e-12 ? 1 : 0;
        with_end += std::abs(implicit - end_rate) < 1e-12 ? 1 : 0;
    }
    EXPECT_EQ(with_start, 1) << substep;
    EXPECT_EQ(with_end, 1) << implicit;
}

/// m/s, of a mass m (kg) after a step of h (s) against a plane that it is `depth` (m) deep in (negative: apart), by
/// bisection on m (v' - v) = h F with F = k p_end + mu (p_end - p_start) / h, from 0 to its limit, and p = max(0,
/// depth).
double rate_after_penetration_law(double m, double k, double mu, double limit, double depth, double rate, double h) {
    const auto excess = [&](double after) {
        const double end = std::max(0.0, depth - h * after);
        return m * (after - rate) - h * std::clamp(k * end + mu * (end - std::max(0.0, depth)) / h, 0.0, limit);
    };
    double low = rate;
    double high = std::max(rate, depth / h);
    for (int i = 0; i < 200; ++i) {
        const double middle = 0.5 * (low + high);
        (excess(middle) < 0.0 ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

TEST_P(StepperContract, NoContactPressesUnlessASubStepEndsInside) {
    // A free vertex of 1 g that comes near, passes or leaves a plane; dampers from none to one that would stop it dead.
    // A limit of 2 N alone would throw it clear of the plane, where nothing would push: in between it gives way.
    constexpr double k = 1e4;
    constexpr double m = 1e-3;
    std::array<bool, 65> fits{};
    fits.fill(true);
    int within = 0;
    const auto check = [&](double mu, double limit, double depth, double rate) {
        test::TissueSample s = test::free_vertex(m);
        s.frame.velocity(2, 0) = rate;
        test::Stepped p(s, test::stepper_of(GetParam()));
        p.output.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), -depth, k, mu));
        p.output.contacts.back().limit = limit;
        ASSERT_TRUE(p.advance().ok());
        const double after = p.s.frame.velocity(2, 0);
        const double given = p.stepper->contact_forces()[0].normal;
        EXPECT_NEAR(m * (after - rate), given * dt, 1e-12);
        for (int steps = 1; steps <= 64; ++steps) {
            double expected = rate;
            double now = depth;
            for (int i = 0; i < steps; ++i) {
                expected = rate_after_penetration_law(m, k, mu, limit, now, expected, dt / steps);
                now -= dt / steps * expected;
            }
            fits[static_cast<std::size_t>(steps)] &= std::abs(after - expected) < 1e-9;
        }
        if (depth <= -1.1e-3) {
            EXPECT_EQ(given, 0.0) << "too far to be reached in the tick";
        }
        within += given > 0.01 * limit && given < 0.99 * limit ? 1 : 0;
    };
    for (const double limit : {std::numeric_limits<double>::infinity(), 2.0, 0.3}) {
        for (const double mu : {0.0, 0.3, 300.0}) {
            for (const double depth : {2e-4, 0.0, -1e-5, -2e-4, -6e-4, -9.9e-4, -1.1e-3}) {
                for (const double rate : {-1.0, -0.3, 0.0, 0.5}) check(mu, limit, depth, rate);
            }
        }
    }
    // How many sub-steps a tick has is the stepper's own matter.
    EXPECT_EQ(std::count(fits.begin() + 1, fits.end(), true), 1);
    EXPECT_GT(within, 10);
}

TEST_P(StepperContract, AnEdgeHeldAgainstAnEdgeIsPushedWhereTheyCross) {
    // Two free vertices of 1 g, 1 cm apart; an edge along y crosses theirs at 0, a quarter, a half and beyond its end.
    for (const double place : {0.0, 0.25, 0.5, 1.5}) {
        test::TissueSample s = test::make_tissue({Vector3::Zero(), Vector3(0.01, 0.0, 0.0)}, {1e-3, 1e-3}, {0, 0}, {});
        test::Stepped p(s, test::stepper_of(GetParam()));
        const double path = std::min(place, 1.0);
        ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), -1e-4, 10.0, 0.0);
        contact.role = ContactRole::constraint;
        contact.source_id = 1;
        contact.vertices = {0, 1, -1};
        contact.weights = {1.0 - path, path, 0.0};
        contact.other_edge = Vector3::UnitY();
        contact.other_point = Vector3(0.01 * place, 0.003, 1e-4);
        p.output.contacts.push_back(contact);
        ASSERT_TRUE(p.advance().ok());
        const double first = p.s.frame.velocity(2, 0);
        const double second = p.s.frame.velocity(2, 1);
        EXPECT_GT(first + second, 0.0);
        EXPECT_NEAR(second / (first + second), path, 1e-3) << place;
    }
}

TEST_P(StepperContract, BetweenTwoContactsTheOneWithTheLimitYields) {
    // A vertex that a plane from below and one from above press together by 2 mm: the first yields at 0.3 N, so that
    // the other is left 0.3 N / 1000 N/m deep.
    test::TissueSample s = test::free_vertex(1e-4);
    test::Stepped p(s, test::stepper_of(GetParam()));
    for (int tick = 0; tick < 500; ++tick) {
        const double z = p.s.frame.position(2, 0);
        p.output.clear();
        p.output.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), z - 0.001, 1e5, 10.0));
        p.output.contacts.back().limit = 0.3;
        p.output.contacts.push_back(test::plane_contact(0, -Vector3::UnitZ(), -0.001 - z, 1000.0, 1.0));
        ASSERT_TRUE(p.advance().ok());
    }
    EXPECT_NEAR(p.s.frame.position(2, 0), -0.001 + 0.0003, 1e-9);
    EXPECT_NEAR(p.stepper->contact_forces()[0].normal, 0.3, 1e-12);
    EXPECT_NEAR(p.stepper->contact_forces()[1].normal, 0.3, 1e-6);
    EXPECT_TRUE(p.stepper->contact_forces()[0].at_limit);
}

TEST_P(StepperContract, AFaceHeldAgainstTissueThatNothingMovesIsPushedByItsWeights) {
    // Three free corners without springs, a pinned vertex that no spring ties to anything: the corners share the
    // impulse as the contact's weights say.
    const std::array<double, 3> weights{0.1, 0.2, 0.7};
    const Vector3 foot(0.02 + 0.2 * 0.01, 0.03 + 0.7 * 0.01, 0.0);
    test::TissueSample s =
        test::make_tissue({Vector3(0.02, 0.03, 0.0), Vector3(0.03, 0.03, 0.0), Vector3(0.02, 0.04, 0.0), foot},
                          {1e-3, 1e-3, 1e-3, 1e-3}, {0, 0, 0, 1}, {});
    test::Stepped p(s, test::stepper_of(GetParam()));
    ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), -1e-4, 100.0, 0.0);
    contact.role = ContactRole::constraint;
    contact.source_id = 1;
    contact.vertices = {0, 1, 2};
    contact.weights = weights;
    contact.reaction_vertices = {3, -1, -1};
    contact.reaction_weights = {1.0, 0.0, 0.0};
    p.output.contacts.push_back(contact);
    ASSERT_TRUE(p.advance().ok());
    const double impulse = p.stepper->contact_forces()[0].normal * dt;
    EXPECT_GT(impulse, 0.0);
    for (Index v = 0; v < 3; ++v) {
        EXPECT_NEAR(p.s.frame.velocity(2, v), weights[static_cast<std::size_t>(v)] * impulse / 1e-3, 1e-12) << v;
    }
    EXPECT_EQ(p.s.frame.position.col(3), foot);
}

TEST_P(StepperContract, AReactionOnAnEdgeIsTakenWhicheverCornerIsLeftOut) {
    for (const bool packed : {true, false}) {
        test::TissueSample s =
            test::make_tissue({Vector3(0.0, 0.0, 0.0), Vector3(-0.01, 0.0, 0.0), Vector3(0.01, 0.0, 0.0)},
                              {1e-3, 1e-3, 1e-3}, {0, 0, 0}, {});
        test::Stepped p(s, test::stepper_of(GetParam()));
        ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), -1e-4, 100.0, 0.0);
        contact.reaction_vertices = packed ? std::array<Index, 3>{1, 2, -1} : std::array<Index, 3>{-1, 1, 2};
        contact.reaction_weights =
            packed ? std::array<double, 3>{0.25, 0.75, 0.0} : std::array<double, 3>{0.0, 0.25, 0.75};
        p.output.contacts.push_back(contact);
        ASSERT_TRUE(p.advance().ok());
        const double momentum = 1e-3 * p.s.frame.velocity(2, 0);
        EXPECT_GT(momentum, 0.0);
        EXPECT_NEAR(1e-3 * p.s.frame.velocity(2, 1), -0.25 * momentum, 1e-9 * momentum) << packed;
        EXPECT_NEAR(1e-3 * p.s.frame.velocity(2, 2), -0.75 * momentum, 1e-9 * momentum) << packed;
    }
}

TEST_P(StepperContract, TheSameOutputsEndOnTheSameBits) {
    Pressed one(GetParam());
    Pressed two(GetParam());
    for (int tick = 0; tick < 30; ++tick) {
        one.step(tick);
        two.step(tick);
        ASSERT_EQ(one.s.frame.hash(), two.s.frame.hash()) << tick;
        for (std::size_t c = 0; c < 3; ++c)
            ASSERT_EQ(one.stepper->contact_forces()[c].normal, two.stepper->contact_forces()[c].normal);
    }
}

TEST_P(StepperContract, NothingHasGoneFurtherThanItSays) {
    Pressed p(GetParam());
    EXPECT_EQ(p.stepper->largest_move(), 0.0) << "before the first tick";
    std::int64_t limited = 0;
    for (int tick = 0; tick < 60; ++tick) {
        p.press(tick);
        if (tick % 10 == 9) {
            const Vector3 place = p.s.frame.position.col(p.free[5]) + Vector3(0.0, 0.0, 0.007);
            p.output.position_corrections.push_back({.vertex = p.free[5], .position = place});
        }
        const Matrix3X before = p.s.frame.position;
        ASSERT_TRUE(p.advance().ok());
        const double furthest = (p.s.frame.position - before).colwise().norm().maxCoeff();
        EXPECT_GE(p.stepper->largest_move(), furthest) << tick;
        EXPECT_LE(p.stepper->largest_move(), 20.0 * furthest) << tick << ": a bound that reports nothing";
        limited += p.stepper->limited_edges();
    }
    EXPECT_GT(limited, 0) << "the strain limit moves vertices too";
}

TEST_P(StepperContract, AsksForNoMemoryAfterWarmUp) {
    if (allocation_count() < 0) GTEST_SKIP() << "a sanitizer has replaced the allocator: nothing is counted";
    Pressed p(GetParam());
    p.s.materials.strain_limit = 0.5;  // where it acts, one tick in 64 searches for a blow-up and may ask
    for (int tick = 0; tick < 20; ++tick) p.step(tick);
    const std::int64_t before = allocation_count();
    for (int tick = 20; tick < 40; ++tick) p.step(tick);
    EXPECT_EQ(allocation_count() - before, 0);
}

TEST(StepperEntry, WhatItDoesNotTakeIsNamed) {
    const test::TissueSample s = test::free_vertex();
    StepperEntry entry;
    entry.name = "statue";
    ResponseOutput output = test::empty_output(s.topology);
    EXPECT_EQ(why_not_taken(entry, s.topology, output), "");
    output.held_force(1, 0) = 1.0;
    EXPECT_EQ(why_not_taken(entry, s.topology, output),
              "statue does not take forces held over the tick, which the response asks for");
    output.position_corrections.push_back({.vertex = 0});
    EXPECT_NE(why_not_taken(entry, s.topology, output).find("position corrections"), std::string::npos);
    output.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), 0.0, 1.0, 0.0));
    EXPECT_NE(why_not_taken(entry, s.topology, output).find("contact force laws"), std::string::npos);
    entry.takes_contact_force_laws = entry.takes_position_corrections = entry.takes_held_forces = true;
    EXPECT_EQ(why_not_taken(entry, s.topology, output), "");
    output.contacts.back().role = ContactRole::solved;
    EXPECT_NE(why_not_taken(entry, s.topology, output).find("impulses the response finds"), std::string::npos);
    entry.takes_solved_contacts = true;
    EXPECT_EQ(why_not_taken(entry, s.topology, output), "");
    EXPECT_EQ(registry().default_stepper().name, "semi_implicit");
}

/// One free vertex of 1 g that a load moves along z, and where it comes to rest.
struct Carried {
    test::TissueSample s;
    Index vertex;
    double load;  ///< N
    double z;     ///< m
};

/// The apex of a tetrahedron, 10 mm above a base of 2 cm² that is held: V = A H/3, so that its volume holds the apex by
/// K A/(3 H) = 66.7 N/m (METHODS §4).
Carried carried_by_volume() {
    Enclosure tetrahedron{.triangles = Triangles(3, 4), .volume = 2e-4 * 0.01 / 3.0, .bulk_modulus = 1e4};
    tetrahedron.triangles << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
    Carried one{
        .s = test::make_tissue({Vector3::Zero(), Vector3(0.02, 0, 0), Vector3(0, 0.02, 0), Vector3(0.005, 0.005, 0.01)},
                               std::vector<double>(4, 1e-3), {1, 1, 1, 0}, {}),
        .vertex = 3,
        .load = -0.01,
        .z = 0.01 - 0.01 * 3.0 * 0.01 / (1e4 * 2e-4)};
    one.s.materials.substeps = 4;
    one.s.materials.drag.back() = 0.5;
    one.s.materials.enclosures = {tetrahedron};
    return one;
}

TEST_P(StepperContract, WhatASceneNamesBeyondLinearSpringsCarriesItsLoad) {
    const Carried one = carried_by_volume();
    test::Stepped p(one.s, test::stepper_of(GetParam()));
    p.output.held_force(2, one.vertex) = one.load;
    const Matrix3X& start = one.s.frame.position;
    for (int tick = 0; tick < 1000; ++tick) ASSERT_TRUE(p.advance().ok());
    const double path = one.z - start(2, one.vertex);
    EXPECT_NEAR(p.s.frame.position(2, one.vertex), one.z, 1e-3 * std::abs(path));
    for (Index v = 0; v < one.vertex; ++v) EXPECT_EQ(p.s.frame.position.col(v), start.col(v));
}

TEST_P(StepperContract, WhatASceneNamesBeyondLinearSpringsBearsWhatPressesOnIt) {
    // The same load by a plane, ten times as stiff as what it presses on is on the whole way.
    const Carried one = carried_by_volume();
    test::Stepped p(one.s, test::stepper_of(GetParam()));
    const double path = one.z - one.s.frame.position(2, one.vertex);
    const double k = 10.0 * one.load / path;
    for (int tick = 0; tick < 1000; ++tick) {
        p.output.clear();
        const double gap = one.z + one.load / k - p.s.frame.position(2, one.vertex);
        p.output.contacts.push_back(test::plane_contact(one.vertex, -Vector3::UnitZ(), gap, k, 0.02 * k));
        ASSERT_TRUE(p.advance().ok());
    }
    EXPECT_NEAR(p.s.frame.position(2, one.vertex), one.z, 5e-3 * std::abs(path));
    EXPECT_NEAR(p.stepper->contact_forces()[0].normal, std::abs(one.load), 0.01 * std::abs(one.load));
}

TEST_P(StepperContract, AFaceHeldAgainstWhatIsDrivenIsPushedAlongItsNormalAtTheNearestPoint) {
    // Free corners of 1 g without springs, in the plane across n. The contact has the normal and the weights of a tick
    // ago; by now the driven point stands over 3 parts of the first corner, 2 of the second and 5 of the third.
    const Vector3 n(-0.6, 0.0, 0.8);
    const Vector3 first(0.3, -0.2, 0.5);
    const Vector3 second = first + 0.01 * Vector3(0.8, 0.0, 0.6);
    const Vector3 third = first + 0.01 * Vector3::UnitY();
    const Vector3 weights(0.3, 0.2, 0.5);
    const Vector3 foot = weights[0] * first + weights[1] * second + weights[2] * third;
    for (const bool turned : {false, true}) {  // either order of the corners
        test::TissueSample s = test::make_tissue({first, second, third}, {1e-3, 1e-3, 1e-3}, {0, 0, 0}, {});
        test::Stepped p(s, test::stepper_of(GetParam()));
        ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), -1e-4, 1.0, 0.0);
        contact.role = ContactRole::constraint;
        contact.source_id = 1;
        contact.vertices = {0, turned ? 2 : 1, turned ? 1 : 2};
        contact.weights = {0.5, 0.25, 0.25};
        contact.other_point = foot + 1e-4 * n;
        p.output.contacts.push_back(contact);
        ASSERT_TRUE(p.advance().ok());
        const Vector3 sum = p.s.frame.velocity.rowwise().sum();
        EXPECT_GT(sum.norm(), 0.0);
        EXPECT_LT((sum.normalized() - n).norm(), 1e-3) << turned;
        for (Index v = 0; v < 3; ++v) {
            EXPECT_LT((p.s.frame.velocity.col(v) - weights[v] * sum).norm(), 1e-3 * sum.norm()) << turned << ", " << v;
        }
    }
}

/// Gives every contact the impulse that its point needs for 0.1 m/s along x and 0.2 along the normal, and what it saw.
class ToGivenSpeed final : public SubstepSolver {
public:
    void solve(PredictedStep& step) override {
        ++asked;
        time = step.time();
        for (const SolvedContact& contact : step.contacts()) {
            depth = contact.depth;
            depth_after = step.depth_after(contact);
            seen = step.velocity(contact);
            step.push(contact, (Vector3(0.1, 0.0, 0.2) - seen) / contact.mobility);
            step.shift(contact, 1e-5 / contact.mobility * Vector3(0.0, 1.0, 1.0));
        }
    }
    int asked = 0;
    double time = 0.0, depth = 0.0, depth_after = 0.0;
    Vector3 seen = Vector3::Zero();
};

TEST_P(StepperContract, AsksTheSolverFromWhatItPredictsAndTakesItsImpulsesAndShifts) {
    for (const SolverTiming timing : {SolverTiming::substep, SolverTiming::held}) {
        // 1 g at (1, 0, 0) mm that falls with 0.3 m/s on a surface that rises with 0.05.
        test::TissueSample s = test::make_tissue({Vector3(1e-3, 0.0, 0.0)}, {1e-3}, {0}, {});
        s.materials.substeps = 4;
        s.frame.velocity.col(0) = Vector3(0.0, 0.0, -0.3);
        test::Stepped p(s, test::stepper_of(GetParam()));
        ToGivenSpeed solver;
        ContactForceLaw contact = test::plane_contact(0, Vector3::UnitZ(), -1e-4, 0.0, 0.0);
        contact.role = ContactRole::solved;
        contact.surface_velocity = Vector3(0.0, 0.0, 0.05);
        contact.face_velocity = 0.05;
        p.output.contacts.push_back(contact);
        p.output.solver = &solver;
        p.output.solver_timing = timing;
        ASSERT_TRUE(p.advance().ok());
        const int steps = solver.asked;
        EXPECT_NEAR(steps * solver.time, dt, 1e-12);
        if (timing != SolverTiming::substep) {
            EXPECT_EQ(steps, 1);
        }
        const double relative = solver.seen.z();  // what the last call saw: 0.2 where it had acted before
        EXPECT_NEAR(relative, steps > 1 ? 0.2 : -0.35, 1e-9);
        if (steps == 1) {
            EXPECT_NEAR(solver.depth_after, 1e-4 + 0.35 * solver.time, 1e-12);
        }
        // 0.1 and 0.2 m/s against the surface: 0.25 in the world, and a shift with each call.
        EXPECT_LT((p.s.frame.velocity.col(0) - Vector3(0.1, 0.0, 0.25)).norm(), 1e-9);
        EXPECT_NEAR(p.s.frame.position(1, 0), solver.asked * 1e-5, 1e-12);
        if (timing != SolverTiming::held) {
            EXPECT_NEAR(p.s.frame.position(2, 0), 0.25 * dt + solver.asked * 1e-5, 1e-9);
        }
        EXPECT_NEAR(solver.depth, 1e-4 - (steps - 1) * (0.2 * solver.time + 1e-5), 1e-12);
        const ContactForce& load = p.stepper->contact_forces()[0];
        EXPECT_LT((load.force - 1e-3 / dt * Vector3(0.1, 0.0, 0.55)).norm(), 1e-9);
        EXPECT_NEAR(load.normal, 0.55, 1e-9);
        const double gain = 0.5 * 1e-3 * (0.1 * 0.1 + 0.25 * 0.25 - 0.3 * 0.3);
        EXPECT_NEAR(load.work, gain, 1e-12);
    }
}

TEST_P(StepperContract, SaysOfContactsPositionCorrectionsAndHeldForcesWhetherItTakesThem) {
    // A free vertex at rest that each of the three would bring away from where it is.
    const StepperEntry& entry = registry().stepper(parse_method(GetParam()).name);
    const test::TissueSample still = test::free_vertex();
    const auto moves_it = [&](const ResponseOutput& output) {
        test::Stepped p(still, test::stepper_of(GetParam()));
        p.output = output;
        EXPECT_TRUE(p.advance().ok());
        return p.s.frame.position != still.frame.position;
    };
    ResponseOutput contact = test::empty_output(still.topology);
    contact.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), -0.002, 100.0, 0.0));
    EXPECT_EQ(moves_it(contact), entry.takes_contact_force_laws);
    ToGivenSpeed solver;
    contact.contacts[0].role = ContactRole::solved;
    contact.contacts[0].k = 0.0;
    contact.solver = &solver;
    EXPECT_EQ(moves_it(contact), entry.takes_solved_contacts);
    ResponseOutput position_correction = test::empty_output(still.topology);
    position_correction.position_corrections.push_back({.vertex = 0, .position = Vector3(0.0, 0.001, 0.0)});
    EXPECT_EQ(moves_it(position_correction), entry.takes_position_corrections);
    ResponseOutput push = test::empty_output(still.topology);
    push.held_force(0, 0) = 0.1;
    EXPECT_EQ(moves_it(push), entry.takes_held_forces);
}

}  // namespace
}  // namespace trocar
