// The stepper `adaptive_multires` and outputs that are rare in a run: position corrections beside contacts, tissue that
// only a position correction holds, more contacts over several vertices than its preconditioner has room for, a tick
// that fails, preparing anew. What it should give is what `implicit` gives, which steps the whole.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "method/registry.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/body_boxes.hpp"
#include "tissue/moving_tissue.hpp"
#include "tissue/region_levels.hpp"
#include "tissue/tick_contacts.hpp"
#include "tissue/written_vertices.hpp"

namespace trocar {
namespace {

constexpr double edge = 0.0025;  // m
constexpr double mass = 5e-5;    // kg

/// A disc of about 1450 vertices; with `held` its rim is, without no vertex is, and it has no tension then.
test::TissueSample disc(bool held) {
    test::TissueSample s = test::make_disc(0.05, edge, 100.0, held ? 0.2 : 0.0, mass);
    if (!held) s.materials.pinned.assign(s.materials.pinned.size(), 0);
    return s;
}

/// Fine enough that all around what is touched is active, solved to the rounding.
std::unique_ptr<Stepper> exact_adaptive_multires() {
    return make_stepper("adaptive_multires", {{"whole", "0"}, {"error", "1e-4"}, {"tolerance", "1e-13"}});
}
std::unique_ptr<Stepper> exact_implicit() {
    return make_stepper("implicit", {{"tolerance", "1e-13"}, {"iterations", "2000"}});
}

struct Stepped : test::Stepped {
    using test::Stepped::Stepped;
    void step(const ResponseOutput& given) {
        output = given;
        const Outcome outcome = advance();
        ASSERT_TRUE(outcome.ok()) << outcome.message;
    }
};

TEST(AdaptiveMultiresOutputs, AFailedTickHasNoPartInTheNextOne) {
    // The tick that fails pulls at the very vertex that a contact meets in the next one.
    const test::TissueSample s = disc(true);
    ResponseOutput contact = test::empty_output(s.topology);
    contact.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), -1e-4, 100.0, 0.0));
    ResponseOutput push = test::empty_output(s.topology);
    push.held_force(2, 0) = 0.01;
    ResponseOutput too_much = push;
    too_much.held_force(2, 0) = 1e12;
    for (const ResponseOutput& next : {contact, push}) {
        Stepped failed(s, exact_adaptive_multires());
        Stepped fresh(s, exact_adaptive_multires());
        EXPECT_EQ(test::refused_tick(*failed.stepper, s, too_much, s.frame), OutcomeKind::unstable);
        failed.step(next);
        fresh.step(next);
        const double path = fresh.s.frame.position(2, 0);
        EXPECT_GT(path, 1e-8) << "it moves";
        EXPECT_NEAR(failed.s.frame.position(2, 0), path, 1e-9 * path);
    }
}

TEST(AdaptiveMultiresOutputs, WhatOnlyAPositionCorrectionHoldsHasNoMomentumOfItsOwn) {
    // A disc that nothing pins, of which a position correction holds some vertices while another is pushed beside them.
    const test::TissueSample s = disc(false);
    Stepped whole(s, exact_implicit());
    Stepped adaptive_multires(s, exact_adaptive_multires());
    for (int tick = 0; tick < 20; ++tick) {
        for (Stepped* run : {&whole, &adaptive_multires}) {
            ResponseOutput output = test::empty_output(s.topology);
            for (Index v = 1; v < s.topology.vertex_count; ++v) {
                if (s.frame.position.col(v).norm() > 3.1 * edge) continue;
                output.position_corrections.push_back({v, s.frame.position.col(v), Vector3::Zero(), true});
            }
            output.held_force.col(0) = Vector3(0.1, 0.05, 0.02);
            run->step(output);
        }
        const double furthest = (whole.s.frame.position - s.frame.position).cwiseAbs().maxCoeff();
        EXPECT_LT((adaptive_multires.s.frame.position - whole.s.frame.position).cwiseAbs().maxCoeff(), 1e-6 * furthest)
            << tick;
    }
    EXPECT_GT(whole.s.frame.position(0, 0), 1e-5) << "it is pushed";
}

TEST(AdaptiveMultiresOutputs, AContactOfAVertexThatIsPlacedHasTheGapThatItReports) {
    // Interpolated in a frame that is known; put 1 mm along the normal of a contact that was reported for where it had
    // been.
    const test::TissueSample s = disc(true);
    ResponseOutput output = test::empty_output(s.topology);
    output.position_corrections.push_back({.vertex = 0, .position = Vector3(0.0, 0.0, 0.001)});
    output.contacts.push_back(test::plane_contact(0, Vector3::UnitZ(), -1e-4, 100.0, 0.0));
    Stepped whole(s, exact_implicit());
    Stepped adaptive_multires(s, exact_adaptive_multires());
    for (Stepped* run : {&whole, &adaptive_multires}) {
        run->step(test::empty_output(s.topology));
        run->step(output);
    }
    const double force = whole.stepper->contact_forces()[0].normal;
    EXPECT_GT(force, 1e-3);
    EXPECT_NEAR(adaptive_multires.stepper->contact_forces()[0].normal, force, 1e-4 * force);
}

TEST(AdaptiveMultiresOutputs, ContactsOverSeveralVerticesPressAsOnTheWholeTissueHoweverManyTheyAre) {
    // Stiff contacts on three vertices each: 120, and more than the 256 that the preconditioner treats exactly. Those
    // beyond are in its blocks.
    for (const std::size_t most : {std::size_t{120}, std::size_t{400}}) {
        const test::TissueSample s = disc(true);
        Stepped whole(s, exact_implicit());
        Stepped adaptive_multires(
            s, make_stepper("adaptive_multires", {{"whole", "0"}, {"error", "1e-4"}, {"iterations", "200"}}));
        ResponseOutput output = test::empty_output(s.topology);
        for (const Spring& one : s.materials.springs) {
            for (const Spring& other : s.materials.springs) {
                if (other.i != one.i || other.j <= one.j || output.contacts.size() == most) continue;
                ContactForceLaw contact = test::plane_contact(one.i, -Vector3::UnitZ(), -1e-6, 1e6, 1.0);
                contact.vertices = {one.i, one.j, other.j};
                contact.weights = {0.5, 0.3, 0.2};
                contact.reaction_body = 0;
                output.contacts.push_back(contact);
            }
        }
        ASSERT_EQ(output.contacts.size(), most);
        whole.step(output);
        adaptive_multires.step(output);
        const double force = whole.reaction[0].force.z();
        EXPECT_GT(force, 0.01) << most;
        EXPECT_NEAR(adaptive_multires.reaction[0].force.z(), force, 0.005 * force) << most;
    }
}

TEST(AdaptiveMultiresOutputs, AContactThatTheStepItselfBringsAboutHasItsDamper) {
    // Planes above vertices at rest that a force drives into them: nothing at the start shows that they will meet. The
    // damper is twenty times what the spring gives in a step. Some stand so far that they are not met.
    const test::TissueSample s = disc(true);
    Stepped whole(s, exact_implicit());
    Stepped adaptive_multires(s, exact_adaptive_multires());
    ResponseOutput output = test::empty_output(s.topology);
    for (Index v = 0; v < 30; ++v) {
        output.held_force(2, v) = 0.1;
        const double gap = v % 3 == 0 ? 0.01 : 1e-5 * (1 + v % 7);
        output.contacts.push_back(test::plane_contact(v, -Vector3::UnitZ(), gap, 100.0, 2.0));
    }
    whole.step(output);
    adaptive_multires.step(output);
    int pressing = 0;
    for (std::size_t c = 0; c < output.contacts.size(); ++c) {
        const double force = whole.stepper->contact_forces()[c].normal;
        EXPECT_NEAR(adaptive_multires.stepper->contact_forces()[c].normal, force, 1e-3 * 0.1) << c;
        pressing += force > 0.0 ? 1 : 0;
    }
    EXPECT_GE(pressing, 5);
}

TEST(AdaptiveMultiresOutputs, PreparedAnewForTissueThatItStepsAsAWholeItReportsNothingOfWhatItMovedBefore) {
    Stepped run(disc(true), make_stepper("adaptive_multires", {{"whole", "100"}}));
    ResponseOutput output = test::empty_output(run.s.topology);
    output.held_force(2, 0) = 0.01;
    run.stepper->trust_frames(true);
    run.step(output);
    ASSERT_NE(run.stepper->moved(), nullptr);
    run.s = test::make_disc(0.05, 0.01, 100.0, 0.2, mass);
    run.stepper->prepare(run.s.topology, run.s.materials);
    run.step(test::empty_output(run.s.topology));
    EXPECT_EQ(run.stepper->moved(), nullptr);
}

TEST(AdaptiveMultiresOutputs, AnEdgeThatItsNeighboursCorrectionLengthensCountsAsLimited) {
    // Three in a row: the last is drawn away by four tenths of an edge, which is shared with the one in the middle, so
    // that the edge before it is too long in turn, after it has been examined.
    test::TissueSample s = test::make_tissue(
        {Vector3::Zero(), Vector3(0.01, 0.0, 0.0), Vector3(0.02, 0.0, 0.0)}, {1e-3, 1e-3, 1e-3}, {1, 0, 0},
        {{.i = 0, .j = 1, .rest = 0.01, .k = 100.0}, {.i = 1, .j = 2, .rest = 0.01, .k = 100.0}});
    s.materials.strain_limit = 0.05;
    ResponseOutput output = test::empty_output(s.topology);
    output.held_force(0, 1) = 1e-9;
    output.held_force(0, 2) = 4.0;
    Stepped whole(s, exact_implicit());
    Stepped adaptive_multires(s, exact_adaptive_multires());
    whole.step(output);
    adaptive_multires.step(output);
    EXPECT_EQ(whole.stepper->limited_edges(), 2);
    EXPECT_EQ(adaptive_multires.stepper->limited_edges(), 2);
    EXPECT_NEAR(adaptive_multires.s.frame.position(0, 2), whole.s.frame.position(0, 2), 1e-12);
}

TEST(AdaptiveMultiresOutputs, LevelsOfTissueThatIsFoldedOntoItselfHaveSharesThatAreNumbers) {
    // A strip folded in the middle: every vertex but those of the fold lies on another one.
    constexpr Index length = 61;
    constexpr Index width = 12;
    std::vector<Vector3> points;
    std::vector<Spring> springs;
    for (Index i = 0; i < length; ++i) {
        for (Index j = 0; j < width; ++j) {
            const Index v = i * width + j;
            points.emplace_back(edge * std::abs(i - length / 2), edge * j, 0.0);
            if (j > 0) springs.push_back({.i = v - 1, .j = v, .rest = edge, .k = 100.0});
            if (i > 0) springs.push_back({.i = v - width, .j = v, .rest = edge, .k = 100.0});
        }
    }
    const test::TissueSample s = test::make_tissue(points, std::vector<double>(points.size(), mass),
                                                   std::vector<std::uint8_t>(points.size(), 0), springs);
    MovingTissue tissue(s.topology, s.materials);
    tissue.take_over(test::empty_output(s.topology), s.frame);
    WrittenVertices written(tissue.state());
    BodyBoxes boxes(s.topology);
    const RegionTissue region(tissue, written, boxes, s.topology, s.frame.position, 20);
    ASSERT_GE(region.levels().size(), 3U);
    for (const NodeLevel& level : region.levels()) {
        double sum = 0.0;
        for (const double one : level.mass) sum += one;
        EXPECT_NEAR(sum, mass * static_cast<double>(points.size()), 1e-12);
        for (const auto& weights : level.weight) EXPECT_NEAR(weights[0] + weights[1] + weights[2], 1.0, 1e-12);
    }
}

TEST(TickContacts, AnchorsOfTheLastTickAreForgotten) {
    // Five contacts have friction. In the next tick there is one, which has none: the strongest of before has no number
    // in it.
    std::vector<Vector3> points(5);
    for (std::size_t v = 0; v < 5; ++v) points[v] = Vector3(0.01 * static_cast<double>(v), 0.0, 0.0);
    const test::TissueSample s =
        test::make_tissue(points, std::vector<double>(5, mass), std::vector<std::uint8_t>(5, 0), {});
    MovingTissue tissue(s.topology, s.materials);
    ResponseOutput output = test::empty_output(s.topology);
    tissue.take_over(output, s.frame);
    TickContacts contacts(s.topology.vertex_count, tissue.state().size());
    for (Index v = 0; v < 5; ++v) {
        output.contacts.push_back(test::plane_contact(v, Vector3::UnitZ(), -1e-4, 100.0, 0.0));
        output.contacts.back().friction = 0.3;
        output.contacts.back().tangent_k = 100.0;
        output.contacts.back().slip_key = v;
    }
    contacts.collect(output, s.frame, tissue.state());
    for (TickContact& contact : contacts.all()) contact.force = 1.0;
    contacts.gather_anchor();
    EXPECT_EQ(contacts.anchor(4).strongest, 4U);
    EXPECT_EQ(contacts.anchor(4).most, 0.3);
    output.contacts.resize(1);
    output.contacts[0].friction = 0.0;
    output.contacts[0].slip_key = -1;
    contacts.collect(output, s.frame, tissue.state());
    ASSERT_TRUE(contacts.any_has_friction()) << "the springs of the last tick are still known";
    EXPECT_EQ(contacts.anchor(4).most, 0.0);
    EXPECT_EQ(contacts.anchor(4).strongest, 0U);
    contacts.gather_anchor(true);
    EXPECT_FALSE(contacts.anchor(4).stays);
}

}  // namespace
}  // namespace trocar
