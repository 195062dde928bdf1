// Detectors that take turns are judged before they are timed: one that forgets, invents, throws or is cut off becomes a
// wrong or failed run. Detectors that lie are made here.
#include "simulate/interleaved.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "measure/pair_truth.hpp"
#include "method/registry.hpp"

namespace trocar {
namespace {

constexpr std::int64_t most_ticks = 32;

RunSpec spec_of(const std::string& detector, const std::string& contacts, std::int64_t ticks) {
    RunSpec spec;
    spec.mode = "replay";
    spec.detector = detector;
    spec.contacts = contacts;
    spec.ticks = ticks;
    return spec;
}

using Spoil = std::function<void(std::int64_t, ContactSet&)>;

/// Answers from the oracle, then spoils the answer.
class Spoiled final : public Detector {
public:
    explicit Spoiled(Spoil spoil) : spoil_(std::move(spoil)) {}
    void prepare(const Topology& topology, const Frame& /*frame*/) override { topology_ = &topology; }
    void update(const Frame& /*frame*/, double query_distance) override { query_distance_ = query_distance; }
    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        true_pairs(*topology_, frame, contacts.pairs);
        if (query_distance_ > 0.0) true_near_pairs(*topology_, frame, query_distance_, contacts.near);
        spoil_(frame.tick, contacts);
    }

private:
    Spoil spoil_;
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;
};

InterleavedRun run_of(Spoil spoil, const std::string& contacts = {}) {
    return {.spec = spec_of("", contacts, most_ticks), .claims_exact = true, .make = [spoil = std::move(spoil)] {
                return std::make_unique<Spoiled>(spoil);
            }};
}
InterleavedRun honest(const std::string& contacts = {}) {
    return run_of([](std::int64_t, ContactSet&) {}, contacts);
}

std::vector<Record> measured(const std::vector<InterleavedRun>& runs) {
    const InstrumentInTissue scene({.tissue_triangles = 2000, .instrument_triangles = 500});
    return run_interleaved(scene, runs);
}

TEST(Interleaved, AnHonestDetectorIsExactAndHasEveryTick) {
    const std::vector<Record> records = measured({honest(), honest()});
    const Record& record = records.at(0);
    EXPECT_TRUE(record.outcome.ok());
    EXPECT_EQ(value_of(record.summary, Metric::differing_ticks), 0.0);
    ASSERT_EQ(record.rows.size(), static_cast<std::size_t>(most_ticks));
    EXPECT_EQ(value_of(record.summary, Metric::timed_ticks), static_cast<double>(most_ticks));
    EXPECT_EQ(value_of(record.summary, Metric::judged_ticks), static_cast<double>(interleaved_blocks));
    EXPECT_GT(value_of(record.summary, Metric::true_pairs), 0.0);
    EXPECT_GT(value_of(record.summary, Metric::prepare_ns), 0.0);
    EXPECT_EQ(value_of(record.summary, Metric::false_negatives), 0.0);
    for (std::size_t i = 1; i < record.rows.size(); ++i) EXPECT_LT(record.rows[i - 1].tick, record.rows[i].tick);
    for (const StepRow& row : record.rows) EXPECT_GT(row.stage_ns[static_cast<std::size_t>(Stage::detect)], 0);
    EXPECT_EQ(records.at(1).frames_hash, record.frames_hash);
}

TEST(Interleaved, AForgottenPairAndAnInventedOneAreCounted) {
    const std::vector<Record> records =
        measured({run_of([](std::int64_t, ContactSet& contacts) { contacts.pairs.pop_back(); }),
                  run_of([](std::int64_t, ContactSet& contacts) {
                      contacts.pairs.insert(contacts.pairs.begin(), {0, 700});
                  })});
    const auto judged = static_cast<double>(interleaved_blocks);
    EXPECT_EQ(value_of(records.at(0).summary, Metric::false_negatives), judged);
    EXPECT_EQ(value_of(records.at(0).summary, Metric::false_positives), 0.0);
    EXPECT_EQ(value_of(records.at(1).summary, Metric::false_negatives), 0.0);
    EXPECT_EQ(value_of(records.at(1).summary, Metric::false_positives), judged);
    // With no honest one beside them, only the ticks with truth are known to differ.
    EXPECT_EQ(value_of(records.at(0).summary, Metric::differing_ticks), judged);
}

TEST(Interleaved, NearPairsAreAskedForAndJudgedWithAQueryDistanceOnly) {
    const Spoil forget = [](std::int64_t, ContactSet& contacts) {
        if (!contacts.near.empty()) contacts.near.pop_back();
    };
    const Spoil forget_at_times = [forget](std::int64_t tick, ContactSet& contacts) {
        if (tick % 5 == 1) forget(tick, contacts);
    };
    const std::vector<Record> records =
        measured({honest("tracked_proximity"), run_of(forget), run_of(forget, "tracked_proximity"),
                  run_of(forget_at_times, "tracked_proximity")});
    EXPECT_GT(value_of(records.at(0).summary, Metric::true_proximity_pairs), 20.0 * interleaved_blocks);
    EXPECT_EQ(value_of(records.at(0).summary, Metric::differing_ticks), 0.0);
    EXPECT_GT(value_of(records.at(0).summary, Metric::query_distance_median_m), 0.0);
    EXPECT_EQ(value_of(records.at(1).summary, Metric::differing_ticks), 0.0);
    EXPECT_TRUE(std::isnan(value_of(records.at(1).summary, Metric::query_distance_median_m)));
    EXPECT_EQ(value_of(records.at(2).summary, Metric::proximity_false_negatives),
              static_cast<double>(interleaved_blocks));
    EXPECT_EQ(value_of(records.at(2).summary, Metric::differing_ticks), static_cast<double>(most_ticks));
    EXPECT_GT(value_of(records.at(3).summary, Metric::differing_ticks), 0.0);
}

TEST(Interleaved, ALieBetweenTheTicksWithTruthIsSeenBesideAnHonestDetector) {
    // Truth is computed on the first of 4 ticks a block (4, 9, 14 …); the lie comes one tick later.
    const std::vector<Record> records = measured({honest(), run_of([](std::int64_t tick, ContactSet& contacts) {
                                                      if (tick % 5 == 0) contacts.pairs.pop_back();
                                                  })});
    EXPECT_EQ(value_of(records.at(0).summary, Metric::differing_ticks), 0.0);
    EXPECT_EQ(value_of(records.at(1).summary, Metric::false_negatives), 0.0);
    EXPECT_EQ(value_of(records.at(1).summary, Metric::differing_ticks), static_cast<double>(interleaved_blocks));
}

TEST(Interleaved, FailuresBecomeOutcomesAndHarmNoOther) {
    const std::vector<Record> records =
        measured({run_of([](std::int64_t tick, ContactSet&) {
                      if (tick > 10) throw std::runtime_error("a library's own");
                  }),
                  run_of([](std::int64_t, ContactSet& contacts) { contacts.truncated = true; }),
                  run_of([](std::int64_t, ContactSet& contacts) {
                      contacts.outcome = {OutcomeKind::unsupported, "no"};
                  }),
                  honest()});
    EXPECT_EQ(records.at(0).outcome.kind, OutcomeKind::threw);
    EXPECT_EQ(records.at(0).outcome.message, "a library's own");
    EXPECT_EQ(records.at(1).outcome.kind, OutcomeKind::unsupported);
    EXPECT_EQ(records.at(2).outcome.kind, OutcomeKind::unsupported);
    EXPECT_EQ(records.at(2).outcome.message, "no");
    EXPECT_TRUE(records.at(3).outcome.ok());
    EXPECT_EQ(records.at(3).rows.size(), static_cast<std::size_t>(most_ticks));
}

TEST(Interleaved, EveryTurnIsAnnouncedSoThatACrashHasAName) {
    std::set<std::size_t> turns;
    const InstrumentInTissue scene({.tissue_triangles = 2000, .instrument_triangles = 500});
    const std::vector<InterleavedRun> runs{honest(), honest()};
    run_interleaved(scene, runs, [&turns](std::size_t turn) { turns.insert(turn); });
    EXPECT_EQ(turns, (std::set<std::size_t>{0, 1}));
}

TEST(Interleaved, DetectorsThatClaimExactnessAreExactOnEveryKindOfScene) {
    std::vector<InterleavedRun> runs;
    for (const DetectorEntry& entry : registry().detectors()) {
        if (entry.control || !entry.claims_exact) continue;
        runs.push_back(interleaved_run(spec_of(entry.name, "", 16)));
        if (!entry.query_distance) continue;
        runs.push_back(interleaved_run(spec_of(entry.name, "tracked_proximity", 16)));
    }
    ASSERT_FALSE(runs.empty());
    for (const std::string variant : {"light", "deep", "near", "rotating", "strain", "local"}) {
        const auto scene = make_generated_scene(
            "instrument_in_tissue:instrument_triangles=500,tissue_triangles=2000,variant=" + variant);
        for (const Record& record : run_interleaved(*scene, runs)) {
            SCOPED_TRACE(record.spec.detector + ", " + variant);
            EXPECT_TRUE(record.outcome.ok()) << record.outcome.message;
            EXPECT_EQ(value_of(record.summary, Metric::differing_ticks), 0.0);
            EXPECT_EQ(value_of(record.summary, Metric::false_negatives), 0.0);
            EXPECT_EQ(value_of(record.summary, Metric::false_positives), 0.0);
        }
    }
}

}  // namespace
}  // namespace trocar
