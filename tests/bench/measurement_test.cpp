// The benchmark judges answers before it times them: whoever forgets, invents, throws or is cut off becomes a failed
// row. Contestants that lie are made here.
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
    void update(const Frame& /*frame*/, double reach) override { reach_ = reach; }
    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        true_pairs(*topology_, frame, contacts.pairs);
        if (reach_ > 0.0) true_near_pairs(*topology_, frame, reach_, contacts.near);
        spoil_(frame.tick, contacts);
    }

private:
    std::function<void(std::int64_t, ContactSet&)> spoil_;
    const Topology* topology_ = nullptr;
    double reach_ = 0.0;
};

Contestant contestant(const std::string& label, std::function<void(std::int64_t, ContactSet&)> spoil) {
    Contestant result;
    result.label = label;
    result.claims_exact = true;
    result.make = [spoil = std::move(spoil)] { return std::make_unique<Spoiled>(spoil); };
    return result;
}

CellMeasurement measured(const std::vector<Contestant>& list, std::int64_t most_steps = 32) {
    const ContactScene scene({.tissue_triangles = 2000, .instrument_triangles = 500});
    const FrameMaker frames{&scene.topology(), [&scene](std::int64_t step, Frame& frame) { scene.write(step, frame); }};
    return measure(frames, list, {.budget_s = 10.0, .most_steps = most_steps, .reach = 0.001});
}

TEST(BenchMeasurement, TruthfulContestantsAreExactAndHaveEveryStep) {
    const CellMeasurement cell = measured({contestant("truth", [](std::int64_t, ContactSet&) {})});
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
        measured({contestant("forgets", [](std::int64_t, ContactSet& contacts) { contacts.pairs.pop_back(); })});
    EXPECT_FALSE(cell.methods.at(0).exact());
    EXPECT_EQ(cell.methods.at(0).missing, cell.methods.at(0).truth_steps);
    EXPECT_EQ(cell.methods.at(0).extra, 0);
}

TEST(BenchMeasurement, NearPairsAreAskedForAndJudgedInRowsWithinReachOnly) {
    const auto within = [](Contestant asked) {
        asked.within_reach = true;
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
        measured({within(contestant("truth", nothing)), contestant("forgets, not asked", forget),
                  within(contestant("forgets", forget)), within(contestant("forgets at times", forget_at_times))});
    EXPECT_GT(cell.true_near_pairs, 20);
    EXPECT_TRUE(cell.methods.at(0).exact());
    EXPECT_NEAR(static_cast<double>(cell.methods.at(0).near_pairs), static_cast<double>(cell.true_near_pairs), 20.0);
    EXPECT_TRUE(cell.methods.at(1).exact());
    EXPECT_EQ(cell.methods.at(1).near_pairs, 0);
    EXPECT_EQ(cell.methods.at(2).missing, cell.methods.at(2).truth_steps);
    EXPECT_GT(cell.methods.at(3).differing_steps, 0);
}

TEST(BenchMeasurement, AnInventedPairIsCounted) {
    const CellMeasurement cell = measured({contestant("invents", [](std::int64_t, ContactSet& contacts) {
        contacts.pairs.insert(contacts.pairs.begin(), {0, 700});
    })});
    EXPECT_FALSE(cell.methods.at(0).exact());
    EXPECT_EQ(cell.methods.at(0).missing, 0);
    EXPECT_EQ(cell.methods.at(0).extra, cell.methods.at(0).truth_steps);
}

TEST(BenchMeasurement, ALieBetweenTheStepsThatTruthLooksAtIsSeenBesideAnHonestOne) {
    // Truth looks at the first of 4 steps a block (the numbers 4, 9, 14 …); the lie is told one step later.
    const CellMeasurement cell = measured({contestant("truth", [](std::int64_t, ContactSet&) {}),
                                           contestant("sly", [](std::int64_t tick, ContactSet& contacts) {
                                               if (tick % 5 == 0) contacts.pairs.pop_back();
                                           })});
    EXPECT_TRUE(cell.methods.at(0).exact());
    EXPECT_EQ(cell.methods.at(1).missing, 0);
    EXPECT_EQ(cell.methods.at(1).differing_steps, block_count);
    EXPECT_FALSE(cell.methods.at(1).exact());
}

TEST(BenchMeasurement, FailuresBecomeOutcomesAndHarmNobodyElse) {
    const CellMeasurement cell =
        measured({contestant("throws",
                             [](std::int64_t tick, ContactSet&) {
                                 if (tick > 10) throw std::runtime_error("a library's own");
                             }),
                  contestant("cut", [](std::int64_t, ContactSet& contacts) { contacts.truncated = true; }),
                  contestant("gives up",
                             [](std::int64_t, ContactSet& contacts) {
                                 contacts.outcome = {OutcomeKind::unsupported, "no"};
                             }),
                  contestant("truth", [](std::int64_t, ContactSet&) {})});
    EXPECT_EQ(cell.methods.at(0).outcome.kind, OutcomeKind::threw);
    EXPECT_EQ(cell.methods.at(0).outcome.message, "a library's own");
    EXPECT_EQ(cell.methods.at(1).outcome.kind, OutcomeKind::unsupported);
    EXPECT_EQ(cell.methods.at(2).outcome.kind, OutcomeKind::unsupported);
    EXPECT_TRUE(cell.methods.at(3).exact());
    EXPECT_EQ(cell.methods.at(3).step.size(), 32U);
}

TEST(BenchMeasurement, RegisteredDetectorsTakePartWithoutBeingNamed) {
    std::vector<Missing> missing;
    const std::vector<Contestant> list = contestants(registry(), missing);
    for (const DetectorEntry& entry : registry().detectors()) {
        const bool takes_part = std::any_of(list.begin(), list.end(), [&entry](const Contestant& contestant) {
            return contestant.method == entry.name;
        });
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
        for (const std::string& method : tried) EXPECT_NE(contestant_of(method).make(), nullptr) << method;
    }
}

TEST(BenchMeasurement, DetectorsThatClaimExactnessAreExactOnEveryKindOfScene) {
    std::vector<Missing> missing;
    std::vector<Contestant> list = contestants(registry(), missing);
    std::erase_if(list, [](const Contestant& entry) { return !entry.claims_exact || entry.part != Part::everywhere; });
    ASSERT_FALSE(list.empty());
    for (std::size_t k = list.size(); k-- > 0;) {
        if (!list[k].reach) continue;
        list.push_back(list[k]);
        list.back().label += ", within reach";
        list.back().within_reach = true;
    }
    for (const Variant variant :
         {Variant::light, Variant::deep, Variant::near, Variant::rotating, Variant::strain, Variant::local}) {
        const ContactScene scene({.variant = variant, .tissue_triangles = 2000, .instrument_triangles = 500});
        const FrameMaker frames{&scene.topology(),
                                [&scene](std::int64_t step, Frame& frame) { scene.write(step, frame); }};
        for (const MethodResult& row :
             measure(frames, list, {.budget_s = 0.05, .most_steps = 16, .reach = 0.0005}).methods) {
            EXPECT_TRUE(row.exact()) << row.label << ", " << scene.spec().name() << ": missing " << row.missing
                                     << ", extra " << row.extra << ", differing " << row.differing_steps << " "
                                     << row.outcome.message;
        }
    }
}

}  // namespace
}  // namespace trocar::bench
