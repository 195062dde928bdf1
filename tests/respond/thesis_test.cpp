// The response `thesis` on one triangle pair: which equation acts, on whom, and what the ResponseOutput then says.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "respond/contact_reduction.hpp"
#include "support/response_samples.hpp"

namespace trocar {
namespace {

using test::edges_crossing;
using test::PairSample;
using test::vertex_of_a_in_b;
using test::vertex_of_b_in_a;

TEST(ThesisInstruments, VertexInFaceFollows34AndForcesAreOpposite) {
    for (const char* method :
         {"thesis:k=1000", "thesis:k=1000,distribute=force_at_vertex", "thesis:profile=printed,k=1000"}) {
        PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::instrument);
        s.frame.velocity.col(0) = Vector3(0.0, 0.0, 0.05);
        s.frame.velocity.col(3) = Vector3(0.1, 0.0, -0.25);
        if (std::string(method).find("at_vertex") == std::string::npos) {
            s.frame.velocity.col(1) = s.frame.velocity.col(2) = s.frame.velocity.col(0);
        }
        s.respond(std::string(method) + ",mu=2.5");
        ASSERT_EQ(s.output.contacts.size(), 1U);
        EXPECT_EQ(s.output.contacts[0].vertices[0], 3);
        EXPECT_TRUE(s.output.contacts[0].adhesive);
        // k d - mu (V2 - V1)·n = 0.5 + 2.5 * 0.3
        EXPECT_LT((s.shown_force(1) - Vector3(0, 0, 1.25)).norm(), 1e-12);
        EXPECT_LT((s.shown_force(0) + Vector3(0, 0, 1.25)).norm(), 1e-12);
    }
}

TEST(ThesisInstruments, RigidBodyTakesNothing) {
    PairSample inside = vertex_of_a_in_b(BodyKind::instrument, BodyKind::rigid);
    inside.respond("thesis");
    ASSERT_EQ(inside.output.contacts.size(), 1U);
    EXPECT_EQ(inside.output.contacts[0].reaction_body, -1);
    EXPECT_LT((inside.shown_force(0) - Vector3(0, 0, 1.5)).norm(), 1e-12);
    // The other way round the instrument's face is pushed away from the rigid vertex.
    PairSample face = vertex_of_b_in_a(BodyKind::instrument, BodyKind::rigid);
    face.respond("thesis");
    EXPECT_LT((face.shown_force(0) - Vector3(0, 0, -0.5)).norm(), 1e-12);
    EXPECT_EQ(face.shown_force(1), Vector3(Vector3::Zero()));
}

TEST(ThesisInstruments, CrossingEdgesFollow35) {
    PairSample s = edges_crossing(BodyKind::instrument, BodyKind::instrument);
    s.frame.velocity.setRandom();  // no damper in 3.5
    s.respond("thesis:k=500");
    EXPECT_LT((s.shown_force(1) - Vector3(62.5, 0, 0)).norm(), 1e-10);
    EXPECT_LT((s.shown_force(0) + Vector3(62.5, 0, 0)).norm(), 1e-10);
}

TEST(ContactReduction, CrossingEdgesAreNamedByTheirEndsWhateverTheOrderOfCorners) {
    // Both triangles cut the x axis: the edge of vertices 3 and 4 at 0.375, that of 0 and 1 at 0.5.
    PairSample s = edges_crossing(BodyKind::instrument, BodyKind::tissue);
    for (int turn = 0; turn < 3; ++turn) {
        EXPECT_EQ(name_edges(s.topology, s.frame, s.contacts.contacts[0]), (EdgeKey{0, 1, 3, 4})) << turn;
        for (Index t = 0; t < 2; ++t) {
            const Triangles before = s.topology.triangles.col(t);
            s.topology.triangles.col(t) << before(1, 0), before(2, 0), before(0, 0);
        }
    }
}

TEST(ThesisTissue, InstrumentVertexFollows36WithTheStiffnessOfTheNearestVertex) {
    PairSample s = vertex_of_a_in_b(BodyKind::instrument, BodyKind::tissue);
    s.materials.mean_stiffness = {0, 0, 0, 220.0, 1.0, 2.0};
    s.frame.velocity.col(0) = Vector3(0.03, -0.02, -0.2);
    s.respond("thesis:mu=0.8,n_back=0");
    ASSERT_EQ(s.output.contacts.size(), 1U);
    EXPECT_DOUBLE_EQ(s.output.contacts[0].k, 220.0);
    EXPECT_NEAR(s.shown_force(0).z(), 0.33 + 0.16, 1e-12);
    s.respond("thesis:mu=0.8,profile=printed,n_back=0");
    EXPECT_NEAR(s.shown_force(0).z(), 0.33 - 0.16, 1e-12);
    EXPECT_DOUBLE_EQ(s.output.contacts[0].mu, -0.8);
    s.materials.contact_laws[0].k = 100.0;
    s.respond("thesis:mu=0,n_back=0");
    EXPECT_NEAR(s.shown_force(0).z(), 0.15, 1e-12) << "the scene's stiffness";
    s.respond("thesis:mu=0,k=10,n_back=0");
    EXPECT_NEAR(s.shown_force(0).z(), 0.015, 1e-12) << "the method's stiffness";
}

TEST(ThesisTissue, ForceIsSharedOutAtTheProjectionOrPutOnTheNearestVertex) {
    PairSample s = vertex_of_a_in_b(BodyKind::instrument, BodyKind::tissue);
    s.respond("thesis");
    const ContactForceLaw& shared = s.output.contacts[0];
    EXPECT_NEAR(shared.weights[0], 0.5, 1e-12);
    EXPECT_NEAR(shared.weights[1], 0.2, 1e-12);
    EXPECT_NEAR(shared.weights[2], 0.3, 1e-12);
    s.respond("thesis:distribute=force_at_vertex");
    EXPECT_EQ(s.output.contacts[0].vertices[0], 3);
    EXPECT_EQ(s.output.contacts[0].vertices[1], -1);
}

TEST(ThesisTissue, CrossingEdgesUseTheTriangleStiffness) {
    PairSample s = edges_crossing(BodyKind::instrument, BodyKind::tissue);
    s.respond("thesis:distribute=force_at_vertex");
    ASSERT_EQ(s.output.contacts.size(), 1U);
    EXPECT_EQ(s.output.contacts[0].vertices[0], 4);
    EXPECT_LT((s.shown_force(0) + Vector3(21.25, 0, 0)).norm(), 1e-12);
}

TEST(ThesisTissue, TissueVertexIsPutWhereItsPathMetTheFaceOfAToolOrABone) {
    for (const BodyKind kind : {BodyKind::instrument, BodyKind::rigid}) {
        const double speed = kind == BodyKind::instrument ? 0.125 : 0.0;  // m/s, of the face
        PairSample s = vertex_of_b_in_a(kind, BodyKind::tissue);
        s.frame.previous.col(3) = Vector3(0.003, 0.005, 0.0005);
        s.frame.velocity.col(3) = Vector3(1.0, 0.0, -1.0);
        s.frame.velocity.col(0) = Vector3(0.0, 0.0, speed);
        s.respond("thesis");
        ASSERT_EQ(s.output.position_corrections.size(), 1U);
        EXPECT_LT((s.output.position_corrections[0].position - Vector3(0.0035, 0.005, 0.0)).norm(), 1e-15);
        EXPECT_LT((s.output.position_corrections[0].velocity - Vector3(1.0, 0.0, speed)).norm(), 1e-15);
        EXPECT_EQ(s.output.no_hit, 0);
        EXPECT_TRUE(s.output.contacts.empty());
    }
    PairSample spike = vertex_of_a_in_b(BodyKind::rigid, BodyKind::tissue);
    spike.respond("thesis");
    EXPECT_EQ(spike.output.skipped_for(SkipReason::not_handled), 1);
}

TEST(ThesisTissue, StillTissueUnderAMovingToolHasNoHitAndKeepsItsPlace) {
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    s.frame.velocity.leftCols(3).colwise() = Vector3(0.0, 0.0, 0.5);
    s.respond("thesis");
    EXPECT_EQ(s.output.no_hit, 1);
    ASSERT_EQ(s.output.position_corrections.size(), 1U);
    EXPECT_EQ(s.output.position_corrections[0].position, Vector3(s.frame.position.col(3)));
    EXPECT_LT((s.output.position_corrections[0].velocity - Vector3(0, 0, 0.5)).norm(), 1e-15);
}

TEST(ThesisTissue, VertexHeldOnASpringLoadsTheToolWithStiffnessTimesTravel) {
    // The tool's face (normal +z) lifts a tissue vertex from z = -0.01 to 0 against a spring of 40 N/m below it.
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    s.frame.position.col(3) = Vector3(0.004, 0.005, -1e-9);
    s.frame.previous.col(3) = Vector3(0.004, 0.005, 1e-9);
    s.frame.position.col(4) = Vector3(0.004, 0.005, -0.05);
    s.materials.springs = {Spring{.i = 3, .j = 4, .rest = 0.04, .k = 40.0}};
    s.contacts.contacts.push_back(s.contacts.contacts[0]);  // a second pair of the same vertex does not count twice
    s.respond("thesis");
    EXPECT_NEAR(s.output.wrench[0].force.z(), -40.0 * 0.01, 1e-12);
    EXPECT_NEAR(s.shown_force(0).z(), -40.0 * 0.01, 1e-12);
    // A spring that pulls the vertex off the face loads nothing.
    s.materials.springs[0].rest = 0.06;
    s.respond("thesis");
    EXPECT_EQ(s.output.wrench[0].force, Vector3(Vector3::Zero()));
}

TEST(ThesisTissue, PairsThatMeanNothingAreCounted) {
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    const Contact contact = s.contacts.contacts[0];
    s.contacts.contacts.clear();
    for (const ContactCase kind :
         {ContactCase::touch, ContactCase::coplanar, ContactCase::degenerate, ContactCase::unset}) {
        s.contacts.contacts.push_back(contact);
        s.contacts.contacts.back().kind = kind;
    }
    s.respond("thesis");
    EXPECT_EQ(s.output.skipped_for(SkipReason::no_direction), 4);
    EXPECT_TRUE(s.output.contacts.empty() && s.output.position_corrections.empty());
}

TEST(ThesisTissue, PairsThatLackATriangleOrAVertexAreCounted) {
    for (const char* method : {"thesis:n_back=0", "thesis:profile=corrected,n_back=0"}) {
        for (const ContactCase kind : {ContactCase::a_enters_b, ContactCase::b_enters_a, ContactCase::edges_cross}) {
            for (Index Contact::*const lacking : {&Contact::a, &Contact::b, &Contact::vertex_a, &Contact::vertex_b}) {
                PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
                s.contacts.contacts[0].kind = kind;
                s.contacts.contacts[0].*lacking = -1;
                s.respond(method);
                EXPECT_EQ(s.output.skipped_for(SkipReason::no_direction), 1) << method << ' ' << static_cast<int>(kind);
                EXPECT_TRUE(s.output.contacts.empty() && s.output.position_corrections.empty()) << method;
            }
        }
    }
}

TEST(ThesisTissue, ImpulseReactionIsTheMomentumThatTheFaceGivesTheVertexTurnedRound) {
    // The face (normal +z) moves up at 0.1 m/s, the vertex of 1 g down at 0.3 m/s and sideways: 3.8 gives it 0.4 m/s
    // along z within the tick of 1 ms, which takes 0.4 N; the face is pushed down by as much, at the vertex.
    PairSample s = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    for (Index v = 0; v < 3; ++v) s.frame.velocity.col(v) = Vector3(0.0, 0.0, 0.1);
    s.frame.velocity.col(3) = Vector3(0.2, 0.0, -0.3);
    s.frame.previous = s.frame.position - 1e-3 * s.frame.velocity;
    s.respond("thesis:profile=corrected,n_back=0");
    ASSERT_EQ(s.output.position_corrections.size(), 1U);
    EXPECT_LT((s.output.position_corrections[0].velocity - Vector3(0.2, 0.0, 0.1)).norm(), 1e-12);
    EXPECT_LT((s.shown_force(0) - Vector3(0.0, 0.0, -0.4)).norm(), 1e-12);
}

TEST(ThesisReduction, EveryVertexBelowAFaceCountsInTheCorrectionAndTheDeepestAloneInTheEquations) {
    const auto contacts_of = [](PairSample& s, const char* method) {
        s.respond(method);
        std::vector<ContactForceLaw> contacts = s.output.contacts;
        std::sort(contacts.begin(), contacts.end(),
                  [](const ContactForceLaw& a, const ContactForceLaw& b) { return a.gap < b.gap; });
        return contacts;
    };
    // The tool's corners are 1.5 and 0.5 mm below the face, over (2, 3) and (3, 2) tenths of it; the third one is below
    // its plane, too, but beside it.
    PairSample tool = vertex_of_a_in_b(BodyKind::instrument, BodyKind::tissue);
    tool.frame.position.col(1) = Vector3(0.003, 0.002, -0.0005);
    tool.frame.position.col(2) = Vector3(0.02, 0.02, -0.001);
    tool.frame.previous = tool.frame.position;
    EXPECT_EQ(contacts_of(tool, "thesis:k=100,n_back=0").size(), 1U);
    const std::vector<ContactForceLaw> both = contacts_of(tool, "thesis:profile=corrected,k=100,n_back=0");
    ASSERT_EQ(both.size(), 2U);
    const std::array<Vector3, 2> weights{Vector3(0.5, 0.2, 0.3), Vector3(0.5, 0.3, 0.2)};
    for (std::size_t c = 0; c < 2; ++c) {
        EXPECT_NEAR(both[c].gap, c == 0 ? -0.0015 : -0.0005, 1e-12);
        EXPECT_LT((both[c].normal + Vector3::UnitZ()).norm(), 1e-12);
        for (Index i = 0; i < 3; ++i) {
            EXPECT_EQ(both[c].vertices[at(i)], 3 + i);
            EXPECT_NEAR(both[c].weights[at(i)], weights[c][i], 1e-12) << c;
        }
        EXPECT_EQ(both[c].reaction_body, 0);
    }
    // Tissue vertices that stand still 0.5 and 0.2 mm below the tool's face are put on it, straight up.
    PairSample tissue = vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue);
    tissue.frame.position.col(4) = Vector3(0.006, 0.003, -0.0002);
    tissue.frame.previous = tissue.frame.position;
    tissue.respond("thesis:n_back=0");
    ASSERT_EQ(tissue.output.position_corrections.size(), 1U);
    EXPECT_EQ(tissue.output.position_corrections[0].vertex, 3);
    tissue.respond("thesis:profile=corrected,n_back=0");
    ASSERT_EQ(tissue.output.position_corrections.size(), 2U);
    for (const PositionCorrection& position_correction : tissue.output.position_corrections) {
        Vector3 on_the_face = tissue.frame.position.col(position_correction.vertex);
        on_the_face.z() = 0.0;
        EXPECT_LT((position_correction.position - on_the_face).norm(), 1e-12) << position_correction.vertex;
    }
    EXPECT_NE(tissue.output.position_corrections[0].vertex, tissue.output.position_corrections[1].vertex);
}

}  // namespace
}  // namespace trocar
