// Steppers against one another in whole closed loops: the force at the tool is the tissue's, not the stepper's. Each is
// held against `semi_implicit` in small sub-steps, which is another scheme by other code.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "scene/scene.hpp"
#include "support/scene_runs.hpp"

namespace trocar {
namespace {

/// Root of the mean square of the force's distance from that of small sub-steps, over the largest force.
double force_error(const std::string& name, const std::string& stepper) {
    Scene scene = read_scene(std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / (name + ".json"), std::nullopt);
    const Record record = test::run_scene_with(scene, "hold", 0, 0, {}, stepper);
    scene.materials.substeps *= 4;
    const Record close = test::run_scene_with(scene, "hold", 0, 0, {}, "semi_implicit");
    EXPECT_TRUE(record.outcome.ok()) << record.outcome.message;
    EXPECT_TRUE(close.outcome.ok()) << close.outcome.message;
    double sum = 0.0;
    double largest = 0.0;
    for (std::size_t tick = 0; tick < std::min(record.rows.size(), close.rows.size()); ++tick) {
        sum += (record.rows[tick].tool_force - close.rows[tick].tool_force).squaredNorm();
        largest = std::max(largest, close.rows[tick].tool_force.norm());
    }
    return std::sqrt(sum / static_cast<double>(close.rows.size())) / largest;
}

class SteppersAgree : public testing::TestWithParam<std::string> {};

TEST_P(SteppersAgree, ImplicitShowsTheForceOfSmallSubSteps) {
    const double whole = force_error(GetParam(), "implicit");
    EXPECT_LT(whole, 0.01);
    EXPECT_LT(force_error(GetParam(), "implicit:steps=4"), 0.75 * whole);
}

TEST_P(SteppersAgree, XpbdNearsItWithMoreSteps) {
    const double few = force_error(GetParam(), "xpbd");
    EXPECT_LT(few, 0.07);
    EXPECT_LT(force_error(GetParam(), "xpbd:substeps=40"), 0.75 * few);
}

INSTANTIATE_TEST_SUITE_P(Scenes, SteppersAgree, testing::Values("i2t_poke", "i2t_operator_press", "t2t_press"),
                         [](const auto& each) { return each.param; });

}  // namespace
}  // namespace trocar
