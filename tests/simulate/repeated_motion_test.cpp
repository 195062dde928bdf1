// Repeated motion, and the bound that a haptic loop lives on in counters, which CI may gate on: the worst tick of our
// detectors costs at most three times the usual one.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "geometry/input_error.hpp"
#include "measure/statistics.hpp"
#include "method/registry.hpp"
#include "scene/scene.hpp"
#include "simulate/overrides.hpp"
#include "simulate/runs.hpp"
#include "support/shapes.hpp"

namespace trocar {
namespace {

Scene scene_named(const std::string& name) {
    return read_scene(std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / (name + ".json"), std::nullopt);
}

Record replayed(const std::string& scene, const std::string& detector, int cycles, std::int64_t ticks) {
    RunSpec spec;
    spec.mode = "replay";
    spec.scene = scene;
    spec.detector = detector;
    spec.ticks = ticks;
    spec.truth_stride = 101;
    spec.overrides = "cycles=" + std::to_string(cycles);
    return make_run(scene_named(scene), spec);
}

/// Work of the ticks with contact after the first 1000 ticks, in which buffers and structures find their size.
std::vector<double> work_of(const Record& record) {
    std::vector<double> work;
    for (const StepRow& row : record.rows) {
        if (row.tick >= 1000 && row.pairs > 0) work.push_back(static_cast<double>(row.work.work()));
    }
    return work;
}

/// Shapes of contact, again and again in other directions: a drag, one tool on a coarse sheet, an edge on an edge, two
/// sheets that share most of their cells.
class RepeatedMotionOn : public testing::TestWithParam<const char*> {};

TEST_P(RepeatedMotionOn, WorstTickIsWithinThreeTimesTheMedianInWork) {
    for (const char* detector : {"ohc", "ohc_clustered"}) {
        SCOPED_TRACE(detector);
        const Record record = replayed(GetParam(), detector, 8, 4000);
        ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
        const std::vector<double> work = work_of(record);
        ASSERT_GT(work.size(), 500U);
        EXPECT_GT(median(work), 100.0);
        EXPECT_LE(*std::max_element(work.begin(), work.end()), 3.0 * median(work));
        EXPECT_GE(value_of(record.summary, Metric::judged_ticks), 39.0);
        EXPECT_GT(value_of(record.summary, Metric::true_pairs), 0.0);
        EXPECT_EQ(value_of(record.summary, Metric::false_negatives), 0.0);
        EXPECT_EQ(value_of(record.summary, Metric::false_positives), 0.0);
    }
}
INSTANTIATE_TEST_SUITE_P(Scenes, RepeatedMotionOn,
                         testing::Values("i2t_drag", "i2t_press_slide", "i2t_lay", "t2t_press"),
                         [](const auto& scene) { return std::string(scene.param); });

TEST(RepeatedMotion, AWorkBudgetBoundsEveryTickAndIsReportedAsTruncated) {
    for (const std::string detector : {"ohc", "ohc_clustered"}) {
        SCOPED_TRACE(detector);
        const Record free = replayed("i2t_drag", detector, 4, 1600);
        const double budget = median(work_of(free));
        const Record bounded = replayed(
            "i2t_drag", detector + ":work_budget=" + std::to_string(static_cast<std::int64_t>(budget)), 4, 1600);
        EXPECT_LE(value_of(bounded.summary, Metric::work_max), budget);
        const auto limited = static_cast<double>(work_of(free).size());
        EXPECT_GT(value_of(bounded.summary, Metric::truncated_ticks), 0.1 * limited);
        EXPECT_EQ(bounded.frames_hash, free.frames_hash);
    }
}

TEST(RepeatedMotion, TwoMeshesOf100kTrianglesCostAFewSearchesPerTriangle) {
    // This lets `trocar detect` answer within a second: there are 10^10 pairs of triangles, and each triangle is
    // examined a few times.
    const test::World world = test::make_world(
        "two spheres", {{BodyKind::tissue, test::sphere(0.03, 225)},
                        {BodyKind::rigid, test::sphere(0.03, 225).rotate({1, 2, 3}, 0.4).move({0.0151, 0.0007, 0.0})}});
    const auto triangles = static_cast<std::int64_t>(world.topology.triangle_count());
    ASSERT_GE(triangles, 2 * 100000);
    std::vector<TrianglePair> first;
    for (const char* name : {"ohc", "ohc_clustered"}) {
        const auto detector = make_detector(name, {});
        ContactSet contacts;
        detector->prepare(world.topology, world.frame);
        detector->update(world.frame, 0.0);
        detector->detect(world.frame, contacts);
        EXPECT_TRUE(contacts.outcome.ok());
        EXPECT_GT(contacts.pairs.size(), 1000U) << name;
        EXPECT_LT(contacts.work.work(), 30 * triangles) << name;
        if (first.empty()) first = contacts.pairs;
        EXPECT_EQ(contacts.pairs, first) << "two detectors of ours disagree";
    }
}

TEST(RepeatedMotion, EveryCycleIsAnotherDrag) {
    const Scene once = scene_named("i2t_drag");
    Scene many = once;
    apply_overrides("cycles=3", many);
    const auto moving = [](const Scene& scene) -> const Motion& {
        for (const SceneBody& body : scene.bodies) {
            if (body.motion) return *body.motion;
        }
        throw std::logic_error("no motion");
    };
    const double period = moving(once).last_key_time() + 0.1;
    EXPECT_EQ(many.ticks, std::llround(3.0 * period / many.dt));
    for (const double time : {0.2, 0.45, 0.7}) {
        const Vector3 first = moving(once).pose_at(time).translation;
        EXPECT_LT((moving(many).pose_at(time).translation - first).norm(), 1e-12);
        const Vector3 second = moving(many).pose_at(time + period).translation;
        // As deep and as far from the axis, in another direction.
        EXPECT_NEAR(second.z(), first.z(), 1e-12);
        EXPECT_NEAR(second.head<2>().norm(), first.head<2>().norm(), 1e-9);
        if (first.head<2>().norm() > 0.005) {
            // The golden angle, 137.5077640500378 degrees.
            EXPECT_NEAR(first.head<2>().normalized().dot(second.head<2>().normalized()), -0.7373688780783197, 1e-9);
        }
    }
    Scene still = once;
    for (SceneBody& body : still.bodies) body.motion.reset();
    EXPECT_THROW(apply_overrides("cycles=2", still), InputError);
    Scene broken = once;
    EXPECT_THROW(apply_overrides("cycles=1.5", broken), InputError);
}

}  // namespace
}  // namespace trocar
