// The benchmark judges answers before it times them: whoever forgets, invents, throws or is cut off becomes a failed
// row. Methods that lie are made here.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "bench/measurement.hpp"
#include "bench/scenes.hpp"
#include "measure/pair_truth.hpp"

namespace trocar::bench {
namespace {

/// Answers from the oracle, then `spoil`s the answer.
class Spoiled final : public Detector {
public:
    explicit Spoiled(std::function<void(std::int64_t, ContactSet&)> spoil) : spoil_(std::move(spoil)) {}
    void prepare(const Topology& topology, const Frame& /*frame*/) override { topology_ = &topology; }
    void update(const Frame& /*frame*/, double query_distance) override { query_distance_ = query_distance; }
    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        true_pairs(*topology_, frame, contacts.pairs);
        if (query_distance_ > 0.0) true_near_pairs(*topology_, frame, query_distance_, contacts.near);
        spoil_(frame.tick, contacts);
    }

private:
    std::function<void(std::int64_t, ContactSet&)> spoil_;
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;
};

Method method(const std::string& label, std::function<void(std::int64_t, ContactSet&)> spoil) {
    Method result;
    result.label = label;
    result.claims_exact = true;
    result.make = [spoil = std::move(spoil)] { return std::make_unique<Spoiled>(spoil); };
    return result;
}

CellMeasurement measured(const std::vector<Method>& list, std::int64_t most_steps = 32) {
    const ContactScene scene({.tissue_triangles = 2000, .instrument_triangles = 500});
    const FrameMaker frames{&scene.topology(), [&scene](std::int64_t step, Frame& frame) { scene.write(step, frame); }};
    return measure(frames, list, {.budget_s = 10.0, .most_steps = most_steps, .query_distance = 0.001});
}

TEST(BenchMeasurement, TruthfulMethodsAreExactAndHaveEveryStep) {
    const CellMeasurement cell = measured({method("truth", [](std::int64_t, ContactSet&) {})});
    const MethodResult& row = cell.methods.at(0);
    EXPECT_TRUE(row.exact());
    EXPECT_EQ(row.step.size(), 32U);
    EXPECT_EQ(row.cold_ns.size(), static_cast<std::size_t>(block_count));
    EXPECT_EQ(row.truth_steps, block_count);
    EXPECT_GT(row.true_pairs, 0);
    EXPECT_TRUE(std::is_sorted(row.step.begin(), row.step.end()));
    for (std::size_t i = 0; i < row.step.size(); ++i) {
        EXPECT_GT(row.wall_ns[i], 0);
        EXPECT_GT(row.detect_ns[i], 0);
    }
}

TEST(BenchMeasurement, AForgottenPairIsCounted) {
    const CellMeasurement cell =
        measured({method("forgets", [](std::int64_t, ContactSet& contacts) { contacts.pairs.pop_back(); })});
    EXPECT_FALSE(cell.methods.at(0).exact());
    EXPECT_EQ(cell.methods.at(0).false_negatives, cell.methods.at(0).truth_steps);
    EXPECT_EQ(cell.methods.at(0).false_positives, 0);
}

TEST(BenchMeasurement, NearPairsAreAskedForAndJudgedInRowsWithinQueryDistanceOnly) {
    const auto within = [](Method asked) {
        asked.within_query_distance = true;
        return asked;
    };
    const auto nothing = [](std::int64_t, ContactSet&) {};
    const auto forget = [](std::int64_t, ContactSet& contacts) {
        if (!contacts.near.empty()) contacts.near.pop_back();
    };
    const auto forget_at_times = [](std::int64_t tick, ContactSet& contacts) {
        if (tick % 5 == 1 && !contacts.near.empty()) contacts.near.pop_back();
    };
    const CellMeasurement cell =
        measured({within(method("truth", nothing)), method("forgets, not asked", forget),
                  within(method("forgets", forget)), within(method("forgets at times", forget_at_times))});
    EXPECT_GT(cell.true_near_pairs, 20);
    EXPECT_TRUE(cell.methods.at(0).exact());
    EXPECT_NEAR(static_cast<double>(cell.methods.at(0).near_pairs), static_cast<double>(cell.true_near_pairs), 20.0);
    EXPECT_TRUE(cell.methods.at(1).exact());
    EXPECT_EQ(cell.methods.at(1).near_pairs, 0);
    EXPECT_EQ(cell.methods.at(2).false_negatives, cell.methods.at(2).truth_steps);
    EXPECT_GT(cell.methods.at(3).differing_steps, 0);
}

TEST(BenchMeasurement, AnInventedPairIsCounted) {
    const CellMeasurement cell = measured({method("invents", [](std::int64_t, ContactSet& contacts) {
        contacts.pairs.insert(contacts.pairs.begin(), {0, 700});
    })});
    EXPECT_FALSE(cell.methods.at(0).exact());
    EXPECT_EQ(cell.methods.at(0).false_negatives, 0);
    EXPECT_EQ(cell.methods.at(0).false_positives, cell.methods.at(0).truth_steps);
}

TEST(BenchMeasurement, ALieBetweenTheStepsThatTruthSearchesAtIsSeenBesideAnHonestOne) {
    // Truth examines the first of 4 steps a block (the numbers 4, 9, 14 …); the lie is reported one step later.
    const CellMeasurement cell = measured(
        {method("truth", [](std::int64_t, ContactSet&) {}), method("sly", [](std::int64_t tick, ContactSet& contacts) {
             if (tick % 5 == 0) contacts.pairs.pop_back();
         })});
    EXPECT_TRUE(cell.methods.at(0).exact());
    EXPECT_EQ(cell.methods.at(1).false_negatives, 0);
    EXPECT_EQ(cell.methods.at(1).differing_steps, block_count);
    EXPECT_FALSE(cell.methods.at(1).exact());
}

TEST(BenchMeasurement, FailuresBecomeOutcomesAndHarmNobodyElse) {
    const CellMeasurement cell =
        measured({method("throws",
                         [](std::int64_t tick, ContactSet&) {
                             if (tick > 10) throw std::runtime_error("a library's own");
                         }),
                  method("cut", [](std::int64_t, ContactSet& contacts) { contacts.truncated = true; }),
                  method("gives up",
                         [](std::int64_t, ContactSet& contacts) {
                             contacts.outcome = {OutcomeKind::unsupported, "no"};
                         }),
                  method("truth", [](std::int64_t, ContactSet&) {})});
    EXPECT_EQ(cell.methods.at(0).outcome.kind, OutcomeKind::threw);
    EXPECT_EQ(cell.methods.at(0).outcome.message, "a library's own");
    EXPECT_EQ(cell.methods.at(1).outcome.kind, OutcomeKind::unsupported);
    EXPECT_EQ(cell.methods.at(2).outcome.kind, OutcomeKind::unsupported);
    EXPECT_TRUE(cell.methods.at(3).exact());
    EXPECT_EQ(cell.methods.at(3).step.size(), 32U);
}

TEST(BenchMeasurement, RegisteredDetectorsTakePartWithoutBeingNamed) {
    std::vector<Missing> missing;
    const std::vector<Method> list = methods(registry(), missing);
    for (const DetectorEntry& entry : registry().detectors()) {
        const bool takes_part = std::any_of(list.begin(), list.end(),
                                            [&entry](const Method& method) { return method.method == entry.name; });
        EXPECT_EQ(takes_part, !entry.control) << entry.name;
    }
    for (const AbsentMethod& absent : registry().absent_detectors()) {
        EXPECT_TRUE(std::any_of(missing.begin(), missing.end(), [&absent](const Missing& entry) {
            return entry.name == absent.name;
        })) << absent.name;
    }
}

TEST(BenchMeasurement, EverySettingOfTheSearchesCanBeMadeAndHoldsDefaultAndRecommended) {
    for (const Search& search : searches(0.001)) {
        const auto& all = registry().detectors();
        const auto entry =
            std::find_if(all.begin(), all.end(), [&](const DetectorEntry& e) { return e.name == search.name; });
        std::vector<std::string> tried = search.tried;
        for (const std::string& named : {search.name, search.library_default}) {
            EXPECT_EQ(std::count(tried.begin(), tried.end(), named), 1) << named;
        }
        std::sort(tried.begin(), tried.end());
        EXPECT_EQ(std::adjacent_find(tried.begin(), tried.end()), tried.end()) << search.name;
        if (entry == all.end()) continue;  // absent here
        for (const std::string& method : tried) EXPECT_NE(method_of(method).make(), nullptr) << method;
    }
}

TEST(BenchMeasurement, DetectorsThatClaimExactnessAreExactOnEveryKindOfScene) {
    std::vector<Missing> missing;
    std::vector<Method> list = methods(registry(), missing);
    std::erase_if(list, [](const Method& entry) { return !entry.claims_exact || entry.part != Part::everywhere; });
    ASSERT_FALSE(list.empty());
    for (std::size_t k = list.size(); k-- > 0;) {
        if (!list[k].query_distance) continue;
        list.push_back(list[k]);
        list.back().label += ", within the query distance";
        list.back().within_query_distance = true;
    }
    for (const Variant variant :
         {Variant::light, Variant::deep, Variant::near, Variant::rotating, Variant::strain, Variant::local}) {
        const ContactScene scene({.variant = variant, .tissue_triangles = 2000, .instrument_triangles = 500});
        const FrameMaker frames{&scene.topology(),
                                [&scene](std::int64_t step, Frame& frame) { scene.write(step, frame); }};
        for (const MethodResult& row :
             measure(frames, list, {.budget_s = 0.05, .most_steps = 16, .query_distance = 0.0005}).methods) {
            EXPECT_TRUE(row.exact()) << row.label << ", " << scene.spec().name() << ": missing " << row.false_negatives
                                     << ", extra " << row.false_positives << ", differing " << row.differing_steps
                                     << " " << row.outcome.message;
        }
    }
}

}  // namespace
}  // namespace trocar::bench
