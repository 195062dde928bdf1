// Stiffness at the tip, against a spring of known stiffness.
#include "measure/tip_stiffness.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/scene_samples.hpp"

namespace trocar {
namespace {

constexpr double spring = 700.0;  // N/m
constexpr double speed = 0.005;   // m/s: 5 µm per tick

/// The scene with a tool that moves down at `speed` for `moving` s, then rests.
Scene pressed(double moving) {
    Scene scene = test::scene_from_text(test::poke_text());
    MotionKey start = scene.bodies.at(0).motion.value().keys.front();
    MotionKey end = start;
    end.time = moving;
    end.translation.z() -= speed * moving;
    scene.bodies.at(0).motion->keys = {start, end};
    return scene;
}

/// Ticks of 1 ms in which a spring holds the tool.
std::vector<StepRow> spring_rows(std::size_t count) {
    std::vector<StepRow> rows(count);
    for (std::size_t i = 0; i < count; ++i) {
        rows[i].time = 0.001 * static_cast<double>(i);
        rows[i].tip_force = Vector3(0.0, 0.0, 1.0 + spring * speed * rows[i].time);
    }
    return rows;
}

TEST(TipStiffness, IsThatOfASpring) {
    const TipStiffness tip = tip_stiffness(pressed(100.0), spring_rows(10'001));
    EXPECT_NEAR(tip.stiffness_p999_n_per_m, spring, 1e-6);
    EXPECT_NEAR(tip.force_step_p999_n, spring * speed * 0.001, 1e-9);
    const TipStiffness few = tip_stiffness(pressed(100.0), spring_rows(10'000));
    EXPECT_TRUE(std::isnan(few.stiffness_p999_n_per_m)) << "9999 steps";
    EXPECT_TRUE(std::isnan(few.force_step_p999_n));
}

TEST(TipStiffness, LeavesOutTicksAtRestAndTicksWithoutContact) {
    std::vector<StepRow> rows = spring_rows(30'001);
    // Moves for 10 s, then rests while the force jumps.
    for (std::size_t i = 10'001; i < 20'001; ++i) rows[i].tip_force = Vector3(0.0, i % 2 == 0 ? 5.0 : 0.0, 9.0);
    for (std::size_t i = 20'001; i < 30'001; ++i) rows[i].tip_force.setZero();
    const TipStiffness tip = tip_stiffness(pressed(10.0), rows);
    EXPECT_NEAR(tip.stiffness_p999_n_per_m, spring, 1e-6);
    EXPECT_NEAR(tip.force_step_p999_n, 5.0, 1e-9);
}

TEST(TipStiffness, IsNotKnownWhereAnOperatorHoldsTheTool) {
    Scene scene = pressed(100.0);
    scene.bodies.at(0).motion->drive = Drive::simulated_operator;
    const TipStiffness tip = tip_stiffness(scene, spring_rows(10'001));
    EXPECT_TRUE(std::isnan(tip.stiffness_p999_n_per_m));
    EXPECT_FALSE(std::isnan(tip.force_step_p999_n));
}

TEST(TipStiffness, NeedsHalfOfItselfPerTickAsDamping) { EXPECT_DOUBLE_EQ(passivity_damping(2000.0, 0.001), 1.0); }

}  // namespace
}  // namespace trocar
