#include "simulate/judge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "measure/surface_distance.hpp"
#include "method/registry.hpp"
#include "simulate/simulation.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

/// The poke scene with the tool at its lowest and the sheet at rest: what is true there is known in closed form.
class JudgeOnAPoke : public testing::Test {
protected:
    JudgeOnAPoke()
        : scene_(test::scene_from_text(test::poke_text())),
          simulation_(scene_, make_detector("brute_force"), nullptr, registry().contact_generator("intersection")) {
        for (int tick = 0; tick <= 45; ++tick) simulation_.step();
        for (const BodyRange& body : scene_.topology.bodies) {
            if (body.kind == BodyKind::instrument) tool_ = body.vertices;
        }
        for (Index v = tool_.first; v < tool_.end(); ++v) {
            lowest_ = std::min(lowest_, simulation_.seen().position(2, v));
        }
    }

    /// Contacts of tool vertices that enter the sheet: it is the plane z = 0, so their depth is the true one.
    [[nodiscard]] ContactSet plain_contacts() const {
        ContactSet contacts;
        contacts.pairs = simulation_.contacts().pairs;
        for (const Contact& contact : simulation_.contacts().contacts) {
            if (contact.kind == ContactCase::a_enters_b) contacts.contacts.push_back(contact);
        }
        EXPECT_FALSE(contacts.contacts.empty());
        return contacts;
    }

    StepRow judged(const ContactSet& contacts) {
        Judge judge(scene_.topology, scene_.first, std::vector<std::uint8_t>{1});
        StepRow row;
        judge.judge_detection(simulation_.seen(), contacts, row);
        judge.judge_outcome(simulation_.seen(), row);
        return row;
    }

    Scene scene_;
    Simulation simulation_;
    Range tool_;
    double lowest_ = 0.0;
};

TEST_F(JudgeOnAPoke, TrueAnswerHasNoErrors) {
    const StepRow row = judged(plain_contacts());
    EXPECT_GT(row.true_pairs, 3);
    EXPECT_EQ(row.false_negatives, 0);
    EXPECT_EQ(row.false_positives, 0);
    // The sheet is the plane z = 0: the deepest sample is the tool's lowest vertex.
    EXPECT_LT(lowest_, -0.0019);
    EXPECT_NEAR(row.residual_penetration, -lowest_, 1e-15);
    EXPECT_NEAR(row.depth_error, 0.0, 1e-12);
    EXPECT_TRUE(std::isnan(row.native_depth_error));
    EXPECT_GT(row.wrong_side, 0);
    EXPECT_LT(row.residual_penetration_mean, row.residual_penetration);
    EXPECT_TRUE(std::isnan(judged({}).depth_error)) << "no contact claims a depth";
}

TEST_F(JudgeOnAPoke, WrongDepthIsOffByWhatWasAdded) {
    ContactSet contacts = plain_contacts();
    const auto entering = contacts.contacts.begin();
    entering->depth += 0.001;
    EXPECT_NEAR(judged(contacts).depth_error, 0.001, 1e-12);
    // A library that names the triangles and a depth is held against the deepest corner of the two.
    Contact native;
    native.a = entering->a;
    native.b = entering->b;
    native.depth = 0.0;
    contacts.native = {native};
    // Corners of the sheet may be inside the tool as well: there the distance to every face of the tool decides.
    double deepest = 0.0;
    const Matrix3X& position = simulation_.seen().position;
    for (int corner = 0; corner < 3; ++corner) {
        deepest = std::max(deepest, -position(2, scene_.topology.triangles(corner, native.a)));
        const Vector3 p = position.col(scene_.topology.triangles(corner, native.b));
        const double from_centre = (p - Vector3(0.001, 0.0007, 0.006)).norm();
        EXPECT_TRUE(from_centre < 0.0075 || from_centre > 0.008) << "too near to the faceted ball to report by formula";
        if (from_centre > 0.008) continue;
        double nearest = 1.0;
        for (Index t = 0; t < scene_.topology.bodies[0].triangles.end(); ++t) {
            const auto v = scene_.topology.triangles.col(t);
            nearest = std::min(nearest, std::sqrt(squared_distance_to_triangle(position.col(v[0]), position.col(v[1]),
                                                                               position.col(v[2]), p)));
        }
        deepest = std::max(deepest, nearest);
    }
    EXPECT_NEAR(judged(contacts).native_depth_error, deepest, 1e-12);
}

TEST_F(JudgeOnAPoke, GapThatTheScriptDidNotOpenIsOvershoot) {
    Judge judge(scene_.topology, scene_.first, std::vector<std::uint8_t>{1});
    const auto outcome = [&](const Vector3& shift, std::int64_t tick, double path) {
        Frame frame = simulation_.seen();
        frame.position.middleCols(tool_.first, tool_.count).colwise() += shift;
        StepRow row;
        row.tick = tick;
        judge.judge_outcome(frame, row, path);
        return row;
    };
    EXPECT_TRUE(std::isnan(outcome(Vector3(0, 0, 0.01), 0, 0.0).overshoot)) << "nothing has been inside yet";
    EXPECT_TRUE(std::isnan(outcome(Vector3::Zero(), 1, 0.0).overshoot)) << "inside";
    // The sheet is flat: lifted by 3 mm the tool is 3 mm + lowest above it, of which the script did 0.4 mm.
    const double gap = 0.003 + lowest_;
    EXPECT_NEAR(outcome(Vector3(0, 0, 0.003), 2, 0.0004).overshoot, gap - 0.0004, 1e-12);
    EXPECT_EQ(outcome(Vector3(0, 0, 0.003), 3, 0.0030).overshoot, 0.0) << "the script went further than that";
    EXPECT_TRUE(std::isnan(outcome(Vector3(0, 0, 0.003), 2 + Judge::overshoot_window, 0.0).overshoot)) << "too late";
}

TEST_F(JudgeOnAPoke, BodiesThatStillMeetLeaveNoGap) {
    Judge judge(scene_.topology, scene_.first, std::vector<std::uint8_t>{1});
    Frame frame = simulation_.seen();
    StepRow inside;
    inside.tick = 1;
    judge.judge_outcome(frame, inside, 0.0);
    ASSERT_GT(inside.wrong_side, 0);
    // Lifted by 3 mm no sample is inside; pairs that the tick has seen say that the bodies still met.
    frame.position.middleCols(tool_.first, tool_.count).row(2).array() += 0.003;
    for (const std::int64_t pairs : {1, 0}) {
        StepRow row;
        row.tick = 2;
        row.pairs = pairs;
        judge.judge_outcome(frame, row, 0.0);
        ASSERT_EQ(row.wrong_side, 0);
        EXPECT_EQ(std::isnan(row.overshoot), pairs > 0);
    }
}

TEST(JudgeOnBlocks, OverlapIsTheSumOverAllPairsThatYield) {
    // Two blocks of tissue sink into one of bone that is 40 mm wide and high, by 1 mm and by 3 mm over 10 mm × 10 mm;
    // another piece of bone overlaps it too, but neither of these gives way. Both do at the largest depth: 3 mm.
    const Scene scene = test::scene_from_text(R"({"format":"trocar-scene-2","name":"blocks","unit":"m","dt":0.001,
      "ticks":1,"seed":1,"bodies":[
      {"name":"bone","kind":"rigid","closed":true,"parts":[{"shape":"box","size":[0.04,0.04,0.04],"edge":0.01}],
       "pose":[0,0,-0.02,0,0,0]},
      {"name":"left","kind":"tissue","closed":true,"parts":[{"shape":"box","size":[0.01,0.01,0.01],"edge":0.005,
       "pose":[-0.01,0.0003,0.004,0,0,0]}]},
      {"name":"right","kind":"tissue","closed":true,"parts":[{"shape":"box","size":[0.01,0.01,0.01],"edge":0.005,
       "pose":[0.01,0.0003,0.002,0,0,0]}]},
      {"name":"tool","kind":"instrument","closed":true,"parts":[{"shape":"box","size":[0.01,0.01,0.01],"edge":0.005}],
       "motion":{"drive":"prescribed","keys":[{"time":0,"pose":[0.0004,0.013,0.0,0,0,0]}]}}]})");
    std::vector<std::uint8_t> yields;
    for (const auto& [a, b] : scene.topology.body_pairs) {
        const auto tissue = [&](Index body) {
            return scene.topology.bodies[static_cast<std::size_t>(body)].kind == BodyKind::tissue;
        };
        yields.push_back(tissue(a) != tissue(b) ? 1 : 0);
    }
    Judge judge(scene.topology, scene.first, yields);
    StepRow row;
    judge.judge_outcome(scene.first, row);
    // Volume is sampled: each alone would be off by a quarter and more.
    EXPECT_NEAR(row.overlap_volume, 0.01 * 0.01 * (0.001 + 0.003), 0.02 * 4e-7);
    EXPECT_NEAR(row.min_translation, 0.003, 1e-9);
}

TEST_F(JudgeOnAPoke, StrainAboveTheLimitIsThatOfTheLongestEdge) {
    Judge judge(scene_.topology, scene_.first, std::vector<std::uint8_t>{1}, &scene_.materials);
    Frame frame = scene_.first;
    StepRow row;
    judge.judge_outcome(frame, row);
    EXPECT_EQ(row.strain_over, 0.0);
    EXPECT_TRUE(std::isnan(row.overlap_volume)) << "a sheet has no volume";
    // The whole sheet pulled to 2.75 times its size: every edge is strained by 1.75.
    const Range sheet = scene_.topology.bodies[1].vertices;
    frame.position.middleCols(sheet.first, sheet.count) *= 2.75;
    judge.judge_outcome(frame, row);
    EXPECT_NEAR(row.strain_over, 1.75 - scene_.materials.strain_limit, 1e-12);
}

TEST_F(JudgeOnAPoke, NothingThatYieldsMeansNothingLeftOver) {
    Judge judge(scene_.topology, scene_.first, std::vector<std::uint8_t>{0});
    StepRow row;
    judge.judge_outcome(simulation_.seen(), row);
    EXPECT_TRUE(std::isnan(row.residual_penetration));
    EXPECT_EQ(row.wrong_side, -1);
}

}  // namespace
}  // namespace trocar
