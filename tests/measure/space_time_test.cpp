// The space-time oracle against closed forms and against dense sampling of the motion with the exact static test.
#include "measure/space_time.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/exact.hpp"
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

TEST(SpaceTime, PlateThroughASheetWithinATickIsAMissForWhoSearchesAtFrames) {
    // Underside 0.9 mm above, 4 mm a tick: touches after 0.225 of the tick, is through after 0.475.
    FallingPlate plate(0.0009, 0.004);
    SpaceTimeTruth truth(plate.world().topology);
    ContactEvents events(plate.world().topology);
    for (int tick = 0; tick < 4; ++tick) {
        if (tick > 0) plate.fall();
        ASSERT_TRUE(truth.measure(plate.world().frame));
        const ContactSet contacts = discrete(plate.world());
        EXPECT_TRUE(contacts.pairs.empty());
        events.follow(plate.world().frame, dt, truth, contacts);
        StepRow row;
        judge_swept(plate.world().topology, truth, contacts, row);
        EXPECT_EQ(row.swept_false_negatives, row.true_swept);
        EXPECT_EQ(row.true_swept > 0, tick == 1);
    }
    ASSERT_EQ(events.events().size(), 1U);
    const ContactEvent& event = events.events().front();
    EXPECT_NEAR(event.begin, 0.225 * dt, 1e-12);
    EXPECT_NEAR(event.end, 0.475 * dt, 1e-12);
    EXPECT_TRUE(event.missed());
    const auto figures = summarize(events.events());
    EXPECT_EQ(figures.at(Metric::contact_events), 1.0);
    EXPECT_EQ(figures.at(Metric::contact_events_missed), 1.0);
    EXPECT_TRUE(std::isnan(figures.at(Metric::onset_latency_max_s)));
}

TEST(SpaceTime, SlowPlateIsSeenAndItsOnsetLatencyIsKnown) {
    // 0.4 mm a tick from 0.9 mm: touches at 2.25 ticks, is through at 4.75; frames 3 and 4 show it.
    FallingPlate plate(0.0009, 0.0004);
    SpaceTimeTruth truth(plate.world().topology);
    ContactEvents events(plate.world().topology);
    for (int tick = 0; tick < 8; ++tick) {
        if (tick > 0) plate.fall();
        ASSERT_TRUE(truth.measure(plate.world().frame));
        const ContactSet contacts = discrete(plate.world());
        EXPECT_EQ(!contacts.pairs.empty(), tick == 3 || tick == 4);
        EXPECT_EQ(truth.body_pairs().front().at_end, !contacts.pairs.empty());
        events.follow(plate.world().frame, dt, truth, contacts);
    }
    ASSERT_EQ(events.events().size(), 1U);
    const ContactEvent& event = events.events().front();
    EXPECT_NEAR(event.begin, 2.25 * dt, 1e-12);
    EXPECT_NEAR(event.end, 4.75 * dt, 1e-12);
    EXPECT_NEAR(event.seen, 3.0 * dt, 1e-15);
    EXPECT_NEAR(summarize(events.events()).at(Metric::onset_latency_max_s), 0.75 * dt, 1e-12);
}

TEST(SpaceTime, ContactThatLastsToTheEndOfTheRunHasNoEnd) {
    FallingPlate plate(-0.0003, 0.0);
    SpaceTimeTruth truth(plate.world().topology);
    ContactEvents events(plate.world().topology);
    for (int tick = 0; tick < 3; ++tick) {
        if (tick > 0) plate.fall();
        ASSERT_TRUE(truth.measure(plate.world().frame));
        EXPECT_TRUE(truth.beginnings().empty());
        events.follow(plate.world().frame, dt, truth, discrete(plate.world()));
    }
    ASSERT_EQ(events.events().size(), 1U);
    EXPECT_EQ(events.events().front().begin, 0.0);
    EXPECT_EQ(events.events().front().seen, 0.0);
    EXPECT_TRUE(std::isnan(events.events().front().end));
}

TEST(SpaceTime, FrameThatIsNotFiniteReportsNothing) {
    FallingPlate plate(0.001, 0.001);
    World world = plate.world();
    SpaceTimeTruth truth(world.topology);
    world.frame.previous(1, 2) = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(truth.measure(world.frame));
    EXPECT_TRUE(truth.beginnings().empty());
}

TEST(SpaceTime, SeesWhatDenseSamplingOfTheMotionSees) {
    // Coordinates are small whole numbers, so that places at n/64 of the tick are exact.
    std::mt19937 random(17);
    std::uniform_int_distribution<int> number(-8, 8);
    int begun = 0;
    for (int round = 0; round < 30; ++round) {
        World world = make_world(
            "soups", {{BodyKind::instrument, soup(12, 4.0, 8.0, 5)}, {BodyKind::tissue, soup(12, 4.0, 8.0, 6)}});
        for (Matrix3X* matrix : {&world.frame.position, &world.frame.previous}) {
            for (Index v = 0; v < world.topology.vertex_count; ++v) {
                matrix->col(v) = random_vector(number, random);
            }
        }
        // Small triangles on long paths: the other corners stay near the first.
        for (Index t = 0; t < world.topology.triangle_count(); ++t) {
            for (int k = 1; k < 3; ++k) {
                for (Matrix3X* matrix : {&world.frame.position, &world.frame.previous}) {
                    const Vector3 corner = matrix->col(world.topology.triangles(0, t));
                    matrix->col(world.topology.triangles(k, t)) = corner + random_vector(number, random) / 4;
                }
            }
        }
        SpaceTimeTruth truth(world.topology);
        ASSERT_TRUE(truth.measure(world.frame));
        const auto corners = [&world](Index t, double moment) {
            Corners result;
            for (int k = 0; k < 3; ++k) {
                const Index v = world.topology.triangles(k, t);
                result[static_cast<std::size_t>(k)] =
                    (1.0 - moment) * world.frame.previous.col(v) + moment * world.frame.position.col(v);
            }
            return result;
        };
        for (Index a = 0; a < 12; ++a) {
            for (Index b = 12; b < 24; ++b) {
                const SweptContact* found = nullptr;
                for (const SweptContact& begin : truth.beginnings()) {
                    if (begin.a == a && begin.b == b) found = &begin;
                }
                const bool at_start = oracle_intersect(corners(a, 0.0), corners(b, 0.0));
                ASSERT_FALSE(at_start && found != nullptr);
                begun += found != nullptr ? 1 : 0;
                for (int n = 1; n <= 64 && !at_start; ++n) {
                    if (!triangles_intersect(corners(a, n / 64.0), corners(b, n / 64.0))) continue;
                    ASSERT_NE(found, nullptr) << a << " " << b << " at " << n;
                    ASSERT_LE(found->time, n / 64.0);
                    break;
                }
            }
        }
    }
    EXPECT_GT(begun, 30);
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
