// The speed sweep as a whole: which passes a detector that examines frames misses follows from the script alone, and
// which it sees is counted from truth that no detector takes part in.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "method/registry.hpp"
#include "scene/scene.hpp"
#include "simulate/runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

struct Pass {
    double begin = 0.0;  ///< s, contact
    double end = 0.0;    ///< s
    double speed = 0.0;  ///< m/s
    /// A frame lies in the contact. (None lies on its ends, which the test asserts.)
    [[nodiscard]] bool seen_at_a_frame(double dt) const { return std::floor(end / dt) > std::floor(begin / dt); }
};

/// The blade meets the other body while its middle is within half of `thickness` of z = 0.
std::vector<Pass> passes_of(const Scene& scene, double thickness) {
    std::vector<Pass> passes;
    for (const SceneBody& body : scene.bodies) {
        if (!body.motion) continue;
        const std::vector<MotionKey>& keys = body.motion->keys;
        for (std::size_t k = 0; k + 1 < keys.size(); ++k) {
            const double path = std::abs(keys[k + 1].translation.z() - keys[k].translation.z());
            if (path == 0.0) continue;
            const double span = keys[k + 1].time - keys[k].time;
            const double middle = keys[k].time + 0.5 * span;
            const double half = 0.5 * thickness * span / path;
            passes.push_back({middle - half, middle + half, path / span});
        }
    }
    return passes;
}

Record replay_of(const Scene& scene, const std::string& detector) {
    RunSpec spec;
    spec.mode = "replay";
    spec.detector = detector;
    spec.truth_stride = 0;
    spec.between_ticks = true;
    return make_run(scene, spec);
}

class SpeedSweep : public testing::TestWithParam<const char*> {
protected:
    SpeedSweep() : scene(test::shipped_scene(GetParam())) {}
    Scene scene;
};

TEST_P(SpeedSweep, PassesAreTheOnesOfTheScriptAndTheMissedOnesFallBetweenFrames) {
    const std::vector<Pass> passes = passes_of(scene, 0.001);
    ASSERT_GE(passes.size(), 90U);
    const Record record = replay_of(scene, "ohc");
    ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
    ASSERT_EQ(record.events.size(), passes.size());
    std::size_t missed = 0;
    for (std::size_t k = 0; k < passes.size(); ++k) {
        const ContactEvent& event = record.events[k];
        EXPECT_NEAR(event.begin, passes[k].begin, 1e-9) << k;
        EXPECT_NEAR(event.end, passes[k].end, 1e-9) << k;
        const double phase = std::fmod(passes[k].end / scene.dt, 1.0);
        ASSERT_GT(std::min(phase, 1.0 - phase), 1e-6) << "a frame on the very end of a contact decides nothing";
        EXPECT_EQ(!event.missed(), passes[k].seen_at_a_frame(scene.dt)) << k << ", " << passes[k].speed << " m/s";
        if (!event.missed()) {
            EXPECT_NEAR(event.seen, std::ceil(passes[k].begin / scene.dt) * scene.dt, 1e-9);
        }
        missed += event.missed() ? 1 : 0;
    }
    EXPECT_EQ(record.summary.at(Metric::contact_events_missed), static_cast<double>(missed));
    EXPECT_GT(missed, 30U);
    EXPECT_GT(record.summary.at(Metric::swept_false_negatives), 0.0);
}

TEST(SpeedSweepFast, ContinuousTestMissesNone) {
    const Scene scene = test::shipped_scene("i2t_speed_sweep");
    for (const DetectorEntry& entry : registry().detectors()) {
        const bool has_option = std::any_of(entry.parameters.begin(), entry.parameters.end(),
                                            [](const Parameter& p) { return p.name == "swept"; });
        if (!has_option) continue;
        const Record record = replay_of(scene, entry.name + ":swept=on");
        ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
        EXPECT_EQ(record.summary.at(Metric::contact_events_missed), 0.0) << entry.name;
        EXPECT_EQ(record.summary.at(Metric::swept_false_negatives), 0.0) << entry.name;
        EXPECT_EQ(record.summary.at(Metric::swept_false_positives), 0.0) << entry.name;
        EXPECT_EQ(record.summary.at(Metric::swept_time_error_max), 0.0) << entry.name;
    }
}

INSTANTIATE_TEST_SUITE_P(Scenes, SpeedSweep, testing::Values("i2t_speed_sweep", "i2r_speed_sweep"),
                         [](const auto& scene) { return std::string(scene.param); });

}  // namespace
}  // namespace trocar
