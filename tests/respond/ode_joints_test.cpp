// ODE's contact joints against closed forms: what a spring and damper at step h must give, rest on a spring, impact.
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "support/methods.hpp"
#include "support/response_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

using test::edges_crossing;
using test::PairSample;
using test::vertex_of_a_in_b;
using test::vertex_of_b_in_a;

class OdeJoints : public ::testing::Test {
protected:
    void SetUp() override {
        if (!test::is_registered(registry().responses(), "ode_joints")) GTEST_SKIP() << "built without ODE";
    }
};

PairSample one_substep(PairSample sample) {
    sample.materials.substeps = 1;
    return sample;
}

/// Force of an implicit spring and damper on a mass at step h: (k d - (h k + mu) v) / (1 + h (h k + mu) / m), not below
/// 0; v is the separating speed and d the depth at the start of the tick: what a script moves it by has yet to come.
double implicit_force(double k, double mu, double depth, double speed, double mass, double h = 1e-3) {
    const double c = h * k + mu;
    return std::max(0.0, (k * depth - c * speed) / (1.0 + h * c / mass));
}

TEST_F(OdeJoints, AJointIsTheImplicitSpringAndDamper) {
    for (const char* stepper : {"world", "quick"}) {
        for (const double speed : {-0.3, 0.0, 0.1, 2.0}) {
            PairSample s = one_substep(vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue));
            s.frame.velocity.col(3) = Vector3(0.7, -0.2, speed);
            s.step(std::string("ode_joints:k=700,mu=3,stepper=") + stepper);
            const double expected = implicit_force(700.0, 3.0, 0.0005, speed, 1e-3);
            const Vector3 force = s.force_on(3);
            EXPECT_LT((force - expected * Vector3::UnitZ()).norm(), 1e-9 * (1.0 + expected)) << stepper << speed;
            EXPECT_LT((s.load[0].force + force).norm(), 1e-9 * (1.0 + expected));
        }
    }
}

TEST_F(OdeJoints, TheMovingToolCountsByItsSurfaceVelocity) {
    PairSample s = one_substep(vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue));
    for (int v = 0; v < 3; ++v) s.frame.velocity.col(v) = Vector3(0.0, 0.0, 0.05);
    s.frame.velocity.col(3) = Vector3(0.0, 0.0, 0.02);
    s.step("ode_joints:k=200,mu=1");
    EXPECT_NEAR(s.force_on(3).z(), implicit_force(200.0, 1.0, 0.0005 - 0.05e-3, -0.03, 1e-3), 1e-10);
}

TEST_F(OdeJoints, AGapThatClosesWithinTheStepHasTheLawOfAllForceLaws) {
    PairSample s = one_substep(vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue));
    s.frame.position(2, 3) = 0.0001;
    s.contacts.contacts[0].depth = -0.0001;
    s.contacts.contacts[0].kind = ContactCase::point_face;
    s.contacts.contacts[0].point = s.frame.position.col(3);
    for (const double speed : {-0.05, -0.3}) {
        PairSample joint = s;
        joint.frame.velocity(2, 3) = speed;
        PairSample law = joint;
        joint.step("ode_joints:k=700,mu=3");
        law.step("penalty:k=700,mu=3");
        EXPECT_NEAR(joint.force_on(3).z(), law.force_on(3).z(), 1e-9) << speed;
        EXPECT_EQ(joint.force_on(3).z() > 1e-9, speed < -0.1) << speed;
    }
}

/// Tissue vertex 3 lies `depth` under the tool's face and is pulled down by a vertical spring to the pinned vertex 4.
PairSample pressed_vertex(double spring_k, double stretch, double depth) {
    PairSample s = one_substep(vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue));
    s.frame.position.col(3) = Vector3(0.004, 0.005, -depth);
    s.frame.position.col(4) = Vector3(0.004, 0.005, -depth - 0.02);
    s.frame.previous = s.frame.position;
    s.materials.pinned = {0, 0, 0, 0, 1, 1};
    s.materials.springs = {{.i = 3, .j = 4, .rest = 0.02 - stretch, .k = spring_k, .damping = 0.05}};
    s.materials.substeps = 4;
    s.contacts.contacts[0].depth = depth;
    return s;
}

TEST_F(OdeJoints, AVertexAtRestOnASpringGivesItsSpringForce) {
    // k_s x = k d holds at once and stays: 130 N/m stretched by 0.8 mm against 208 N/m at 0.5 mm.
    PairSample s = pressed_vertex(130.0, 0.0008, 0.0005);
    s.step("ode_joints:k=208,mu=2");
    EXPECT_NEAR(s.contact_forces[0].force.z(), 130.0 * 0.0008, 1e-10);
    EXPECT_LT(s.force_on(3).norm(), 1e-10);
}

TEST_F(OdeJoints, APressedVertexComesToRestWhereSpringAndContactBalance) {
    for (const std::string setting : {"penalty", "library"}) {
        PairSample s = pressed_vertex(130.0, 0.003, 0.0021);
        const auto response = make_response("ode_joints:k=500,mu=1,setting=" + setting);
        response->prepare(s.topology, s.materials);
        MassSpring tissue(s.topology, s.materials);
        std::vector<Wrench> reaction(2);
        const Vector3 anchor = s.frame.position.col(4);
        double force = 0.0;
        for (int tick = 0; tick < 3000; ++tick) {
            const double depth = -s.frame.position(2, 3);
            s.contacts.contacts[0].depth = depth;
            s.contacts.contacts[0].point = s.frame.position.col(3);
            ContactSet given = s.contacts;
            if (depth < 0.0) given.contacts.clear();
            response->respond(s.frame, 1e-3, given, {}, s.output);
            ASSERT_TRUE(tissue.advance(s.output, 1e-3, s.frame, reaction).ok());
            force = tissue.contact_forces().empty() ? 0.0 : tissue.contact_forces()[0].force.z();
        }
        const double depth = -s.frame.position(2, 3);
        const double spring = 130.0 * ((s.frame.position.col(3) - anchor).norm() - 0.017);
        EXPECT_NEAR(force, spring, 1e-6) << setting;
        if (setting == "penalty") {
            // x + d = 5.1 mm, k_s x = k d.
            EXPECT_NEAR(depth, 130.0 * 0.0051 / 630.0, 1e-7);
        } else {
            EXPECT_NEAR(depth, 0.0, 1e-5);
        }
    }
}

TEST_F(OdeJoints, TwoMassesThatMeetGoOnTogether) {
    // Hard and without restitution: m1 v1 / (m1 + m2) along the normal, the rest as it was.
    PairSample s = vertex_of_b_in_a(BodyKind::tissue, BodyKind::tissue);
    s.materials.mass = {2e-3, 1e-3, 1e-3, 3e-3, 1e-3, 1e-3};
    s.frame.position.col(3) = Vector3(0.001, 0.001, -0.0005);  // nearest to corner 0
    s.contacts.contacts[0].depth = 0.0;
    s.frame.velocity.col(3) = Vector3(0.5, 0.0, -0.4);
    s.step("ode_joints:setting=library");
    EXPECT_LT((s.frame.velocity.col(3) - Vector3(0.5, 0.0, -0.24)).norm(), 1e-7);
    EXPECT_LT((s.frame.velocity.col(0) - Vector3(0.0, 0.0, -0.24)).norm(), 1e-7);
    EXPECT_LT((s.force_on(3) + s.force_on(0)).norm(), 1e-9);
}

TEST_F(OdeJoints, DuplicatesDoNotMultiplyTheStiffness) {
    PairSample s = one_substep(vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue));
    s.materials.mass.assign(6, 1e3);  // heavy: the force is k d
    PairSample once = s;
    once.step("ode_joints:k=300,mu=2");
    EXPECT_NEAR(once.force_on(3).z(), 0.15, 1e-6);
    s.contacts.contacts.assign(7, s.contacts.contacts[0]);
    PairSample reduced = s;
    reduced.step("ode_joints:k=300,mu=2");
    EXPECT_NEAR(reduced.force_on(3).z(), 0.15, 1e-6);
    s.step("ode_joints:k=300,mu=2,reduction=pair");
    // Seven times the damper, too, which lets even so heavy a vertex go.
    EXPECT_NEAR(s.force_on(3).z(), implicit_force(7 * 300.0, 7 * 2.0, 0.0005, 0.0, 1e3), 1e-9);
}

TEST_F(OdeJoints, APointInAFaceIsThreeJointsWithTheSameResultantOrOneVertex) {
    PairSample s = vertex_of_a_in_b(BodyKind::instrument, BodyKind::tissue);
    std::fill(s.materials.mass.begin() + 3, s.materials.mass.end(), 1e3);
    PairSample one = s;
    s.step("ode_joints:k=100,mu=1");
    // Weights 0.5, 0.2, 0.3 at (2, 3) mm of a 10 mm right angle; depth 1.5 mm.
    const double share[] = {0.5, 0.2, 0.3};
    Vector3 moment = Vector3::Zero();
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(s.force_on(3 + i).z(), -0.15 * share[i], 1e-6);
        moment += s.before.position.col(3 + i).cross(s.force_on(3 + i));
    }
    EXPECT_LT((moment - Vector3(0.002, 0.003, 0).cross(Vector3(0, 0, -0.15))).norm(), 1e-8);
    EXPECT_NEAR(s.load[0].force.z(), 0.15, 1e-6);
    one.step("ode_joints:setting=library");
    EXPECT_LT(one.force_on(3).z(), 0.0);
    EXPECT_EQ(one.force_on(4).norm(), 0.0);
}

TEST_F(OdeJoints, TwoTissuesKeepTheirMomentumAlsoWhereEdgesCross) {
    PairSample s = edges_crossing(BodyKind::tissue, BodyKind::tissue);
    s.frame.velocity.col(0) = Vector3(0.3, 0.1, -0.2);
    s.step("ode_joints:k=100,mu=1");
    Vector3 sum = Vector3::Zero();
    double largest = 0.0;
    for (Index v = 0; v < 6; ++v) {
        sum += s.force_on(v);
        largest = std::max(largest, s.force_on(v).norm());
    }
    EXPECT_GT(largest, 0.1);
    EXPECT_LT(sum.norm(), 1e-10 * largest + 1e-10);
}

TEST_F(OdeJoints, InstrumentAgainstBoneAndInstrument) {
    for (const BodyKind other : {BodyKind::rigid, BodyKind::instrument}) {
        PairSample s = one_substep(vertex_of_a_in_b(BodyKind::instrument, other));
        s.frame.velocity.leftCols(3).colwise() = Vector3(0.1, 0.0, -0.02);
        s.respond("ode_joints:k=900,mu=3,device_mass=0.2");
        const double mass = other == BodyKind::rigid ? 0.2 : 0.1;
        const double expected = implicit_force(900.0, 3.0, 0.0015 - 0.02e-3, -0.02, mass);
        EXPECT_LT((s.output.wrench[0].force - expected * Vector3::UnitZ()).norm(), 1e-9);
        EXPECT_NEAR(s.output.wrench[1].force.z(), other == BodyKind::rigid ? 0.0 : -expected, 1e-9);
    }
}

TEST_F(OdeJoints, APartThatTurnsCountsByItsOwnSurfaceSpeed) {
    // Corner 0 sinks while the rest of the body rises: the contact sees the corner.
    PairSample s = one_substep(vertex_of_a_in_b(BodyKind::instrument, BodyKind::rigid));
    s.frame.velocity.col(0) = Vector3(0.0, 0.0, -0.03);
    s.frame.velocity.col(1) = Vector3(0.0, 0.0, 0.09);
    s.respond("ode_joints:k=900,mu=3,device_mass=0.2");
    EXPECT_NEAR(s.output.wrench[0].force.z(), implicit_force(900.0, 3.0, 0.0015 - 0.03e-3, -0.03, 0.2), 1e-9);
}

TEST_F(OdeJoints, NoTickKnowsOfTheLast) {
    for (const char* method : {"ode_joints", "ode_joints:setting=library"}) {
        const PairSample first = vertex_of_b_in_a(BodyKind::tissue, BodyKind::tissue);
        const auto run = [&](int others) {
            PairSample s = first;
            const auto response = make_response(method);
            response->prepare(s.topology, s.materials);
            Frame moved = s.frame;
            for (int i = 0; i < others; ++i) {
                moved.velocity.col(i % 6) = Vector3(0.3 * i, 0.1, -0.2);
                ContactSet many = s.contacts;
                many.contacts.assign(static_cast<std::size_t>(i), s.contacts.contacts[0]);
                response->respond(moved, 1e-3, many, {}, s.output);
                std::vector<Wrench> other(2);
                Frame gone = moved;
                EXPECT_TRUE(MassSpring(s.topology, s.materials).advance(s.output, 1e-3, gone, other).ok());
            }
            response->respond(s.frame, 1e-3, s.contacts, {}, s.output);
            MassSpring tissue(s.topology, s.materials);
            std::vector<Wrench> reaction(2);
            EXPECT_TRUE(tissue.advance(s.output, 1e-3, s.frame, reaction).ok());
            return s.frame.velocity;
        };
        EXPECT_EQ(run(0), run(5)) << method;
        EXPECT_NE(run(0), first.frame.velocity);
    }
}

TEST_F(OdeJoints, ANodeThatCannotMoveIsLeftOutAndCounted) {
    PairSample s = one_substep(vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue));
    s.materials.pinned.assign(6, 1);
    s.respond("ode_joints");
    EXPECT_EQ(s.output.skipped_for(SkipReason::not_handled), 1);
    EXPECT_TRUE(s.output.contacts.empty());
}

TEST_F(OdeJoints, ASolutionThatIsNoNumberIsReportedAndDoesNotStay) {
    PairSample s = one_substep(vertex_of_b_in_a(BodyKind::instrument, BodyKind::tissue));
    const auto response = make_response("ode_joints");
    response->prepare(s.topology, s.materials);
    response->respond(s.frame, 1e-3, s.contacts, {}, s.output);
    const auto solve = [&](double speed) {
        PredictedStep step;
        step.begin(1e-3);
        step.add_column(speed * Vector3::UnitZ(), 1e3);
        step.add(
            {.normal = Vector3::UnitZ(), .depth = 5e-4, .count = 1, .column = {0}, .weight = {1.0}, .mobility = 1e3});
        s.output.solver->solve(step);
        return step.impulse(0).z();
    };
    EXPECT_THROW(solve(Contact::unset), std::runtime_error);
    EXPECT_GT(solve(0.0), 0.0);
}

TEST_F(OdeJoints, ReadsALibrarysOwnContacts) {
    PairSample s = vertex_of_a_in_b(BodyKind::instrument, BodyKind::tissue);
    s.contacts.contacts = {test::native_contact()};
    std::fill(s.materials.mass.begin() + 3, s.materials.mass.end(), 1e3);
    s.step("ode_joints:k=100");
    EXPECT_NEAR(s.load[0].force.z(), 0.2, 1e-6);
}

}  // namespace
}  // namespace trocar
