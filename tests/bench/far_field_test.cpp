// A stepper in step with another one: what is the same shows no error, what is softer shows it at the tool and beside
// it.
#include "bench/far_field.hpp"

#include <gtest/gtest.h>

#include "geometry/input_error.hpp"

namespace trocar::bench {
namespace {

constexpr std::int64_t few_triangles = 1500;

TEST(FarField, TheSameStepperHasNoError) {
    const FarFieldRun run = run_far_field(few_triangles, "implicit", "implicit", 300);
    ASSERT_EQ(run.outcome, "ok");
    ASSERT_EQ(run.ticks.size(), 300U);
    for (const FarFieldTick& tick : run.ticks) {
        EXPECT_EQ(tick.force_error, 0.0);
        for (const double error : tick.position_error) EXPECT_EQ(error, 0.0);
    }
    EXPECT_GT(run.ticks.back().force, 0.01);
    // A membrane sinks with the logarithm of the distance: far from the tool it is not still.
    EXPECT_GT(run.ticks.back().path.back(), 0.05 * run.ticks.back().path.front());
    EXPECT_LT(run.ticks.back().path.back(), run.ticks.back().path.front());
}

TEST(FarField, ASofterStepperIsReported) {
    const FarFieldRun run = run_far_field(few_triangles, "xpbd:substeps=1", "implicit", 300);
    ASSERT_EQ(run.outcome, "ok");
    EXPECT_GT(run.ticks.back().force_error, 0.005 * run.ticks.back().force);
    EXPECT_NE(run.ticks.back().other_force, run.ticks.back().force);
    for (const double error : run.ticks.back().position_error) EXPECT_GT(error, 0.0);
    const auto files = far_field_report({run}, {{"commit", "none"}});
    EXPECT_TRUE(files.contains("report.html"));
    EXPECT_TRUE(files.contains("far_field.csv"));
    EXPECT_EQ(files.size(), 7U);
    EXPECT_NE(files.at("report.md").find("xpbd:substeps=1"), std::string::npos);
}

TEST(FarField, AStepperThatThereIsNotIsReported) {
    EXPECT_THROW(run_far_field(few_triangles, "regionally", "implicit", 1), InputError);
}

}  // namespace
}  // namespace trocar::bench
