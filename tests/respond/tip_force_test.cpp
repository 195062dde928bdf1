// From the load on a tool to what a device shows (METHODS §8): trocar, limiters, and what each switch changes.
#include "contact/tip_force.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "method/device.hpp"
#include "method/registry.hpp"
#include "simulate/simulation.hpp"
#include "support/random_vectors.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

TEST(Fulcrum, TipForceAndRollTorqueTogetherHaveThePowerOfTheWrench) {
    // I22 with roll: what the 3-DOF device loses is the roll torque times the roll rate, nothing else.
    std::mt19937_64 generator(11);
    std::normal_distribution<double> normal(0.0, 1.0);
    const auto next = [&] { return test::random_vector(normal, generator); };
    for (int i = 0; i < 2000; ++i) {
        const Vector3 pivot = next();
        const Vector3 tip = pivot + 0.15 * next().normalized();
        const Vector3 shaft = (tip - pivot).normalized();
        const Vector3 turn = next();
        const double insertion = next().x();
        const Wrench load{.force = next(), .moment = next()};  // about the origin
        const Wrench about_pivot = moved_to(load, pivot);
        const double power = load.force.dot(insertion * shaft - turn.cross(pivot)) + load.moment.dot(turn);
        const Vector3 tip_velocity = turn.cross(tip - pivot) + insertion * shaft;
        const double shown = fulcrum_tip_force(about_pivot, pivot, tip).dot(tip_velocity);
        const double lost = roll_torque(about_pivot, pivot, tip) * turn.dot(shaft);
        EXPECT_NEAR(shown + lost, power, 1e-11 * (1.0 + std::abs(power)));
    }
}

TEST(Fulcrum, LeverIsNeverTakenShorterThanThirtyMillimetres) {
    // A side force of 2 N at 60 mm: 0.12 N m, shown at a tip 50 mm (and 10 mm, clamped to 30) from the pivot.
    const Wrench about_pivot{.force = Vector3(2.0, 0.0, 0.7), .moment = Vector3(0.0, 0.06 * 2.0, 0.0)};
    const auto shown = [&](double length) {
        return fulcrum_tip_force(about_pivot, Vector3::Zero(), Vector3(0.0, 0.0, length));
    };
    EXPECT_LT((shown(0.05) - Vector3(0.12 / 0.05, 0.0, 0.7)).norm(), 1e-15);
    EXPECT_LT((shown(0.01) - Vector3(0.12 / 0.03, 0.0, 0.7)).norm(), 1e-15);
    EXPECT_EQ(shown(0.0), about_pivot.force);
}

TEST(TipDisplay, OffByDefaultButForTheDevicesLargestForce) {
    TipDisplay display;
    const TipSettings off;
    EXPECT_EQ(display.show(Vector3(1.0, -2.0, 3.0), off, 1e-3), Vector3(1.0, -2.0, 3.0));
    EXPECT_FALSE(display.saturated());
    const Vector3 cut = display.show(Vector3(0.0, 30.0, -40.0), off, 1e-3);
    EXPECT_LT((cut - Vector3(0.0, 5.1, -6.8)).norm(), 1e-12);  // 8.5 N in the same direction
    EXPECT_TRUE(display.saturated());
    EXPECT_EQ(display.show(Vector3(0.0, 30.0, -40.0), {.saturation = 0.0}, 1e-3), Vector3(0.0, 30.0, -40.0));
}

TEST(TipDisplay, RateLimitFilterAndRampFollowTheirClosedFormsAtEveryTick) {
    for (const double dt : {1e-3, 2.5e-4, 3e-3}) {
        SCOPED_TRACE(dt);
        for (const double newtons_per_second : {500.0, 0.5}) {
            TipDisplay rate;
            for (int tick = 1; tick <= 20; ++tick) {
                const Vector3 shown = rate.show(Vector3(2.0, 0.0, 0.0), {.rate_limit = newtons_per_second}, dt);
                EXPECT_NEAR(shown.x(), std::min(2.0, newtons_per_second * dt * tick), 1e-12);
            }
        }
        for (const double hertz : {150.0, 0.5}) {
            TipDisplay filter;
            for (int tick = 1; tick <= 20; ++tick) {
                const Vector3 shown = filter.show(Vector3(0.0, 2.0, 0.0), {.filter = hertz}, dt);
                EXPECT_NEAR(shown.y(), 2.0 * (1.0 - std::exp(-2.0 * std::numbers::pi * hertz * dt * tick)), 1e-12);
            }
        }
        TipDisplay ramp;
        const TipSettings five_ms{.ramp = 0.005};
        const auto part = [dt](int tick) { return std::min(1.0, tick * dt / 0.005); };
        for (int tick = 1; tick <= 25; ++tick) {
            EXPECT_NEAR(ramp.show(Vector3(0.0, 0.0, 0.3), five_ms, dt).z(), 0.3 * part(tick), 1e-12);
        }
        EXPECT_EQ(ramp.show(Vector3::Zero(), five_ms, dt), Vector3(Vector3::Zero()));
        EXPECT_NEAR(ramp.show(Vector3(0.0, 0.0, 0.3), five_ms, dt).z(), 0.3 * part(1), 1e-12)
            << "a new contact, a new ramp";
    }
}

/// The point of a needle, held by an operator off the trocar's axis, 1 mm below the top of a rigid block.
std::string needle_text() {
    return R"({"format":"trocar-scene-2","name":"needle","unit":"m","dt":0.001,"ticks":10,"seed":1,"bodies":[
      {"name":"block","kind":"rigid","closed":true,"parts":[{"shape":"box","size":[0.1,0.1,0.02],"edge":0.01}],
       "pose":[0,0,-0.01,0,0,0]},
      {"name":"tool","kind":"instrument","closed":true,"trocar":[0.02,0,0.1],"tip":[0,0,0.01],
       "parts":[{"shape":"needle","radius":0.002,"length":0.05,"tip_length":0.02,"edge":0.004}],
       "motion":{"drive":"prescribed","keys":[{"time":0,"pose":[0.011,0.017,-0.001,0,0,0]}]}}],
      "contact":[{"bodies":["tool","block"],"k":4000,"mu":0}]})";
}

StepRow first_row(const std::string& method, const char* device = "") {
    const Scene scene = test::scene_from_text(needle_text());
    Simulation simulation(scene, make_detector("brute_force"), make_response(method),
                          registry().contact_generator("intersection"), {.device = read_device(device)});
    return simulation.step();
}

TEST(TipRows, WrenchAndTipForceOfAContactAtAKnownPoint) {
    // `corrected` reduces to one contact at the point: 4000 N/m × 1 mm = 4 N up, 10 mm from the tip along z, so no
    // moment about it; about the trocar (0.02, 0, 0.1) the arm is (-0.009, 0.017, -0.101).
    const StepRow row = first_row("thesis:profile=corrected");
    EXPECT_LT((row.tool_force - Vector3(0.0, 0.0, 4.0)).norm(), 1e-12);
    EXPECT_LT(row.tool_moment.norm(), 1e-12);
    const Vector3 lever = Vector3(0.011, 0.017, 0.009) - Vector3(0.02, 0.0, 0.1);
    const Vector3 torque = Vector3(-0.009, 0.017, -0.101).cross(Vector3(0.0, 0.0, 4.0));
    const Vector3 shaft = lever.normalized();
    EXPECT_LT((row.tip_force - (torque.cross(lever) / lever.squaredNorm() + 4.0 * shaft.z() * shaft)).norm(), 1e-12);
    EXPECT_NEAR(row.roll_torque, torque.dot(shaft), 1e-12);
    EXPECT_EQ(row.device_force, row.tip_force);
    EXPECT_FALSE(row.saturated);
}

TEST(TipRows, EachSettingOfTheDeviceChangesWhatItSays) {
    const std::string method = "thesis:profile=corrected";
    const StepRow plain = first_row(method);
    const StepRow sum = first_row(method, "tip=sum");
    EXPECT_EQ(sum.tip_force, sum.tool_force);
    EXPECT_NE(plain.tip_force, plain.tool_force);
    const StepRow soft = first_row(method, "tip=sum,saturation=1.5");
    EXPECT_EQ(soft.tip_force, sum.tip_force) << "force health is measured before any limiter";
    EXPECT_NEAR(soft.device_force.norm(), 1.5, 1e-12);
    EXPECT_TRUE(soft.saturated);
    EXPECT_NEAR(first_row(method, "tip=sum,rate=500").device_force.z(), 0.5, 1e-12);
    EXPECT_NEAR(first_row("penalty", "tip=sum,ramp=0.005").device_force.z(), sum.tip_force.z() / 5.0, 1e-12);
    EXPECT_NEAR(first_row("penalty", "tip=sum,filter=150").device_force.z(),
                sum.tip_force.z() * (1.0 - std::exp(-2.0 * std::numbers::pi * 0.15)), 1e-12);
}

TEST(TipRows, TheRuleIsTheDevicesWhateverTheResponse) {
    // `faithful` answers once per triangle pair: as many times the force as triangles meet at the needle's point.
    const StepRow faithful = first_row("thesis", "tip=sum");
    EXPECT_EQ(faithful.tip_force, faithful.tool_force);
    EXPECT_NEAR(faithful.tool_force.z(), 4.0 * static_cast<double>(faithful.pairs), 1e-9);
    EXPECT_GT(faithful.pairs, 2);
    const Vector3 pivot(0.02, 0.0, 0.1);
    const Vector3 point(0.011, 0.017, -0.001);
    const Vector3 tip = point + Vector3(0.0, 0.0, 0.01);
    for (const char* method : {"thesis", "penalty", "unilateral"}) {
        const StepRow row = first_row(method);
        ASSERT_GT(row.tool_force.z(), 1.0) << method;
        const Wrench about_tip{.force = row.tool_force, .moment = row.tool_moment};
        const Wrench about_pivot = moved_to(about_tip, pivot - tip);
        EXPECT_LT((row.tip_force - fulcrum_tip_force(about_pivot, pivot, tip)).norm(), 1e-12) << method;
    }
}

}  // namespace
}  // namespace trocar
