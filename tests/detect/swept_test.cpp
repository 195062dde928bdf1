// Contacts that begin between two frames: what the option `swept` of our detectors reports, against all pairs of the
// scene one by one and the integer oracle, and against times known in closed form.
#include "detect/swept.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "detect/answers.hpp"
#include "geometry/continuous.hpp"
#include "measure/allocations.hpp"
#include "support/world_triangles.hpp"

namespace trocar::test {
namespace {

ContactSet answer(const World& world, const std::string& name, Settings settings = {}) {
    settings.emplace("swept", "on");
    return first_answer(name, world, settings);
}

ContactSet plain_answer(const World& world, const std::string& name) { return answer(world, name, {{"swept", "off"}}); }

/// The body moves by `by` and turns by `angle` within the tick, ending where the world has it.
World& arriving(World& world, std::size_t body, const Vector3& by, double angle = 0.0) {
    const Range range = world.topology.bodies[body].vertices;
    const Matrix3 back = Eigen::AngleAxisd(-angle, Vector3(0.3, 0.2, 1.0).normalized()).toRotationMatrix();
    for (Index v = range.first; v < range.end(); ++v) {
        world.frame.previous.col(v) = back * world.frame.position.col(v) - by;
    }
    return world;
}

/// A ball that goes through a sheet at an angle, `length` within the tick.
World passing(double length, int ball, int tissue) {
    const Vector3 path = length * Vector3(1.0, 0.7, 0.9).normalized();
    World world = make_world(
        "pass", {{BodyKind::instrument, sphere(0.01, ball).move({0.5 * path[0], 0.5 * path[1], 0.5 * path[2]})},
                 {BodyKind::tissue, sheet(0.08, tissue).shake(0.0004, 1)}});
    arriving(world, 0, path);
    return world;
}

std::vector<World> fast_scenes() {
    std::vector<World> worlds;
    worlds.push_back(
        make_world("sphere through a sheet", {{BodyKind::instrument, sphere(0.01, 8).move({0.003, 0.001, -0.04})},
                                              {BodyKind::tissue, sheet(0.08, 8).shake(0.0004, 1)}}));
    arriving(worlds.back(), 0, {0.004, 0.001, -0.09}, 0.2);
    worlds.push_back(make_world("soups fly through each other", {{BodyKind::instrument, soup(60, 0.01, 0.04, 2)},
                                                                 {BodyKind::tissue, soup(70, 0.008, 0.04, 3)},
                                                                 {BodyKind::rigid, sheet(0.06, 4)}}));
    arriving(worlds.back(), 0, {0.01, -0.012, 0.007}, -0.4);
    arriving(worlds.back(), 1, {-0.002, 0.0, 0.004}, 0.1);
    worlds.push_back(make_world(
        "long triangles",
        {{BodyKind::instrument, shaft(0.004, 0.3, 8, 1).rotate({0.2, 1.0, 0.05}, 1.5).move({-0.15, 0.001, -0.02})},
         {BodyKind::tissue, sheet(0.06, 16).shake(0.0003, 7)}}));
    arriving(worlds.back(), 0, {0.002, 0.0, -0.02}, 0.03);
    worlds.push_back(make_world("far away", {{BodyKind::instrument, sphere(0.01, 6).move({1e4, -2e4, 1e4 - 0.03})},
                                             {BodyKind::tissue, sheet(0.05, 6).move({1e4, -2e4, 1e4})}}));
    arriving(worlds.back(), 0, {0.0, 0.002, -0.07});
    worlds.push_back(passing(1000.0, 3, 6));
    return worlds;
}

class Swept : public testing::TestWithParam<std::string> {};

TEST_P(Swept, ReportsEveryPairThatBeginsAndNoOther) {
    for (const World& world : fast_scenes()) {
        const std::vector<SweptContact> expected = beginnings_of_oracle(world);
        ASSERT_GT(expected.size(), 20U) << world.name;
        const ContactSet contacts = answer(world, GetParam());
        EXPECT_EQ(contacts.pairs, plain_answer(world, GetParam()).pairs) << world.name;
        ASSERT_EQ(contacts.swept.size(), expected.size()) << world.name;
        for (std::size_t k = 0; k < expected.size(); ++k) {
            const SweptContact& got = contacts.swept[k];
            ASSERT_EQ(got.a, expected[k].a) << world.name;
            ASSERT_EQ(got.b, expected[k].b) << world.name;
            EXPECT_EQ(got.body_a, expected[k].body_a);
            EXPECT_EQ(got.body_b, expected[k].body_b);
            EXPECT_EQ(got.time, expected[k].time);
            EXPECT_NE(got.kind, SweptKind::unset);
        }
    }
}

TEST_P(Swept, IsOffByDefaultAndSilentWhenNothingMoves) {
    EXPECT_TRUE(first_answer(GetParam(), fast_scenes().front()).swept.empty());
    const World world =
        make_world("rest", {{BodyKind::instrument, sphere(0.01, 8)}, {BodyKind::tissue, sheet(0.08, 8)}});
    const ContactSet resting = answer(world, GetParam());
    EXPECT_FALSE(resting.pairs.empty());
    EXPECT_TRUE(resting.swept.empty());
}

TEST_P(Swept, WithoutAFiniteFrameBeforeOnlyPairsAreReported) {
    World world = fast_scenes().front();
    const std::vector<TrianglePair> pairs = answer(world, GetParam()).pairs;
    world.frame.previous(2, 5) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(answer(world, GetParam()).pairs, pairs);
    EXPECT_TRUE(answer(world, GetParam()).swept.empty());
    world.frame.previous.resize(3, 0);
    EXPECT_EQ(answer(world, GetParam()).pairs, pairs);
    EXPECT_TRUE(answer(world, GetParam()).swept.empty());
}

TEST_P(Swept, PreparedAgainForgetsTheFrameBefore) {
    World world = fast_scenes().front();
    const auto detector = make_detector(GetParam(), {{"swept", "on"}});
    detector->prepare(world.topology, world.frame);
    const ContactSet before = tick(*detector, world.frame);
    ASSERT_FALSE(before.swept.empty());
    world.frame.previous = Matrix3X();
    detector->prepare(world.topology, world.frame);
    const ContactSet contacts = tick(*detector, world.frame);
    EXPECT_EQ(contacts.pairs, before.pairs);
    EXPECT_TRUE(contacts.swept.empty());
}

TEST_P(Swept, TipThroughASheetMeetsItAtTheKnownTime) {
    // The tip falls 8 mm within the tick from 6 mm above the sheet: contact after three quarters.
    World world = make_world(
        "tip", {{BodyKind::instrument, triangle({0.001, 0.002, -0.002}, {0.003, 0.002, 0.01}, {0.001, 0.004, 0.01})},
                {BodyKind::tissue, sheet(0.0625, 5)}});
    arriving(world, 0, {0.0, 0.0, -0.008});
    const ContactSet contacts = answer(world, GetParam());
    ASSERT_FALSE(contacts.swept.empty());
    double first = 1.0;
    for (const SweptContact& contact : contacts.swept) first = std::min(first, contact.time);
    EXPECT_NEAR(first, 0.75, 1e-12);
    EXPECT_EQ(std::count_if(contacts.swept.begin(), contacts.swept.end(),
                            [&](const SweptContact& c) { return c.time == first && c.kind == SweptKind::vertex_face; }),
              1);
}

TEST_P(Swept, AJumpOfAKilometreIsNoMoreWorkThanAPass) {
    const WorkCounters pass = answer(passing(0.2, 8, 24), GetParam()).work;
    const WorkCounters jump = answer(passing(1000.0, 8, 24), GetParam()).work;
    EXPECT_LE(jump.work(), 2 * pass.work());
    EXPECT_LE(jump.triangle_tests, 2 * pass.triangle_tests);
    const World world = passing(1000.0, 8, 24);
    const std::int64_t every_pair =
        std::int64_t{world.topology.bodies[0].triangles.count} * world.topology.bodies[1].triangles.count;
    EXPECT_LT(jump.triangle_tests, every_pair / 20);
}

TEST_P(Swept, LimitsAreKeptAndReported) {
    const World world = fast_scenes().front();
    const ContactSet whole = answer(world, GetParam());
    for (std::int64_t budget = 0; budget < 2 * whole.work.work(); budget += 1 + whole.work.work() / 23) {
        const ContactSet contacts = answer(world, GetParam(), {{"work_budget", std::to_string(budget)}});
        EXPECT_LE(contacts.work.work(), budget);
        if (!contacts.truncated) {
            EXPECT_EQ(contacts.swept.size(), whole.swept.size());
        }
    }
    const ContactSet enough = answer(world, GetParam(), {{"work_budget", "1e12"}});
    EXPECT_FALSE(enough.truncated);
    EXPECT_EQ(enough.swept.size(), whole.swept.size());
}

TEST(OhcSwept, APairIsAsMuchWorkWithoutLimitsAsUnderOneThatCutsNothing) {
    // Two paths through the code, of which the limited one spends a unit before each step. Budgets are chosen by the
    // work that runs without limits report.
    World world = make_world(
        "pair", {{BodyKind::instrument, triangle({0.001, 0.002, -0.002}, {0.003, 0.002, 0.01}, {0.001, 0.004, 0.01})},
                 {BodyKind::tissue, triangle({-0.01, -0.01, 0.0}, {0.02, -0.01, 0.0}, {-0.01, 0.02, 0.0})}});
    arriving(world, 0, {0.0, 0.0, -0.008});
    const ContactSet whole = answer(world, "ohc");
    ASSERT_EQ(whole.swept.size(), 1U);
    const ContactSet limited = answer(world, "ohc", {{"work_budget", "1e12"}});
    ASSERT_EQ(limited.swept.size(), 1U);
    ASSERT_FALSE(limited.truncated);
    EXPECT_EQ(whole.work.box_tests, limited.work.box_tests);
    EXPECT_EQ(whole.work.work(), limited.work.work());
}

TEST(FirstMeeting, OfOrdinaryMotionsIsFoundWithoutTheLastStage) {
    // Of all stages the last alone asks for memory: integers of any size, hundreds of times slower than the others.
    if (allocation_count() < 0) GTEST_SKIP() << "a sanitizer has replaced the allocator: nothing is counted";
    std::mt19937_64 random(17);
    std::uniform_real_distribution<double> place(-0.6, 0.6);
    const auto motion = [&](double speed) {
        const Vector3 by = speed * random_vector(place, random);
        MovingTriangle triangle;
        for (MovingPoint& point : triangle) {
            point.start = random_vector(place, random);
            point.end = point.start + by + 0.2 * random_vector(place, random);
        }
        return triangle;
    };
    int met = 0;
    int asked = 0;
    for (int n = 0; n < 600; ++n) {
        const MovingTriangle first = motion(3.0);
        const MovingTriangle second = motion(0.3);
        const std::int64_t before = allocation_count();
        const std::optional<FirstMeeting> meeting = first_meeting(first, second);
        asked += allocation_count() > before ? 1 : 0;
        met += meeting && meeting->kind != Meeting::overlap_at_start ? 1 : 0;
    }
    EXPECT_GT(met, 30);
    EXPECT_LT(10 * asked, met);
}

TEST(OhcSwept, NoSettingChangesTheAnswer) {
    for (const World& world : fast_scenes()) {
        const std::size_t expected = answer(world, "ohc").swept.size();
        for (const Settings& settings : std::vector<Settings>{
                 {{"cell", "0.0005"}}, {{"cell", "1"}}, {{"cell", "0.0031"}}, {{"hash", "teschner"}}}) {
            EXPECT_EQ(answer(world, "ohc", settings).swept.size(), expected) << world.name;
        }
    }
}

std::vector<std::string> detectors_with_the_option() {
    std::vector<std::string> names;
    for (const DetectorEntry& entry : registry().detectors()) {
        if (!entry.own) continue;
        for (const Parameter& parameter : entry.parameters) {
            if (parameter.name == "swept") names.push_back(entry.name);
        }
    }
    return names;
}
INSTANTIATE_TEST_SUITE_P(Every, Swept, testing::ValuesIn(detectors_with_the_option()),
                         [](const auto& method) { return method.param; });

}  // namespace
}  // namespace trocar::test
