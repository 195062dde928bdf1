#include "simulate/paced.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <string>

#include "geometry/input_error.hpp"
#include "measure/statistics.hpp"
#include "scene/scene.hpp"
#include "simulate/overrides.hpp"
#include "support/scene_samples.hpp"
#include "tissue/stability.hpp"

namespace trocar {
namespace {

void busy_for(std::chrono::microseconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < end) {
    }
}

TEST(PacedLoop, ALateTickMakesTheNextOnesLateToo) {
    // 5 ms period; tick 20 works 13 ms: it misses, and so does tick 21, released while 20 still worked.
    constexpr std::int64_t period = 5'000'000;
    int tick = 0;
    const PacedTimes times = run_paced(30, period, [&tick] {
        if (tick == 20) busy_for(std::chrono::microseconds(13'000));
        ++tick;
        return true;
    });
    ASSERT_EQ(times.latency_ns.size(), 30U);
    EXPECT_GE(times.latency_ns[20], 13e6);
    EXPECT_GE(times.latency_ns[21], 8e6 - 1e3) << "counted from its release, not from its start";
    EXPECT_GE(times.latency_ns[22], 3e6 - 1e3);
    const auto figures = latency_of(times, period);
    EXPECT_GE(figures.misses, 2.0);
    EXPECT_GE(figures.burst, 2.0);
    EXPECT_GE(figures.max_ns, 13e6);
    EXPECT_TRUE(std::isnan(figures.p99_ns)) << "20 timed ticks are too few";
}

TEST(PacedLoop, ReleasesKeepTheClock) {
    const auto start = std::chrono::steady_clock::now();
    int count = 0;
    run_paced(20, 2'000'000, [&count] { return ++count < 1000; });
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    EXPECT_GE(ms, 40.0 - 0.01) << "20 periods of 2 ms: the first release is one period away";
    EXPECT_EQ(count, 20);
    EXPECT_EQ(run_paced(20, 1'000'000, [] { return false; }).latency_ns.size(), 1U) << "asked to stop";
}

TEST(PacedLoop, RunsWhileAnEmptyOneRuns) {
    // A tick of 100 ms makes the two after it late, and none of the empty loop; one after the other the two loops
    // would take 800 ms.
    constexpr std::int64_t period = 40'000'000;
    int tick = 0;
    const auto start = std::chrono::steady_clock::now();
    const PacedBeside times = run_beside_empty(10, period, [&tick] {
        if (tick++ == 4) busy_for(std::chrono::microseconds(100'000));
        return true;
    });
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(700));
    ASSERT_EQ(times.work.latency_ns.size(), 10U);
    EXPECT_EQ(times.empty.latency_ns.size(), 10U);
    EXPECT_GE(times.work.latency_ns[4], 100e6);
    EXPECT_GE(times.work.latency_ns[5], 60e6 - 1e5);
    EXPECT_GE(times.work.latency_ns[6], 20e6 - 1e5);
    EXPECT_LT(median(times.empty.latency_ns), 20e6);
    int count = 0;
    const PacedBeside stopped = run_beside_empty(100'000, 1'000'000, [&count] { return ++count < 3; });
    EXPECT_EQ(stopped.work.latency_ns.size(), 3U) << "asked to stop";
    EXPECT_LT(stopped.empty.latency_ns.size(), 100'000U) << "stops with it";
}

TEST(PacedLatency, BurstsAreMissesInARow) {
    PacedTimes times{std::vector<double>(10 + 8, 100.0)};
    for (const std::size_t late : {11U, 12U, 13U, 16U}) times.latency_ns[late] = 2000.0;
    times.latency_ns[3] = 1e9;  // warm-up
    const auto figures = latency_of(times, 1000);
    EXPECT_EQ(figures.misses, 4.0);
    EXPECT_EQ(figures.burst, 3.0);
    EXPECT_EQ(figures.max_ns, 2000.0);
}

TEST(PacedLatency, CountFromTheFirstTickAfterTheWarmUpOn) {
    // That one is late; the next one ends with its period, which is in time.
    PacedTimes times{std::vector<double>(10, 5000.0)};
    const auto none = latency_of(times, 1000);
    for (const double value : {none.median_ns, none.p99_ns, none.p999_ns, none.max_ns, none.misses, none.burst}) {
        EXPECT_TRUE(std::isnan(value));
    }
    times.latency_ns.insert(times.latency_ns.end(), {1001.0, 1000.0, 400.0, 200.0});
    const auto one = latency_of(times, 1000);
    EXPECT_EQ(one.misses, 1.0);
    EXPECT_EQ(one.burst, 1.0);
    EXPECT_EQ(one.median_ns, 700.0);
    EXPECT_EQ(one.max_ns, 1001.0);
    EXPECT_TRUE(std::isnan(one.p99_ns));
    // 1 to 1000: the quantile q lies at 1 + 999 q (type 7 of Hyndman and Fan 1996).
    times.latency_ns.resize(10);
    for (int ns = 1000; ns > 0; --ns) times.latency_ns.push_back(ns);
    const auto thousand = latency_of(times, 990);
    EXPECT_NEAR(thousand.p99_ns, 990.01, 1e-9);
    EXPECT_TRUE(std::isnan(thousand.p999_ns));
    EXPECT_EQ(thousand.misses, 10.0);
    EXPECT_EQ(thousand.burst, 10.0) << "the first ten of them";
}

TEST(Overrides, TickKeepsTheLengthOfRunAndSubStep) {
    Scene scene = test::scene_from_text(test::poke_text());
    const int substeps = scene.materials.substeps;
    const std::uint64_t hash = scene.hash;
    apply_overrides("dt=0.0005,k=321", scene);
    EXPECT_EQ(scene.dt, 0.0005);
    EXPECT_EQ(scene.ticks, 120);
    EXPECT_EQ(scene.materials.substeps, (substeps + 1) / 2);
    EXPECT_EQ(scene.hash, hash);
    for (const ContactLaw& law : scene.materials.contact_laws) EXPECT_EQ(law.k, 321.0);
    EXPECT_EQ(scene.turned_k, 321.0);
    apply_overrides("substeps=9", scene);
    EXPECT_EQ(scene.materials.substeps, 9);
    EXPECT_EQ(override_value("dt=0.0005,k=321", "k"), 321.0);
    EXPECT_EQ(override_value("", "k"), 0.0);
    for (const char* bad :
         {"dt", "dt=", "dt=0", "dt=-1", "dt=x", "mass=3", "substeps=1.5", "k=nan", "k=1e999", "k=1x"}) {
        EXPECT_THROW(apply_overrides(bad, scene), InputError) << bad;
    }
}

TEST(Overrides, AnyNumberOfThemInAnyOrder) {
    for (const char* all : {"k=250,substeps=7,dt=0.0005", "substeps=7,dt=0.0005,k=250", "dt=0.0005,k=250,substeps=7"}) {
        Scene scene = test::scene_from_text(test::poke_text());
        apply_overrides(all, scene);
        EXPECT_EQ(scene.materials.substeps, 7) << all;
        EXPECT_EQ(scene.dt, 0.0005) << all;
        EXPECT_EQ(scene.ticks, 120) << all;
        EXPECT_EQ(scene.turned_k, 250.0) << all;
        EXPECT_EQ(override_value(all, "k"), 250.0);
        EXPECT_EQ(override_value(all, "substeps"), 7.0);
        EXPECT_EQ(override_value(all, "dt"), 0.0005);
    }
}

TEST(PacedScene, HasTwentyThousandTissueTrianglesAndStableSubSteps) {
    const Scene scene = read_scene(std::string(TROCAR_SOURCE_DIR) + "/bench/studies/scenes/press_20k.json", {});
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        EXPECT_GE(body.triangles.count, 20000);
    }
    // Fewer sub-steps than the bound of Gershgorin asks for: 5 % below the limit that power iteration finds.
    const double h = scene.dt / scene.materials.substeps;
    EXPECT_FALSE(surely_unstable(scene.materials, scene.first.position, 1.05 * h));
    EXPECT_TRUE(surely_unstable(scene.materials, scene.first.position, 4.0 / 3.0 * h));
    EXPECT_GE(static_cast<double>(scene.ticks) * scene.dt, scene.bodies.front().motion.value().last_key_time());
    EXPECT_GT(scene.ticks, 100000) << "a p99.9 needs its thousandths";
}

}  // namespace
}  // namespace trocar
