// ohc with incremental=on: the same pairs as without on every tick of every motion, and no work for what rests.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "measure/allocations.hpp"
#include "method/registry.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"

namespace trocar::test {
namespace {

using Settings = std::map<std::string, std::string>;

ContactSet answer(Detector& detector, const Frame& frame) {
    ContactSet contacts;
    detector.update(frame, 0.0);
    detector.detect(frame, contacts);
    return contacts;
}

std::unique_ptr<Detector> started(const World& world, Settings settings, bool incremental = true) {
    settings["incremental"] = incremental ? "on" : "off";
    std::unique_ptr<Detector> detector = make_detector("ohc", settings);
    detector->prepare(world.topology, world.frame);
    return detector;
}

std::vector<World> scenes() {
    std::vector<World> worlds;
    worlds.push_back(make_world("shaft, slab, bone and two soups",
                                {{BodyKind::instrument, shaft(0.004, 0.1, 10, 20).move({0.001, 0.0003, -0.012})},
                                 {BodyKind::instrument, soup(80, 0.01, 0.05, 41)},
                                 {BodyKind::tissue, slab(0.1, 0.01, 12).shake(0.0003, 3)},
                                 {BodyKind::tissue, soup(120, 0.006, 0.05, 42)},
                                 {BodyKind::rigid, sphere(0.02, 10).move({0.02, 0.01, 0.0})}}));
    // Corners of the large ones wander, so that they are now few cells, now pieces, now too many for pieces.
    worlds.push_back(
        make_world("large triangles",
                   {{BodyKind::instrument, triangle({-0.2, -0.1, 0.0011}, {0.15, -0.2, 0.0007}, {0.01, 0.2, -0.0013})},
                    {BodyKind::rigid, triangle({0.01, 0.0, -0.2}, {0.0, 0.01, 0.2}, {0.02, 0.1, 0.01})},
                    {BodyKind::tissue, soup(200, 0.004, 0.05, 8)}}));
    return worlds;
}

/// Moves a random part of the vertices, from none to all; tells the ranges that hold them, more than needed.
void move_some(World& world, std::mt19937& random, int tick) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    world.frame.previous = world.frame.position;
    world.frame.moved.emplace();
    ++world.frame.tick;
    for (const BodyRange& body : world.topology.bodies) {
        const int kind = static_cast<int>(random() % 4);
        if (kind == 0) continue;
        const Vector3 by = 0.002 * random_vector(uniform, random);
        Range range = body.vertices;
        if (kind == 1) range = {body.vertices.first + body.vertices.count / 3, body.vertices.count / 4};
        world.frame.moved->push_back(range);
        if (kind == 3 && tick % 3 == 0) continue;  // told and yet at rest
        const double jump = tick % 11 == 10 ? 100.0 : 1.0;
        for (Index v = range.first; v < range.end(); ++v) {
            const Vector3 own = 0.0005 * random_vector(uniform, random);
            const double wide = body.vertices.count <= 3 ? 200.0 : 1.0;
            world.frame.position.col(v) += jump * by + wide * own;
        }
        if (jump > 1.0) {
            for (Index v = range.first; v < range.end(); ++v) world.frame.position.col(v) -= 0.9 * jump * by;
        }
    }
}

TEST(OhcIncremental, EveryTickHasThePairsOfAFreshStart) {
    for (const Settings& settings : std::vector<Settings>{{},
                                                          {{"cell", "0.0007"}},
                                                          {{"cell", "0.5"}},
                                                          {{"margin", "0.002"}},
                                                          {{"hash_bits", "1"}, {"hash", "teschner"}}}) {
        for (World world : scenes()) {
            std::mt19937 random(7);
            const auto told = started(world, settings);
            const auto untold = started(world, settings);
            std::size_t pairs = 0;
            for (int tick = 0; tick < 40; ++tick) {
                if (tick > 0) move_some(world, random, tick);
                Frame plain = world.frame;
                plain.moved.reset();
                const auto fresh = started(world, settings, false);
                const std::vector<TrianglePair> expected = answer(*fresh, plain).pairs;
                pairs += expected.size();
                if (tick == 0) world.frame.moved.reset();
                ASSERT_EQ(answer(*told, world.frame).pairs, expected) << world.name << ", tick " << tick;
                ASSERT_EQ(answer(*untold, plain).pairs, expected) << world.name << ", tick " << tick;
            }
            EXPECT_GT(pairs, 100U) << world.name;
        }
    }
}

/// Bodies move as a whole for a while, then in part, then rest, each in its own rhythm: so each is kept and let go of
/// again and again, alone and together with others.
TEST(OhcIncremental, BodiesThatComeToRestAndMoveOnAreAnsweredAllTheWay) {
    World world = scenes().front();
    std::mt19937 random(17);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto told = started(world, {});
    const auto untold = started(world, {});
    const auto limited = started(world, {{"max_pairs", "100000"}});
    struct Phase {
        unsigned kind = 0;  ///< 0 rest, 1 in part, 2 whole
        unsigned ticks = 0;
    };
    std::vector<Phase> phases(world.topology.bodies.size());
    std::size_t pairs = 0;
    std::int64_t least_work = std::numeric_limits<std::int64_t>::max();
    for (int tick = 0; tick < 160; ++tick) {
        world.frame.previous = world.frame.position;
        world.frame.tick = tick;
        std::vector<Range> moved;
        for (std::size_t b = 0; b < phases.size() && tick > 0; ++b) {
            Phase& phase = phases[b];
            if (phase.ticks == 0)
                phase = {static_cast<unsigned>(random() % 3), 1 + static_cast<unsigned>(random() % 24)};
            --phase.ticks;
            const bool everybody_rests = tick % 40 >= 28;
            if (phase.kind == 0 || everybody_rests) continue;
            Range range = world.topology.bodies[b].vertices;
            if (phase.kind == 1) range = {range.first + range.count / 2, range.count / 5};
            moved.push_back(range);
            const Vector3 by = 0.001 * random_vector(uniform, random);
            for (Index v = range.first; v < range.end(); ++v) world.frame.position.col(v) += by;
        }
        Frame plain = world.frame;
        plain.moved.reset();
        // Told ranges may be too long, overlap, or lie outside altogether.
        if (tick % 5 == 4) moved.push_back({-10, 30});
        if (tick % 7 == 6) moved.push_back({world.topology.vertex_count - 3, 1000});
        if (tick % 9 == 8) moved.push_back({world.topology.vertex_count + 50, 10});
        if (tick > 0) world.frame.moved = moved;
        const std::vector<TrianglePair> expected = answer(*started(world, {}, false), plain).pairs;
        pairs += expected.size();
        const ContactSet contacts = answer(*told, world.frame);
        ASSERT_EQ(contacts.pairs, expected) << "told, tick " << tick;
        ASSERT_EQ(answer(*untold, plain).pairs, expected) << "untold, tick " << tick;
        ASSERT_EQ(answer(*limited, tick % 2 == 0 ? world.frame : plain).pairs, expected) << "limited, tick " << tick;
        least_work = std::min(least_work, contacts.work.work());
    }
    EXPECT_GT(pairs, 1000U);
    EXPECT_LT(least_work, 100) << "nothing ever came to rest";
}

TEST(OhcIncremental, UnderLimitsAWorldAtRestAddsNothingButTheLook) {
    World world = scenes().front();
    const std::vector<TrianglePair> all = answer(*started(world, {}, false), world.frame).pairs;
    ASSERT_GT(all.size(), 20U);
    for (const Settings& settings :
         std::vector<Settings>{{{"max_pairs", "100000"}}, {{"max_pairs", "9"}}, {{"work_budget", "100000000"}}}) {
        const auto detector = started(world, settings);
        world.frame.moved.reset();
        const ContactSet first = answer(*detector, world.frame);
        const ContactSet compared = answer(*detector, world.frame);
        EXPECT_EQ(compared.pairs, first.pairs);
        EXPECT_EQ(compared.truncated, first.truncated);
        EXPECT_EQ(compared.truncated, settings.contains("max_pairs") && settings.at("max_pairs") == "9");
        EXPECT_EQ(compared.work.work(), world.topology.vertex_count);
        world.frame.moved = std::vector<Range>{};
        const ContactSet told = answer(*detector, world.frame);
        EXPECT_EQ(told.pairs, first.pairs);
        EXPECT_EQ(told.work.work(), 0);
        World elsewhere = world;
        const Range shaft_vertices = world.topology.bodies[0].vertices;
        for (Index v = 0; v < shaft_vertices.count; ++v) elsewhere.frame.position.col(v) += Vector3(0.5, 0.0, 0.0);
        elsewhere.frame.moved = std::vector<Range>{shaft_vertices};
        const ContactSet moved = answer(*detector, elsewhere.frame);
        elsewhere.frame.moved.reset();
        const std::vector<TrianglePair> expected = answer(*started(elsewhere, {}, false), elsewhere.frame).pairs;
        if (!moved.truncated) {
            EXPECT_EQ(moved.pairs, expected);
        }
    }
}

TEST(OhcIncremental, AReachOfManyCellsIsNotPutIntoCells) {
    World world = scenes().front();
    const std::unique_ptr<Detector> truth = make_detector("brute_force", {});
    truth->prepare(world.topology, world.frame);
    for (const bool incremental : {false, true}) {
        const std::unique_ptr<Detector> detector = started(world, {}, incremental);
        // Three ticks of a tool that flies by, and one at rest: with 8 m around it a triangle covers 10^8 cells.
        for (const double reach : {0.001, 8.0, 0.3, 0.001}) {
            ++world.frame.tick;
            ContactSet told;
            ContactSet expected;
            for (const auto& [method, contacts] : {std::pair{detector.get(), &told}, {truth.get(), &expected}}) {
                method->update(world.frame, reach);
                method->detect(world.frame, *contacts);
            }
            EXPECT_EQ(told.pairs, expected.pairs) << reach;
            EXPECT_EQ(told.near, expected.near) << reach;
            EXPECT_LT(told.work.cells_visited, 2'000'000) << reach << " " << incremental;
        }
    }
}

TEST(OhcIncremental, ABadFrameInBetweenLosesNothing) {
    World world = scenes().front();
    const auto detector = started(world, {});
    (void)answer(*detector, world.frame);
    std::mt19937 random(9);
    move_some(world, random, 1);
    Frame bad = world.frame;
    bad.position(0, 3) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(answer(*detector, bad).outcome.kind, OutcomeKind::not_finite);
    // The next frame tells what moved since the bad one only.
    world.frame.moved = std::vector<Range>{};
    EXPECT_EQ(answer(*detector, world.frame).pairs, answer(*started(world, {}, false), world.frame).pairs);
}

TEST(OhcIncremental, TwoUpdatesBeforeADetectAddUp) {
    World world = scenes().front();
    const auto detector = started(world, {});
    (void)answer(*detector, world.frame);
    std::mt19937 random(10);
    for (int k = 1; k < 4; ++k) {
        move_some(world, random, k);
        detector->update(world.frame, 0.0);
    }
    ContactSet contacts;
    detector->detect(world.frame, contacts);
    world.frame.moved.reset();
    EXPECT_EQ(contacts.pairs, answer(*started(world, {}, false), world.frame).pairs);
}

TEST(OhcIncremental, WhatRestsAddsNothingButTheLook) {
    World world = make_world("contact at rest, a sphere far away",
                             {{BodyKind::instrument, shaft(0.004, 0.1, 12, 30).move({0.001, 0.0003, -0.004})},
                              {BodyKind::instrument, sphere(0.01, 8).move({0.5, 0.0, 0.0})},
                              {BodyKind::tissue, slab(0.1, 0.01, 20).shake(0.0003, 3)}});
    const auto detector = started(world, {});
    const ContactSet first = answer(*detector, world.frame);
    ASSERT_GT(first.pairs.size(), 20U);
    ASSERT_GT(first.work.triangle_tests, 20);
    world.frame.previous = world.frame.position;

    const ContactSet compared = answer(*detector, world.frame);
    EXPECT_EQ(compared.pairs, first.pairs);
    EXPECT_EQ(compared.work.work(), world.topology.vertex_count) << "positions are compared, nothing more";

    world.frame.moved = std::vector<Range>{};
    const ContactSet told = answer(*detector, world.frame);
    EXPECT_EQ(told.pairs, first.pairs);
    EXPECT_EQ(told.work.work(), 0);

    const Range ball = world.topology.bodies[1].vertices;
    world.frame.moved = std::vector<Range>{ball};
    for (Index v = ball.first; v < ball.end(); ++v) world.frame.position.col(v) += Vector3(0.013, 0.0, 0.002);
    const ContactSet far = answer(*detector, world.frame);
    EXPECT_EQ(far.pairs, first.pairs);
    EXPECT_EQ(far.work.vertices_read, ball.count);
    EXPECT_EQ(far.work.box_tests, 0);
    EXPECT_EQ(far.work.triangle_tests, 0);

    // One vertex of the tissue near the tool: its six triangles or so, not the whole contact.
    const Index vertex = world.topology.triangles(0, first.pairs.front().b);
    world.frame.moved = std::vector<Range>{{vertex, 1}};
    world.frame.position.col(vertex) += Vector3(0.0001, 0.0, 0.0002);
    const ContactSet near = answer(*detector, world.frame);
    EXPECT_EQ(near.work.vertices_read, 1);
    EXPECT_GT(near.work.triangle_tests, 0);
    EXPECT_LT(near.work.work(), first.work.work() / 10);
    world.frame.moved.reset();
    EXPECT_EQ(near.pairs, answer(*started(world, {}, false), world.frame).pairs);
}

TEST(OhcIncremental, AllocatesNothingAfterTheFirstTicks) {
    std::vector<Frame> frames;
    World world = scenes().front();
    const World start = world;
    for (int tick = 0; tick < 4; ++tick) {
        frames.push_back(world.frame);
        for (Index v = 0; v < world.topology.bodies[0].vertices.end(); ++v) {
            world.frame.position.col(v) += Vector3(0.003, 0.001, -0.0004);
        }
    }
    const auto detector = started(start, {});
    ContactSet contacts;
    if (allocation_count() < 0) GTEST_SKIP() << "a sanitizer has replaced the allocator: nothing is counted";
    std::int64_t before = 0;
    for (std::size_t tick = 0; tick < 16; ++tick) {
        if (tick == 8) before = allocation_count();
        detector->update(frames[tick % 4], 0.0);
        detector->detect(frames[tick % 4], contacts);
    }
    EXPECT_EQ(allocation_count() - before, 0);
    EXPECT_FALSE(contacts.pairs.empty());
}

}  // namespace
}  // namespace trocar::test
