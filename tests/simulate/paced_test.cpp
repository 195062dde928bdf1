#include "simulate/paced.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <sstream>
#include <string>
#include <thread>

#include "geometry/input_error.hpp"
#include "scene/scene.hpp"
#include "simulate/overrides.hpp"
#include "support/scene_samples.hpp"
#include "tissue/stability.hpp"

namespace trocar {
namespace {

/// A clock that stands still but for what waits and works.
struct StillClock {
    std::int64_t now = 5000;
    std::int64_t cpu = 0;
    std::int64_t switches = 0;
    std::int64_t late = 0;  ///< ns, the next wait ends so much after the release

    PacedClock readings() {
        return {.now_ns = [this] { return now; },
                .wait_until =
                    [this](std::int64_t release) {
                        now = std::max(now, release + late);
                        late = 0;
                    },
                .cpu_ns = [this] { return cpu; },
                .switches = [this] { return switches; }};
    }
    void work(std::int64_t ns) {
        now += ns;
        cpu += ns / 2;
    }
};

std::vector<std::int64_t> releases_of(const PacedBlock& block) {
    std::vector<std::int64_t> releases;
    releases.reserve(block.ticks.size());
    for (const PacedTick& tick : block.ticks) releases.push_back(tick.release);
    return releases;
}

TEST(PacedLoop, TicksOfTwoAndAHalfPeriodsRunAtEveryThirdRelease) {
    StillClock clock;
    PacedBlock block;
    EXPECT_TRUE(run_paced(
        10, 1000, clock.readings(), [&clock] { return clock.work(2500), true; }, block));
    EXPECT_EQ(releases_of(block), (std::vector<std::int64_t>{0, 3, 6, 9}));
    EXPECT_EQ(block.periods, 10);
    for (const PacedTick& tick : block.ticks) {
        EXPECT_EQ(tick.latency_ns, 2500.0) << "no backlog";
        EXPECT_EQ(tick.cpu_ns, 1250.0);
    }
}

TEST(PacedLoop, ATickThatEndsWithItsPeriodIsInTimeForTheNextRelease) {
    for (const auto& [ns, count] : {std::pair{1000, 10U}, std::pair{1001, 5U}}) {
        StillClock clock;
        PacedBlock block;
        run_paced(
            10, 1000, clock.readings(), [&clock, time = ns] { return clock.work(time), true; }, block);
        EXPECT_EQ(block.ticks.size(), count) << ns;
    }
}

TEST(PacedLoop, ALateTickDelaysNoOtherOne) {
    StillClock clock;
    PacedBlock block;
    int tick = 0;
    run_paced(
        8, 1000, clock.readings(), [&] { return clock.work(tick++ == 2 ? 3200 : 100), true; }, block);
    EXPECT_EQ(releases_of(block), (std::vector<std::int64_t>{0, 1, 2, 6, 7}));
    EXPECT_EQ(block.ticks[2].latency_ns, 3200.0);
    EXPECT_EQ(block.ticks[3].latency_ns, 100.0);
}

TEST(PacedLoop, LatencyCountsFromTheReleaseAndSwitchesFromTheTickBefore) {
    StillClock clock;
    clock.late = 70;
    PacedBlock block;
    run_paced(
        2, 1000, clock.readings(),
        [&clock] {
            clock.switches += 3;
            return clock.work(100), true;
        },
        block);
    ASSERT_EQ(block.ticks.size(), 2U);
    EXPECT_EQ(block.ticks[0].latency_ns, 170.0) << "the wait ended late";
    EXPECT_EQ(block.ticks[1].latency_ns, 100.0);
    for (const PacedTick& tick : block.ticks) EXPECT_EQ(tick.switches, 3);
}

TEST(PacedLoop, EndsWhereItsWorkDoes) {
    StillClock clock;
    PacedBlock block;
    int tick = 0;
    EXPECT_FALSE(run_paced(
        100, 1000, clock.readings(), [&tick] { return ++tick < 4; }, block));
    EXPECT_EQ(block.ticks.size(), 4U);
    EXPECT_EQ(block.periods, 4) << "what was never released is not skipped";
}

TEST(PacedLoop, KeepsTheMachinesClock) {
    // Twelve periods of 10 ms with ticks of 25 ms or more: four at most, however busy the machine is.
    PacedBlock block;
    const auto start = std::chrono::steady_clock::now();
    run_paced(
        12, 10'000'000, machine_clock(),
        [] {
            std::this_thread::sleep_for(std::chrono::milliseconds(25));
            return true;
        },
        block);
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    ASSERT_GE(block.ticks.size(), 1U);
    EXPECT_LE(block.ticks.size(), 4U);
    EXPECT_GE(ms, 10.0 + 25.0) << "the first release is one period away";
    for (const PacedTick& tick : block.ticks) {
        EXPECT_GE(tick.latency_ns, 25e6);
        EXPECT_GE(tick.cpu_ns, 0.0);
        EXPECT_LT(tick.cpu_ns, tick.latency_ns) << "it slept";
    }
}

TEST(PacedTurns, MethodAndEmptyLoopHaveTheSamePeriodsInTenBlocksEach) {
    StillClock clock;
    const PacedRun run = run_in_turns(24, 1000, clock.readings(), [&clock] { return clock.work(1500), true; });
    ASSERT_EQ(run.work.size(), 10U);
    ASSERT_EQ(run.empty.size(), 10U);
    const auto periods = [](const std::vector<PacedBlock>& blocks) {
        return std::accumulate(blocks.begin(), blocks.end(), std::int64_t{0},
                               [](std::int64_t sum, const PacedBlock& block) { return sum + block.periods; });
    };
    EXPECT_EQ(periods(run.work), 24);
    EXPECT_EQ(periods(run.empty), 24);
    for (std::size_t i = 0; i < 10; ++i) {
        EXPECT_EQ(run.work[i].periods, run.empty[i].periods);
        EXPECT_EQ(run.work[i].ticks.size(), (static_cast<std::size_t>(run.work[i].periods) + 1) / 2);
        EXPECT_EQ(run.empty[i].ticks.size(), static_cast<std::size_t>(run.empty[i].periods));
        for (const PacedTick& tick : run.empty[i].ticks) EXPECT_EQ(tick.latency_ns, 0.0) << "not late for the other";
    }
}

TEST(PacedTurns, EndWithTheMethod) {
    StillClock clock;
    int tick = 0;
    const PacedRun run = run_in_turns(1000, 1000, clock.readings(), [&tick] { return ++tick < 250; });
    EXPECT_EQ(run.work.size(), 3U);
    EXPECT_EQ(run.empty.size(), 2U);
    EXPECT_EQ(run.work.back().ticks.size(), 50U);
}

/// Blocks of one length whose ticks start at every n-th release.
std::vector<PacedBlock> regular_blocks(int count, std::int64_t periods, std::int64_t every, double latency_ns) {
    std::vector<PacedBlock> blocks(static_cast<std::size_t>(count));
    for (PacedBlock& block : blocks) {
        block.periods = periods;
        for (std::int64_t release = 0; release < periods; release += every) {
            block.ticks.push_back(
                {.release = release, .latency_ns = latency_ns, .cpu_ns = latency_ns / 2.0, .switches = 2});
        }
    }
    return blocks;
}

TEST(PacedFigures, CountOverrunsOfTicksAndSkippedReleasesAfterTheWarmUp) {
    const PacedFigures slow = figures_of(regular_blocks(2, 510, 2, 1500.0), 1000);
    EXPECT_EQ(slow.ticks, 500.0);
    EXPECT_EQ(slow.overruns, 500.0);
    EXPECT_EQ(slow.skipped, 500.0);
    EXPECT_EQ(slow.switches, 1000.0);
    EXPECT_EQ(slow.latency_median_ns, 1500.0);
    EXPECT_EQ(slow.cpu_median_ns, 750.0);
    EXPECT_TRUE(std::isnan(slow.latency_p99_ns)) << "500 ticks";
    EXPECT_EQ(slow.age_p99_ns, 3500.0) << "of 1000 periods: two periods and the latency of the tick that ends them";

    std::vector<PacedBlock> blocks = regular_blocks(1, 1010, 1, 400.0);
    for (std::size_t i = 0; i < 10; ++i) blocks[0].ticks[i].latency_ns = 9e6;
    blocks[0].ticks[500].latency_ns = 1000.0;
    blocks[0].ticks[1009].latency_ns = 1001.0;
    const PacedFigures fast = figures_of(blocks, 1000);
    EXPECT_EQ(fast.overruns, 1.0) << "warm-up and a tick that ends with its period are none";
    EXPECT_EQ(fast.skipped, 0.0);
    EXPECT_EQ(fast.latency_max_ns, 1001.0);
    EXPECT_EQ(fast.latency_p99_ns, 400.0);
    EXPECT_EQ(fast.age_p99_ns, 1400.0);
    EXPECT_TRUE(std::isnan(fast.latency_p999_ns));
    EXPECT_EQ(figures_of(regular_blocks(10, 1010, 1, 400.0), 1000).latency_p999_ns, 400.0) << "ten thousand ticks";
}

TEST(PacedFigures, AreNotKnownWithoutATickAfterTheWarmUp) {
    const PacedFigures none = figures_of(regular_blocks(10, 10, 1, 400.0), 1000);
    for (const double value : {none.ticks, none.overruns, none.skipped, none.latency_median_ns, none.latency_max_ns,
                               none.cpu_median_ns, none.switches, none.age_p99_ns}) {
        EXPECT_TRUE(std::isnan(value));
    }
}

TEST(MachineTime, IsTheFirstLineOfProcStat) {
    std::istringstream stat("cpu  10 20 30 400 5 6 7 8 90 11\ncpu0 1 2 3 4 5 6 7 8 9 1\n");
    const auto time = read_machine_time(stat);
    ASSERT_TRUE(time.has_value());
    EXPECT_EQ(time->steal, 8.0);
    EXPECT_EQ(time->all, 486.0) << "guests are part of user and nice";
    for (const char* other : {"", "cpu  1 2 3 4 5 6 7\n", "intr 1 2 3 4 5 6 7 8 9\n", "cpu a b\n"}) {
        std::istringstream text(other);
        EXPECT_FALSE(read_machine_time(text).has_value()) << other;
    }
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

TEST(Overrides, DitherDisplacesScriptsByItsLengthAtEveryTickButTheFirst) {
    const Scene still = test::scene_from_text(test::poke_text());
    Scene scene = still;
    apply_overrides("dither=1e-5", scene);
    const Motion& plain = still.bodies.at(0).motion.value();
    const Motion& dithered = scene.bodies.at(0).motion.value();
    EXPECT_EQ(dithered.pose_at(0.0).translation, plain.pose_at(0.0).translation);
    int other_directions = 0;
    Vector3 last = Vector3::Zero();
    for (std::int64_t tick = 1; tick <= scene.ticks; ++tick) {
        const double time = scene.dt * static_cast<double>(tick);
        const Vector3 offset = dithered.pose_at(time).translation - plain.pose_at(time).translation;
        EXPECT_NEAR(offset.norm(), 1e-5, 1e-15) << tick;
        EXPECT_TRUE(dithered.pose_at(time).rotation.isApprox(plain.pose_at(time).rotation, 1e-12));
        other_directions += offset.dot(last) < 0.9e-10 ? 1 : 0;
        last = offset;
    }
    EXPECT_GT(other_directions, scene.ticks / 2) << "seven of eight on average";
    Scene again = still;
    apply_overrides("dither=1e-5", again);
    EXPECT_EQ(again.bodies.at(0).motion->keys.back().translation, dithered.keys.back().translation);
    Scene held = test::scene_from_text(test::press_text(0.001));
    EXPECT_THROW(apply_overrides("dither=1e-5", held), InputError) << "no body follows a script exactly";
}

TEST(Overrides, DitherKeepsTurnsAndJaws) {
    Scene scene = test::scene_from_text(test::poke_text());
    Motion& motion = scene.bodies.at(0).motion.value();
    motion.keys.back().rotation_degrees = Vector3(20.0, -50.0, 110.0);
    motion.keys.back().jaw = 0.0;
    const Motion plain = motion;
    apply_overrides("dither=1e-5", scene);
    for (const double time : {0.001, 0.02, 0.05}) {
        EXPECT_TRUE(motion.pose_at(time).rotation.isApprox(plain.pose_at(time).rotation, 1e-9)) << time;
        EXPECT_NEAR(motion.pose_at(time).jaw, plain.pose_at(time).jaw, 1e-12) << time;
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
