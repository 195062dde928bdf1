// A second stepper in step: the same one shows no difference, a softer one shows it at the tool and beside it.
#include "simulate/against.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "geometry/input_error.hpp"
#include "scene/scene.hpp"
#include "simulate/runs.hpp"

namespace trocar {
namespace {

Record run_of(const std::string& stepper, const std::string& against) {
    const Scene scene = read_scene(std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / "i2t_poke.json", std::nullopt);
    RunSpec spec;
    spec.mode = "against";
    spec.scene = scene.name;
    spec.detector = "ohc_clustered";
    spec.response = "unilateral";
    spec.contacts = "tracked_proximity";
    spec.stepper = stepper;
    spec.against = against;
    spec.ticks = 400;
    spec.truth_stride = 0;
    return make_run(scene, spec);
}

TEST(Against, TheSameStepperDoesNotDiffer) {
    const Record record = run_of("implicit", "implicit");
    ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
    EXPECT_GT(value_of(record.summary, Metric::force_max_n), 0.01);
    EXPECT_EQ(value_of(record.summary, Metric::against_force_rms_n), 0.0);
    EXPECT_EQ(value_of(record.summary, Metric::against_force_max_n), 0.0);
    EXPECT_EQ(value_of(record.summary, Metric::against_near_max_m), 0.0);
    EXPECT_GT(value_of(record.summary, Metric::against_advance_median_ns), 0.0);
}

TEST(Against, ASofterStepperDiffersAndTheRunIsTheOneWithoutASecond) {
    const Record record = run_of("xpbd:substeps=1", "implicit");
    ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
    EXPECT_GT(value_of(record.summary, Metric::against_force_max_n),
              value_of(record.summary, Metric::against_force_rms_n));
    EXPECT_GT(value_of(record.summary, Metric::against_force_rms_n), 0.0);
    EXPECT_GT(value_of(record.summary, Metric::against_near_max_m), 1e-6);
    const Record alone = run_of("xpbd:substeps=1", "");
    EXPECT_EQ(alone.state_hash, record.state_hash);
    EXPECT_FALSE(alone.summary.contains(Metric::against_force_max_n));
    // The largest difference of two forces is at most the sum of the largest ones.
    const Record other = run_of("implicit", "");
    EXPECT_LE(value_of(record.summary, Metric::against_force_max_n),
              value_of(alone.summary, Metric::force_max_n) + value_of(other.summary, Metric::force_max_n));
}

TEST(Against, AStepperThatThereIsNotIsReported) { EXPECT_THROW((void)run_of("implicit", "regionally"), InputError); }

}  // namespace
}  // namespace trocar
