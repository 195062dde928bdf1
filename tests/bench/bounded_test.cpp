// The bound that a haptic loop lives on, in counters, which CI may gate on: the worst tick of our detectors costs at
// most three times the usual one. The long run with wall times is the benchmark's; this is the same code, shorter.
#include <gtest/gtest.h>

#include "bench/bounded.hpp"
#include "geometry/input_error.hpp"
#include "support/shapes.hpp"

namespace trocar::bench {
namespace {

std::filesystem::path scene_file() { return std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes/i2t_drag.json"; }

std::vector<Method> own() {
    std::vector<Method> list;
    for (const char* method : {"ohc", "ohc_clustered"}) list.push_back(method_of(method));
    return list;
}

/// The worst tick within three times the median, all ticks answered, and right wherever truth was taken.
void expect_bounded(const BoundedMeasurement& measured, std::size_t methods, std::int64_t least_truth_ticks) {
    ASSERT_EQ(measured.methods.size(), methods);
    for (const BoundedResult& method : measured.methods) {
        SCOPED_TRACE(method.label);
        EXPECT_TRUE(method.outcome.ok()) << method.outcome.message;
        EXPECT_GT(method.work.median, 100.0);
        EXPECT_LE(method.work.max, 3.0 * method.work.median) << "tick " << method.worst_tick;
        EXPECT_EQ(method.wrong_ticks, 0);
        EXPECT_GE(method.truth_ticks, least_truth_ticks);
        EXPECT_EQ(method.truncated, 0);
    }
}

TEST(Bounded, WorstTickIsWithinThreeTimesTheMedianInWork) {
    constexpr std::int64_t ticks = 5000;
    const Scene scene = repeated(scene_file(), 14);
    const BoundedMeasurement measured = measure_bounded(scene, own(), ticks);
    ASSERT_EQ(measured.ticks, ticks);
    EXPECT_GT(measured.true_pairs, 10.0);
    expect_bounded(measured, 2, 5);
}

/// Other shapes of contact than a drag, again and again in other directions: one tool on a coarse sheet, an edge on an
/// edge, two sheets that share most of their cells.
class BoundedOn : public testing::TestWithParam<const char*> {};

TEST_P(BoundedOn, WorstTickIsWithinThreeTimesTheMedianInWork) {
    constexpr std::int64_t ticks = 1001;
    const std::filesystem::path file = std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes" / GetParam();
    const std::vector<Method> list = own();
    const BoundedMeasurement measured = measure_bounded(repeated(file, 12), list, ticks);
    ASSERT_EQ(measured.ticks, ticks);
    expect_bounded(measured, list.size(), 2);
}
INSTANTIATE_TEST_SUITE_P(Scenes, BoundedOn, testing::Values("i2t_press_slide.json", "i2t_lay.json", "t2t_press.json"),
                         [](const auto& scene) {
                             const std::string name = scene.param;
                             return name.substr(0, name.find('.'));
                         });

TEST(Bounded, AWorkBudgetBoundsEveryTickAndIsReportedAsTruncated) {
    const Scene scene = repeated(scene_file(), 8);
    for (const char* method : {"ohc", "ohc_clustered"}) {
        const BoundedMeasurement free = measure_bounded(scene, {method_of(method)}, 300);
        const auto budget = static_cast<std::int64_t>(free.methods[0].work.median);
        const BoundedMeasurement bounded =
            measure_bounded(scene, {method_of(std::string(method) + ":work_budget=" + std::to_string(budget))}, 300);
        EXPECT_LE(bounded.methods[0].work.max, static_cast<double>(budget)) << method;
        EXPECT_GT(bounded.methods[0].truncated, 30) << method;
        EXPECT_LT(bounded.methods[0].truncated, 270) << method;
        EXPECT_EQ(bounded.frames_hash, free.frames_hash);
    }
}

TEST(Bounded, TwoMeshesOf100kTrianglesCostAFewSearchesPerTriangle) {
    // This lets `trocar detect` answer within a second: there are 10^10 pairs of triangles, and each triangle is
    // examined a few times.
    const test::World world = test::make_world(
        "two spheres", {{BodyKind::tissue, test::sphere(0.03, 225)},
                        {BodyKind::rigid, test::sphere(0.03, 225).rotate({1, 2, 3}, 0.4).move({0.0151, 0.0007, 0.0})}});
    const auto triangles = static_cast<std::int64_t>(world.topology.triangle_count());
    ASSERT_GE(triangles, 2 * 100000);
    std::vector<TrianglePair> first;
    for (const Method& method : own()) {
        const auto detector = method.make();
        ContactSet contacts;
        detector->prepare(world.topology, world.frame);
        detector->update(world.frame, 0.0);
        detector->detect(world.frame, contacts);
        EXPECT_TRUE(contacts.outcome.ok());
        EXPECT_GT(contacts.pairs.size(), 1000U) << method.label;
        EXPECT_LT(contacts.work.work(), 30 * triangles) << method.label;
        if (first.empty()) first = contacts.pairs;
        EXPECT_EQ(contacts.pairs, first) << "two detectors of ours disagree";
    }
}

TEST(Bounded, EveryCycleOfARepeatedSceneIsAnotherDrag) {
    const Scene once = read_scene(scene_file(), std::nullopt);
    const Scene many = repeated(once, 3, 0.1);
    const auto moving = [](const Scene& scene) -> const Motion& {
        for (const SceneBody& body : scene.bodies) {
            if (body.motion) return *body.motion;
        }
        throw std::logic_error("no motion");
    };
    const double period = moving(once).last_key_time() + 0.1;
    for (const double time : {0.2, 0.45, 0.7}) {
        const Vector3 first = moving(once).pose_at(time).translation;
        EXPECT_LT((moving(many).pose_at(time).translation - first).norm(), 1e-12);
        const Vector3 second = moving(many).pose_at(time + period).translation;
        // As deep and as far from the axis, in another direction.
        EXPECT_NEAR(second.z(), first.z(), 1e-12);
        EXPECT_NEAR(second.head<2>().norm(), first.head<2>().norm(), 1e-9);
        if (first.head<2>().norm() > 0.005) {
            EXPECT_GT((second - first).norm(), 0.005);
        }
    }
    Scene still = once;
    for (SceneBody& body : still.bodies) body.motion.reset();
    EXPECT_THROW(repeated(still, 2, 0.1), InputError);
}

}  // namespace
}  // namespace trocar::bench
