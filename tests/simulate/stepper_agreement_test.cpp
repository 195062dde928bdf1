// Steppers against one another in whole closed loops: the force at the tool is the tissue's, not the stepper's. Each is
// held against `semi_implicit` in small sub-steps, which is another scheme by other code.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "scene/scene.hpp"
#include "support/scene_runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

class SteppersAgree : public testing::TestWithParam<std::string> {
protected:
    SteppersAgree() : scene_(test::shipped_scene(GetParam())) {
        Scene finer = scene_;
        finer.materials.substeps *= 4;
        close_ = test::run_scene_with(finer, "unilateral", 0, 0, {}, "semi_implicit");
        EXPECT_TRUE(close_.outcome.ok()) << close_.outcome.message;
    }

    /// Root of the mean square of the force's distance from that of small sub-steps, over the largest force.
    [[nodiscard]] double force_error(const std::string& stepper) const {
        const Record record = test::run_scene_with(scene_, "unilateral", 0, 0, {}, stepper);
        EXPECT_TRUE(record.outcome.ok()) << record.outcome.message;
        double sum = 0.0;
        double largest = 0.0;
        for (std::size_t tick = 0; tick < std::min(record.rows.size(), close_.rows.size()); ++tick) {
            sum += (record.rows[tick].tool_force - close_.rows[tick].tool_force).squaredNorm();
            largest = std::max(largest, close_.rows[tick].tool_force.norm());
        }
        return std::sqrt(sum / static_cast<double>(close_.rows.size())) / largest;
    }

private:
    Scene scene_;
    Record close_;
};

TEST_P(SteppersAgree, OnTheForceOfSmallSubStepsTheMoreTheSmallerTheirSteps) {
    const double implicit = force_error("implicit");
    EXPECT_LT(implicit, 0.01);
    EXPECT_LT(force_error("implicit:steps=4"), 0.75 * implicit);
    const double xpbd = force_error("xpbd");
    EXPECT_LT(xpbd, 0.07);
    EXPECT_LT(force_error("xpbd:substeps=40"), 0.75 * xpbd);
}

INSTANTIATE_TEST_SUITE_P(Scenes, SteppersAgree, testing::Values("i2t_poke", "i2t_operator_press", "t2t_press"),
                         [](const auto& each) { return each.param; });

TEST(SmallSteps, HalfAsLongLeaveAQuarterOfTheDepth) {
    // What a step of h leaves open of a constraint that is solved once falls with h² (Macklin et al. 2019, section 4).
    const Scene scene = test::shipped_scene("t2t_press");
    double before = 0.0;
    for (const int steps : {10, 20, 40}) {
        const Record record = test::run_scene_with(scene, "xpbd_contact:reduction=pair", 20, 0, {},
                                                   "xpbd:substeps=" + std::to_string(steps));
        ASSERT_TRUE(record.outcome.ok()) << steps << ": " << record.outcome.message;
        const double depth = record.summary.at(Metric::residual_penetration_median_m);
        EXPECT_GT(depth, 1e-7) << steps;
        if (steps > 10) {
            EXPECT_NEAR(before / depth, 4.0, 0.2) << steps;
        }
        before = depth;
    }
}

}  // namespace
}  // namespace trocar
