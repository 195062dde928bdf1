// What responses do over time, with tool, tissue and integrator together: the witnesses of the thesis' defects and the
// invariants of the corrections (METHODS §13, §14).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "support/closed_loop.hpp"
#include "support/response_samples.hpp"

namespace trocar {
namespace {

using test::ClosedLoop;
using test::LoopBody;
using test::make_shaft;
using test::make_sheet;
using test::PairSample;
using test::Shape;
using test::vertex_of_b_in_a;

TEST(UnilateralRigid, BoneSpikeUnderTissueLiftsItAndFaithfulIgnoresIt) {
    // The spike points up through the sheet; only its own vertices enter tissue faces.
    const auto run = [](const std::string& method) {
        test::Shape spike = make_shaft(0.0015, 0.03, 6, 0.02);
        for (Vector3& p : spike.vertices) p = Vector3(p.x(), -p.y(), -p.z());  // turned over: outer normals stay outer
        spike.move({0.0011, 0.0007, -0.001});
        ClosedLoop loop(
            {LoopBody{.name = "bone",
                      .mesh = spike,
                      .offset = [](double t) { return Vector3(0, 0, std::min(0.004, 0.1 * t)); }},
             LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = make_sheet(8, 0.005)}},
            method);
        for (int tick = 0; tick < 250; ++tick) EXPECT_TRUE(loop.step()) << loop.outcome.message;
        return -test::depth_at_tip(loop);  // the spike's way above the sheet
    };
    EXPECT_LE(run("unilateral"), 1e-4);
    EXPECT_GT(run("thesis"), 1e-3);
}

TEST(TissueTissue, AnEvenNumberOfPairsCancelsInFaithfulAndNotInCorrected) {
    const auto closing_speed = [](const std::string& method, std::size_t pairs) {
        PairSample s = vertex_of_b_in_a(BodyKind::tissue, BodyKind::tissue);
        s.frame.velocity.col(3) = Vector3(0.0, 0.0, -0.4);
        s.contacts.contacts.assign(pairs, s.contacts.contacts[0]);
        s.respond(method);
        Vector3 speed = s.frame.velocity.col(3);
        Vector3 other = s.frame.velocity.col(0);
        for (const PositionCorrection& position_correction : s.output.position_corrections) {
            if (position_correction.vertex == 3) speed = position_correction.velocity;
            if (position_correction.vertex == 0) other = position_correction.velocity;
        }
        return -(speed - other).z();
    };
    EXPECT_NEAR(closing_speed("thesis", 1), -0.4, 1e-12);
    EXPECT_NEAR(closing_speed("thesis", 2), 0.4, 1e-12);
    EXPECT_NEAR(closing_speed("thesis", 3), -0.4, 1e-12);
    const double once = closing_speed("thesis:profile=corrected", 1);
    EXPECT_LE(once, 0.0);
    EXPECT_DOUBLE_EQ(closing_speed("thesis:profile=corrected", 2), once);
}

/// How far a vertex of the lower sheet stands above the upper one's surface, m; the most of all, over the plan.
double highest_above(const ClosedLoop& loop, std::size_t lower, std::size_t upper) {
    double most = -std::numeric_limits<double>::infinity();
    const Range vertices = loop.topology.bodies[lower].vertices;
    for (Index v = vertices.first; v < vertices.end(); ++v) {
        const Vector3 x = loop.frame.position.col(v);
        for (const double height : test::heights_at(loop, loop.topology.bodies[upper].triangles, x)) {
            most = std::max(most, x.z() - height);
        }
    }
    return most;
}

TEST(TissueTissue, SheetsPressedOnEachOtherKeepTheirOrderInUnilateral) {
    const auto worst = [&](const std::string& method) {
        ClosedLoop loop(
            {LoopBody{.name = "tool",
                      .kind = BodyKind::instrument,
                      .mesh = make_shaft(0.006, 0.06, 10, 0.002),
                      .offset = [](double t) { return Vector3(0.0011, 0.0007, 0.002 - 0.04 * std::min(t, 0.25)); }},
             LoopBody{.name = "upper", .kind = BodyKind::tissue, .closed = false, .mesh = make_sheet(20, 0.005)},
             LoopBody{.name = "middle",
                      .kind = BodyKind::tissue,
                      .closed = false,
                      .mesh = make_sheet(17, 0.0055).move(Vector3(0.0017, 0.0009, -0.002))},
             LoopBody{.name = "lower",
                      .kind = BodyKind::tissue,
                      .closed = false,
                      .mesh = make_sheet(15, 0.006).move(Vector3(0.001, 0.0004, -0.004))}},
            method);
        double most = 0.0;
        for (int tick = 0; tick < 300; ++tick) {
            EXPECT_TRUE(loop.step()) << loop.outcome.message;
            if (tick % 20 != 19) continue;
            most = std::max({most, highest_above(loop, 2, 1), highest_above(loop, 3, 2)});
        }
        return most;
    };
    EXPECT_LT(worst("unilateral"), 1e-4);
}

TEST(EveryResponse, EveryDeclaredChoiceRunsAndStaysFinite) {
    for (const ResponseEntry& entry : registry().responses()) {
        std::vector<std::string> methods{entry.name};
        for (const Parameter& parameter : entry.parameters) {
            for (const std::string& choice : parameter.choices) {
                methods.push_back(entry.name + ":" + parameter.name + "=" + choice);
                if (entry.name == "thesis" && parameter.name != "profile") {
                    methods.push_back("thesis:profile=corrected," + parameter.name + "=" + choice);
                }
            }
        }
        for (const std::string& method : methods) {
            // 3 mm into the sheet at 0.2 m/s, and out again after 20 ms.
            const auto offset = [](double t) {
                return Vector3(0.0011, 0.0007, std::max({0.002 - 0.2 * t, -0.003, -0.003 + 0.2 * (t - 0.045)}));
            };
            ClosedLoop loop =
                test::tool_on_tissue(make_shaft(0.0025, 0.06, 8, 0.01), offset, make_sheet(10, 0.005), method);
            for (int tick = 0; tick < 60; ++tick) {
                if (!loop.step()) break;  // a blow-up has a name; what must not be is an unnamed one
                ASSERT_TRUE(loop.frame.all_finite()) << method;
                for (const Wrench& wrench : loop.output.wrench) ASSERT_TRUE(wrench.force.allFinite()) << method;
            }
            EXPECT_TRUE(loop.outcome.ok() || method.find("printed") != std::string::npos ||
                        method.find("unilateral") != std::string::npos || method.find("explicit") != std::string::npos)
                << method << ": " << loop.outcome.message;
        }
    }
}

TEST(ImpulseFamily, TakesTheClosingSpeedAndGivesTheToolTheMomentum) {
    for (const char* method : {"impulse:bias=0", "reflection"}) {
        PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
        s.frame.velocity.col(3) = Vector3(0.5, 0.0, -0.4);
        s.step(method);
        EXPECT_LT((s.frame.velocity.col(3) - Vector3(0.5, 0.0, 0.0)).norm(), 1e-12) << method;
        EXPECT_NEAR(s.load[0].force.z(), -1e-3 * 0.4 / 1e-3, 1e-12) << method;
        EXPECT_NEAR(s.contact_forces[0].work, -0.5 * 1e-3 * 0.4 * 0.4, 1e-12) << method;
    }
    PairSample bounce = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    bounce.frame.velocity.col(3) = Vector3(0.5, 0.0, -0.4);
    bounce.step("reflection:bump=1,friction=0");
    EXPECT_LT((bounce.frame.velocity.col(3) - Vector3(0.0, 0.0, 0.4)).norm(), 1e-12);
    EXPECT_NEAR(bounce.contact_forces[0].work, -0.5 * 1e-3 * 0.5 * 0.5, 1e-12);
    PairSample placed = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    placed.step("reflection");
    EXPECT_NEAR(placed.frame.position(2, 3), 0.0, 1e-15);
    EXPECT_EQ(placed.frame.velocity.norm(), 0.0);
}

TEST(ImpulseFamily, AVertexThatFallsOnAPlateKeepsThePartOfItsSpeedThatRestitutionSays) {
    // Newton's restitution: e × the speed before, to 1 %, wherever in the tick the plate is met. No gravity acts.
    for (const double e : {0.0, 0.3, 0.8, 1.0}) {
        for (const double gap : {0.00002, 0.00013, 0.00021, 0.00029}) {
            for (const std::string name : {"impulse:e=", "reflection:bump="}) {
                PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
                s.materials.substeps = 4;
                s.frame.position(2, 3) = gap;
                Contact& contact = s.contacts.contacts[0];
                contact.kind = ContactCase::point_face;
                contact.point = s.frame.position.col(3);
                contact.depth = -gap;
                s.frame.velocity.col(3) = Vector3(0.1, 0.0, -0.4);
                s.step(name + fmt::format("{}", e));
                EXPECT_NEAR(s.frame.velocity(2, 3), 0.4 * e, 0.01 * 0.4) << name << e << " from " << gap;
                EXPECT_NEAR(s.load[0].force.z(), -(1.0 + e) * 0.4, 0.01 * 0.4) << name << e;
                EXPECT_GE(s.frame.position(2, 3), -1e-12) << name << e << " from " << gap;
            }
        }
    }
}

TEST(ImpulseFamily, ActsInEverySubStep) {
    // A vertex that a spring draws into the plate: found once, the impulse would take the speed of the first sub-step
    // alone.
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    s.materials.substeps = 10;
    s.materials.pinned = {0, 0, 0, 0, 1, 1};
    s.materials.springs = {{.i = 3, .j = 4, .rest = 0.04, .k = 50.0}};
    s.frame.velocity(2, 3) = -0.1;
    s.step("impulse:bias=0");
    EXPECT_NEAR(s.frame.velocity(2, 3), 0.0, 1e-12);
}

TEST(XpbdContact, IsAnUndampedSpringAsStiffAsItsComplianceSays) {
    PairSample rigid = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    rigid.materials.substeps = 1;
    rigid.step("xpbd_contact");
    EXPECT_NEAR(rigid.frame.position(2, 3), 0.0, 1e-8);
    // Backward Euler of a spring k on a free mass m: force = k d / (1 + k dt²/m).
    PairSample soft = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    soft.materials.substeps = 1;
    soft.step("xpbd_contact:k=100");
    EXPECT_NEAR(soft.load[0].force.z(), -100.0 * 0.0005 / (1.0 + 100.0 * 1e-6 / 1e-3), 1e-12);
}

}  // namespace
}  // namespace trocar
