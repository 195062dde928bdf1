// The blind control: a response works from its contacts, or it is no response. With a detector that answers nothing
// every one of them leaves the world as one that does nothing does. And what a detector does not report must be missed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <span>

#include "contract/contract_support.hpp"
#include "contract/response_methods.hpp"
#include "simulate/runs.hpp"
#include "simulate/simulation.hpp"

namespace trocar::test {
namespace {

struct Try {
    const char* scene;
    double faster;
    int ticks;
};

/// All that happens in the shipped scene happens within the ticks: a stab, a drag, a grasp, pressed tissues, bone
/// behind tissue, instruments on each other and on bone.
constexpr Try tries[] = {{"i2t_poke", 4.0, 100},   {"i2t_stab", 4.0, 80},    {"i2t_drag", 8.0, 120},
                         {"i2t_grasp", 12.0, 110}, {"t2t_press", 8.0, 100},  {"r2t_bone", 8.0, 120},
                         {"i2i_cross", 8.0, 120},  {"i2r_scrape", 8.0, 120}, {"i2t_operator_press", 8.0, 120}};
/// Tools that begin inside: `tracked_proximity` knows these sides from the search of its `prepare` (CONTACT §2).
constexpr Try deep_tries[] = {{"i2t_deep_start", 1.0, 30}, {"i2t_deep_sheet", 1.0, 30}};

struct End {
    std::uint64_t frame = 0;
    std::vector<Wrench> loads;  ///< per tick and body
    Outcome outcome;
};

End end_of(const Scene& scene, int ticks, const std::string& detector, const std::string& method,
           const std::string& source) {
    Simulation simulation(scene, make_detector(detector), make_response(method), registry().contact_generator(source));
    End end;
    for (int tick = 0; tick < ticks && simulation.outcome().ok(); ++tick) {
        simulation.step();
        end.loads.insert(end.loads.end(), simulation.body_loads().begin(), simulation.body_loads().end());
    }
    end.frame = simulation.frame().hash();
    end.outcome = simulation.outcome();
    return end;
}

std::string differences(const End& one, const End& none) {
    if (!one.outcome.ok()) return fmt::format("outcome {}, {}", name_of(one.outcome.kind), one.outcome.message);
    double load = 0.0;
    for (std::size_t i = 0; i < std::min(one.loads.size(), none.loads.size()); ++i) {
        load = std::max({load, (one.loads[i].force - none.loads[i].force).norm(),
                         (one.loads[i].moment - none.loads[i].moment).norm()});
    }
    if (load > 0.0) return fmt::format("loads differ by {:g} N or N m", load);
    return one.frame == none.frame ? std::string() : std::string("frames differ");
}

class BlindControl : public testing::TestWithParam<ResponseMethod> {};

std::string what_is_done_blindly(const ResponseMethod& who, std::span<const Try> scenes) {
    std::string failures;
    for (const Try& one : scenes) {
        const Scene scene = quick_scene(one.scene, one.faster);
        const End none = end_of(scene, one.ticks, "blind", "none", "intersection");
        EXPECT_TRUE(none.outcome.ok()) << one.scene << ": " << none.outcome.message;
        const std::string differ = differences(end_of(scene, one.ticks, "blind", who.method, who.source), none);
        if (!differ.empty()) failures += fmt::format("{}: {}\n", one.scene, differ);
    }
    return failures;
}

TEST_P(BlindControl, NothingReportedIsNothingDone) {
    expect_kept(GetParam(), "NothingReportedIsNothingDone", what_is_done_blindly(GetParam(), tries));
}

TEST_P(BlindControl, NothingReportedIsNothingDoneFromADeepStart) {
    expect_kept(GetParam(), "NothingReportedIsNothingDoneFromADeepStart", what_is_done_blindly(GetParam(), deep_tries));
}

INSTANTIATE_TEST_SUITE_P(Every, BlindControl, testing::ValuesIn(response_methods()),
                         [](const auto& tested) { return tested.param.name(); });

TEST(BlindControlItself, SeesWhatAResponseDoesWithContacts) {
    // The scenes are worth something only where contacts change the end.
    std::vector<Try> all(std::begin(tries), std::end(tries));
    all.insert(all.end(), std::begin(deep_tries), std::end(deep_tries));
    for (const Try& one : all) {
        const Scene scene = quick_scene(one.scene, one.faster);
        const End none = end_of(scene, one.ticks, "blind", "none", "intersection");
        EXPECT_FALSE(differences(end_of(scene, one.ticks, "ohc_clustered", "penalty", "intersection"), none).empty())
            << one.scene;
    }
}

// ------------------------------------------------------------------ the detector `blind`

TEST(Blind, AnswersNothingAndSaysOk) {
    const DetectorEntry& entry = registry().detector("blind");
    EXPECT_TRUE(entry.control);
    EXPECT_FALSE(entry.claims_exact);
    const World world = sphere_in_sheet();
    const ContactSet contacts = answer_of(entry, world, {}, false, 0.001);
    EXPECT_TRUE(contacts.outcome.ok());
    EXPECT_TRUE(contacts.pairs.empty());
    EXPECT_TRUE(contacts.near.empty());
    EXPECT_EQ(contacts.query_distance, 0.001);
    EXPECT_FALSE(contacts.truncated);
}

TEST(Blind, HidesEveryTenthTriangleOfTheInstrumentsAndNothingElse) {
    const DetectorEntry& entry = registry().detector("blind");
    for (const World& world : general_scenes()) {
        const double query_distance = 0.002;
        const ContactSet all = answer_of(registry().detector("brute_force"), world, {}, false, query_distance);
        ContactSet seen = answer_of(entry, world, {{"hide", "0.1"}}, false, query_distance);
        const auto hidden = [&world](Index triangle) {
            const Index body = world.topology.body_of_triangle[static_cast<std::size_t>(triangle)];
            const BodyRange& range = world.topology.bodies[static_cast<std::size_t>(body)];
            return range.kind == BodyKind::instrument && (triangle - range.triangles.first) % 10 == 0;
        };
        std::size_t lost = 0;
        for (const auto list : {&ContactSet::pairs, &ContactSet::near}) {
            Pairs expected;
            for (const TrianglePair& pair : all.*list) {
                if (hidden(pair.a) || hidden(pair.b)) {
                    ++lost;
                } else {
                    expected.push_back(pair);
                }
            }
            EXPECT_EQ(seen.*list, expected) << world.name;
        }
        const bool instruments = std::any_of(world.topology.bodies.begin(), world.topology.bodies.end(),
                                             [](const BodyRange& body) { return body.kind == BodyKind::instrument; });
        EXPECT_EQ(lost > 0, instruments) << world.name;
        const ContactSet whole = answer_of(entry, world, {{"hide", "0"}}, false, query_distance);
        EXPECT_EQ(whole.pairs, all.pairs) << world.name;
        EXPECT_EQ(whole.near, all.near) << world.name;
    }
}

TEST(Blind, ReportsAFrameThatIsNotFinite) {
    World world = sphere_in_sheet();
    world.frame.position(1, 5) = std::nan("");
    for (const char* hide : {"1", "0.1"}) {
        EXPECT_EQ(answer_of(registry().detector("blind"), world, {{"hide", hide}}).outcome.kind,
                  OutcomeKind::not_finite);
    }
}

TEST(Blind, HiddenTrianglesMakeOurResponseWorse) {
    // Depth that truth finds: a vertex and a face that nobody reports go through each other.
    const auto deepest = [](const std::string& detector) {
        RunSpec spec;
        spec.mode = "closed_loop";
        spec.detector = detector;
        spec.response = "unilateral";
        spec.contacts = default_contact_generator(parse_method("unilateral"));
        spec.ticks = 150;
        spec.truth_stride = 1;
        // A tool that goes deep, so that the sheet's own corners press on its side and only its faces hold them.
        const Record record = run_closed_loop(quick_scene("i2t_stab", 1.0), spec);
        EXPECT_TRUE(record.outcome.ok()) << detector << ": " << record.outcome.message;
        return record.summary.at(Metric::residual_penetration_max_m);
    };
    const double seeing = deepest("ohc_clustered");
    // The planes of the neighbours hold what the hidden ones would, up to two triangles of five.
    const double hidden = deepest("blind:hide=0.5");
    EXPECT_GT(deepest("blind:hide=0.1"), seeing);
    EXPECT_EQ(deepest("blind:hide=0"), seeing);
    constexpr double margin = 1e-3;  // m
    EXPECT_GT(hidden, seeing + margin);
}

}  // namespace
}  // namespace trocar::test
