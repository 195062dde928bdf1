// The space-time oracle against closed forms and against every pair asked one after the other.
#include "measure/space_time.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "measure/metrics.hpp"
#include "measure/record.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"
#include "support/world_triangles.hpp"

namespace trocar::test {
namespace {

constexpr double dt = 0.001;

/// A plate 1 mm thick above a sheet; goes down `step` m per tick, from `height` of its underside over the sheet.
class FallingPlate {
public:
    FallingPlate(double height, double step)
        : world_(make_world("plate",
                            {{BodyKind::instrument,
                              slab(0.004, 0.001, 1).rotate({0, 0, 1}, 0.3).move({0.0013, 0.0007, 0.001 + height})},
                             {BodyKind::tissue, sheet(0.02, 3)}})),
          step_(step) {
        world_.frame.previous = world_.frame.position;
    }
    [[nodiscard]] const World& world() const { return world_; }
    void fall() {
        world_.frame.previous = world_.frame.position;
        const Range v = world_.topology.bodies[0].vertices;
        world_.frame.position.middleCols(v.first, v.count).row(2).array() -= step_;
        ++world_.frame.tick;
        world_.frame.time = static_cast<double>(world_.frame.tick) * dt;
    }

private:
    World world_;
    double step_;
};

/// What a perfect detector that examines the frame alone would say.
ContactSet discrete(const World& world) {
    ContactSet contacts;
    contacts.pairs = pairs_of_oracle(world);
    return contacts;
}

/// The one event that these ticks of the plate show to such a detector; `look` sees every tick.
ContactEvent event_of(FallingPlate plate, int ticks,
                      const std::function<void(int, const SpaceTimeTruth&, const ContactSet&)>& look) {
    SpaceTimeTruth truth(plate.world().topology);
    ContactEvents events(plate.world().topology);
    for (int tick = 0; tick < ticks; ++tick) {
        if (tick > 0) plate.fall();
        EXPECT_TRUE(truth.measure(plate.world().frame));
        const ContactSet contacts = discrete(plate.world());
        look(tick, truth, contacts);
        events.follow(plate.world().frame, dt, truth, contacts);
    }
    EXPECT_EQ(events.events().size(), 1U);
    return events.events().empty() ? ContactEvent() : events.events().front();
}

TEST(SpaceTime, PlateThroughASheetWithinATickIsAMissForWhoSearchesAtFrames) {
    // Underside 0.9 mm above, 4 mm a tick: touches after 0.225 of the tick, is through after 0.475.
    const FallingPlate plate(0.0009, 0.004);
    const auto look = [&plate](int tick, const SpaceTimeTruth& truth, const ContactSet& contacts) {
        EXPECT_TRUE(contacts.pairs.empty());
        StepRow row;
        judge_swept(plate.world().topology, truth, contacts, row);
        EXPECT_EQ(row.swept_false_negatives, row.true_swept);
        EXPECT_EQ(row.true_swept > 0, tick == 1);
    };
    const ContactEvent event = event_of(plate, 4, look);
    EXPECT_NEAR(event.begin, 0.225 * dt, 1e-12);
    EXPECT_NEAR(event.end, 0.475 * dt, 1e-12);
    EXPECT_TRUE(event.missed());
    const auto figures = summarize(std::vector{event});
    EXPECT_EQ(figures.at(Metric::contact_events), 1.0);
    EXPECT_EQ(figures.at(Metric::contact_events_missed), 1.0);
    EXPECT_TRUE(std::isnan(figures.at(Metric::onset_latency_max_s)));
}

TEST(SpaceTime, SlowPlateIsSeenAndItsOnsetLatencyIsKnown) {
    // 0.4 mm a tick from 0.9 mm: touches at 2.25 ticks, is through at 4.75; frames 3 and 4 show it.
    const auto look = [](int tick, const SpaceTimeTruth& truth, const ContactSet& contacts) {
        EXPECT_EQ(!contacts.pairs.empty(), tick == 3 || tick == 4);
        EXPECT_EQ(truth.body_pairs().front().at_end, !contacts.pairs.empty());
    };
    const ContactEvent event = event_of(FallingPlate(0.0009, 0.0004), 8, look);
    EXPECT_NEAR(event.begin, 2.25 * dt, 1e-12);
    EXPECT_NEAR(event.end, 4.75 * dt, 1e-12);
    EXPECT_NEAR(event.seen, 3.0 * dt, 1e-15);
    EXPECT_NEAR(summarize(std::vector{event}).at(Metric::onset_latency_max_s), 0.75 * dt, 1e-12);
}

TEST(SpaceTime, ContactThatLastsToTheEndOfTheRunHasNoEnd) {
    const ContactEvent event =
        event_of(FallingPlate(-0.0003, 0.0), 3,
                 [](int, const SpaceTimeTruth& truth, const ContactSet&) { EXPECT_TRUE(truth.beginnings().empty()); });
    EXPECT_EQ(event.begin, 0.0);
    EXPECT_EQ(event.seen, 0.0);
    EXPECT_TRUE(std::isnan(event.end));
}

TEST(SpaceTime, FrameThatIsNotFiniteReportsNothing) {
    FallingPlate plate(0.001, 0.001);
    World world = plate.world();
    SpaceTimeTruth truth(world.topology);
    world.frame.previous(1, 2) = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(truth.measure(world.frame));
    EXPECT_TRUE(truth.beginnings().empty());
}

TEST(SpaceTime, BeginningsAreThoseOfTheIntegerOracle) {
    // Small whole numbers: degenerate sets and simultaneous events abound.
    std::mt19937 random(17);
    std::uniform_int_distribution<int> number(-8, 8);
    std::size_t begun = 0;
    for (int round = 0; round < 30; ++round) {
        World world = make_world(
            "soups", {{BodyKind::instrument, soup(12, 4.0, 8.0, 5)}, {BodyKind::tissue, soup(12, 4.0, 8.0, 6)}});
        for (Matrix3X* matrix : {&world.frame.position, &world.frame.previous}) {
            for (Index v = 0; v < world.topology.vertex_count; ++v) {
                // Small triangles on long paths: the other corners stay near the first.
                const Vector3 drawn = random_vector(number, random);
                matrix->col(v) = v % 3 == 0 ? drawn : Vector3(matrix->col(v - v % 3) + drawn / 4);
            }
        }
        SpaceTimeTruth truth(world.topology);
        ASSERT_TRUE(truth.measure(world.frame));
        const std::vector<SweptContact> expected = beginnings_of_oracle(world);
        ASSERT_EQ(truth.beginnings().size(), expected.size()) << round;
        for (std::size_t k = 0; k < expected.size(); ++k) {
            const SweptContact& found = truth.beginnings()[k];
            EXPECT_EQ(std::pair(found.a, found.b), std::pair(expected[k].a, expected[k].b)) << round;
            EXPECT_EQ(found.time, expected[k].time) << round;
        }
        begun += expected.size();
    }
    EXPECT_GT(begun, 30U);
}

TEST(JudgeSwept, CountsWhatIsNotReportedAndWhatIsNotTrue) {
    FallingPlate plate(0.0009, 0.004);
    plate.fall();
    SpaceTimeTruth truth(plate.world().topology);
    ASSERT_TRUE(truth.measure(plate.world().frame));
    const auto count = static_cast<std::int64_t>(truth.beginnings().size());
    ASSERT_GT(count, 4);
    ContactSet contacts;
    contacts.swept = truth.beginnings();
    contacts.swept[1].time += 0.125;
    contacts.swept.erase(contacts.swept.begin());
    contacts.swept.push_back({.a = 0, .b = 1000, .body_a = 0, .body_b = 1, .time = 0.5});
    StepRow row;
    judge_swept(plate.world().topology, truth, contacts, row);
    EXPECT_EQ(row.true_swept, count);
    EXPECT_EQ(row.swept_false_negatives, 1);
    EXPECT_EQ(row.swept_false_positives, 1);
    EXPECT_NEAR(row.swept_time_error, 0.125, 1e-12);

    // A library that knows bodies only reports all of them at once; its time is that of the first.
    contacts.swept = {{.body_a = 0, .body_b = 1, .time = 0.25}};
    StepRow by_bodies;
    judge_swept(plate.world().topology, truth, contacts, by_bodies);
    EXPECT_EQ(by_bodies.swept_false_negatives, 0);
    EXPECT_EQ(by_bodies.swept_false_positives, 0);
    EXPECT_NEAR(by_bodies.swept_time_error, 0.025, 1e-12);
}

TEST(Record, EventsComeBackFromTheirLine) {
    Record record;
    record.spec.mode = "replay";
    record.spec.between_ticks = true;
    record.events = {{.body_a = 0, .body_b = 2, .begin = 0.1, .end = 0.30000000000000004, .seen = 0.2},
                     {.body_a = 1, .body_b = 2, .begin = 0.5}};
    record.rows.resize(1);
    record.rows[0].tick = 0;
    record.rows[0].true_swept = 3;
    record.rows[0].swept_false_negatives = 2;
    record.rows[0].swept_time_error = 0.5;
    const Record back = record_from_json_line(to_json_line(record), "file", 1);
    EXPECT_TRUE(back.spec.between_ticks);
    ASSERT_EQ(back.events.size(), 2U);
    EXPECT_EQ(back.events[0].end, 0.30000000000000004);
    EXPECT_EQ(back.events[1].body_a, 1);
    EXPECT_TRUE(back.events[1].missed());
    EXPECT_TRUE(std::isnan(back.events[1].end));
    EXPECT_EQ(back.rows[0].swept_false_negatives, 2);
    EXPECT_EQ(back.rows[0].swept_time_error, 0.5);
    EXPECT_EQ(to_json_line(back), to_json_line(record));
    record.spec.between_ticks = false;
    EXPECT_EQ(to_json_line(record).find("between_ticks"), std::string::npos);
}

}  // namespace
}  // namespace trocar::test
