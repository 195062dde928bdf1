#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/energy.hpp"
#include "support/response_samples.hpp"
#include "support/scene_runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using test::edges_crossing;
using test::PairSample;
using test::vertex_of_a_in_b;
using test::vertex_of_b_in_a;

TEST(Penalty, PushesAlongTheNormalAndNeverPulls) {
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    s.frame.velocity.col(3) = Vector3(0.5, 0.0, -0.25);
    s.respond("penalty:k=1000,mu=2");
    ASSERT_EQ(s.output.contacts.size(), 1U);
    EXPECT_FALSE(s.output.contacts[0].adhesive);
    EXPECT_NEAR(s.shown_force(0).z(), -1.0, 1e-12);
    s.frame.velocity.col(3) = Vector3(0.0, 0.0, 5.0);
    s.respond("penalty:k=1000,mu=2");
    EXPECT_EQ(s.shown_force(0).norm(), 0.0);
}

TEST(Penalty, ActsAlikeOnEveryClassOfBodies) {
    for (const BodyKind other : {BodyKind::instrument, BodyKind::rigid, BodyKind::tissue}) {
        PairSample s = vertex_of_a_in_b(BodyKind::instrument, other);
        s.respond("penalty:k=1000");
        EXPECT_LT((s.shown_force(0) - Vector3(0, 0, 1.5)).norm(), 1e-12);
        PairSample e = edges_crossing(BodyKind::instrument, other);
        e.respond("penalty:k=8");
        EXPECT_LT((e.shown_force(0) + Vector3(1.0, 0, 0)).norm(), 1e-12);
    }
}

TEST(Penalty, NativeContactWithoutVerticesLoadsTheTissueAtItsPoint) {
    PairSample s = vertex_of_a_in_b(BodyKind::instrument, BodyKind::tissue);
    s.contacts.contacts = {test::native_contact()};
    s.respond("penalty:k=100");
    ASSERT_EQ(s.output.contacts.size(), 1U);
    EXPECT_NEAR(s.output.contacts[0].weights[0], 0.5, 1e-12);
    EXPECT_NEAR(s.output.contacts[0].weights[2], 0.3, 1e-12);
    EXPECT_NEAR(s.shown_force(0).z(), 0.2, 1e-12);
    s.contacts.contacts = {test::native_contact()};
    s.contacts.contacts[0].depth = Contact::unset;
    s.respond("penalty:k=100");
    EXPECT_EQ(s.output.skipped_for(SkipReason::no_direction), 1);
}

TEST(Penalty, ReductionKeepsTheDeepestContactOfAVertex) {
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    const Contact contact = s.contacts.contacts[0];
    for (const double depth : {0.0002, 0.003, 0.001}) {
        s.contacts.contacts.push_back(contact);
        s.contacts.contacts.back().depth = depth;
    }
    s.respond("penalty:k=100");
    EXPECT_EQ(s.output.contacts.size(), 1U);
    EXPECT_NEAR(s.shown_force(0).z(), -0.3, 1e-12);
    s.respond("penalty:k=100,reduction=pair");
    EXPECT_EQ(s.output.contacts.size(), 4U);
    EXPECT_NEAR(s.shown_force(0).z(), -0.47, 1e-12);
}

TEST(Penalty, WeightByAreaIsThatOfThePushedFeature) {
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    s.respond("penalty:k=100,mu=2");
    ASSERT_EQ(s.output.contacts.size(), 1U);
    const Range tissue = s.topology.bodies[1].vertices;
    double mean = 0.0;
    for (Index v = tissue.first; v < tissue.end(); ++v) {
        // Unequal areas, so that the weight is not 1.
        s.materials.area[at(v)] = 1e-6 * static_cast<double>(v);
        mean += s.materials.area[at(v)] / static_cast<double>(tissue.count);
    }
    const double share = s.materials.area[at(s.output.contacts[0].vertices[0])] / mean;
    EXPECT_GT(std::abs(share - 1.0), 0.1);
    s.respond("penalty:k=100,mu=2,weight=area");
    ASSERT_EQ(s.output.contacts.size(), 1U);
    EXPECT_NEAR(s.output.contacts[0].k, 100.0 * share, 1e-12);
    EXPECT_NEAR(s.output.contacts[0].mu, 2.0 * share, 1e-12);
}

TEST(SceneStiffness, EveryResponseOfAForceLawCanTakeIt) {
    for (const char* response : {"penalty", "unilateral:k=scene", "xpbd_contact:k=scene"}) {
        PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
        s.materials.contact_laws = {{.k = 321.0, .mu = 7.0}};
        s.respond(response);
        ASSERT_FALSE(s.output.contacts.empty()) << response;
        EXPECT_EQ(s.output.contacts[0].k, 321.0) << response;
        EXPECT_EQ(s.output.contacts[0].mu, 7.0) << response;
    }
}

/// A shaft whose tip is one vertex, pressed `depth` into a flat bone straight over one of its vertices or beside it.
Vector3 force_of_a_tip_on_a_plate(const std::string& response, double beside, double depth) {
    const Scene scene = test::scene_from_text(fmt::format(
        R"({{"format":"trocar-scene-2","name":"tip","unit":"m","dt":0.001,"ticks":60,"seed":1,"bodies":[
      {{"name":"plate","kind":"rigid","closed":true,"pose":[0,0,-0.01,0,0,0],
        "parts":[{{"shape":"box","size":[0.1,0.1,0.02],"edge":0.01}}]}},
      {{"name":"tool","kind":"instrument","closed":true,"parts":[{{"shape":"shaft","radius":0.004,"length":0.1,"edge":0.003}}],
       "motion":{{"drive":"prescribed","keys":[{{"time":0,"pose":[{0},{1},0.001,0,0,0]}},
                                              {{"time":0.05,"pose":[{0},{1},{2},0,0,0]}}]}}}}],
      "contact":[{{"bodies":["tool","plate"],"k":1000,"mu":0}}]}})",
        beside, 0.6 * beside, -depth));
    // Of features both vertices are inside the other body, which is two contacts.
    return test::run_scene_with(scene, response, 1, 0, {}, {}, "intersection").rows.back().tool_force;
}

TEST(Penalty, AVertexOnAVertexIsPushedStraightBackByItsOwnDepthAlone) {
    // Where vertices meet, the edges of both cross each other too: they are the same overlap, not more of it.
    for (const char* response : {"penalty", "impulse", "reflection"}) {
        for (const double beside : {0.0, 1e-7, 0.0013}) {
            for (const double depth : {1e-5, 1e-4}) {
                const Vector3 force = force_of_a_tip_on_a_plate(response, beside, depth);
                EXPECT_NEAR(force.z(), 1000.0 * depth, 1e-9) << response << " " << beside << " " << depth;
                EXPECT_LT(force.head<2>().norm(), 1e-9) << response << " " << beside << " " << depth;
            }
        }
    }
}

struct Rest {
    double mean = 0.0;    // N, of the force along z over the last 0.1 s
    double spread = 0.0;  // N, standard deviation
};

/// A tool over a sheet of tissue, lowered in 0.2 s to `lowest` and held there until 0.6 s.
Rest rest_on_a_sheet(const std::string& tool, const std::string& drive, double above, double lowest, double dt) {
    const Scene scene = test::scene_from_text(fmt::format(
        R"({{"format":"trocar-scene-2","name":"rest","unit":"m","dt":{},"ticks":{},"seed":1,"bodies":[
      {{"name":"sheet","kind":"tissue","closed":false,"parts":[{{"shape":"sheet","size":[0.1,0.1],"edge":0.005}}]}},
      {{"name":"tool","kind":"instrument","closed":true,"parts":[{}],
       "motion":{{"drive":"{}","keys":[{{"time":0,"pose":[0.0013,0.0007,{},0,0,0]}},
                                      {{"time":0.2,"pose":[0.0013,0.0007,{},0,0,0]}}]}}}}]}})",
        dt, std::lround(0.6 / dt), tool, drive, above, lowest));
    constexpr std::int64_t never = 1'000'000;
    const Record record = test::run_scene_with(scene, "penalty", never);
    const auto count = static_cast<std::size_t>(std::lround(0.1 / dt));
    EXPECT_GT(record.rows.size(), count);
    Rest rest;
    double squares = 0.0;
    for (std::size_t i = record.rows.size() - count; i < record.rows.size(); ++i) {
        const double force = record.rows[i].tool_force.z();
        rest.mean += force / static_cast<double>(count);
        squares += force * force / static_cast<double>(count);
    }
    rest.spread = std::sqrt(std::max(0.0, squares - rest.mean * rest.mean));
    return rest;
}

TEST(Penalty, RestForceDoesNotDependOnTheTickWhereThereIsRest) {
    const std::string shaft = R"({"shape":"shaft","radius":0.004,"length":0.1,"edge":0.003})";
    const Rest coarse = rest_on_a_sheet(shaft, "operator", 0.001, -0.003, 1e-3);
    const Rest fine = rest_on_a_sheet(shaft, "operator", 0.001, -0.003, 1e-4);
    EXPECT_LT(coarse.spread, 0.005 * coarse.mean);
    EXPECT_LT(fine.spread, 0.005 * fine.mean);
    EXPECT_NEAR(fine.mean, coarse.mean, 0.005 * coarse.mean);
    // A ball on the faces of a sheet rests too, since contacts of features do not end where triangles cease to meet.
    const std::string ball = R"({"shape":"sphere","radius":0.008,"edge":0.002})";
    for (const double dt : {1e-3, 1e-4}) {
        const Rest rest = rest_on_a_sheet(ball, "prescribed", 0.009, 0.005, dt);
        EXPECT_LT(rest.spread, 0.005 * rest.mean) << dt;
    }
}

TEST(Penalty, BoneAndASecondTissuePushTissueToo) {
    PairSample bone = vertex_of_b_in_a(BodyKind::rigid, BodyKind::tissue);
    bone.respond("penalty:k=100");
    ASSERT_EQ(bone.output.contacts.size(), 1U);
    EXPECT_EQ(bone.output.contacts[0].reaction_body, -1);
    EXPECT_EQ(bone.output.contacts[0].reaction_vertices[0], -1);
    PairSample tissue = vertex_of_b_in_a(BodyKind::tissue, BodyKind::tissue);
    tissue.respond("penalty:k=100");
    ASSERT_EQ(tissue.output.contacts.size(), 1U);
    EXPECT_EQ(tissue.output.contacts[0].vertices[0], 3);
    EXPECT_EQ(tissue.output.contacts[0].reaction_vertices[0], 0);
}

TEST(PointResponses, BothTissuesOfAPairGetOppositeMomentum) {
    // I21: what one side gains the other loses, with masses that differ.
    for (const char* method : {"impulse", "impulse:e=0.5", "reflection:bump=0.5,friction=0.5", "xpbd_contact:k=1000"}) {
        PairSample s = vertex_of_b_in_a(BodyKind::tissue, BodyKind::tissue);
        for (std::size_t v = 0; v < 6; ++v) s.materials.mass[v] = 1e-3 * static_cast<double>(1 + v);
        s.materials.substeps = 1;
        s.frame.velocity.col(3) = Vector3(0.3, 0.1, -0.4);
        s.step(method);
        ASSERT_TRUE(s.outcome.ok()) << method << s.outcome.message;
        EXPECT_GT((s.frame.velocity - s.before.velocity).norm(), 0.1) << method;
        const Vector3 before = test::momentum_of(s.materials, s.before);
        EXPECT_LT((test::momentum_of(s.materials, s.frame) - before).norm(), 1e-14) << method;
    }
}

}  // namespace
}  // namespace trocar
