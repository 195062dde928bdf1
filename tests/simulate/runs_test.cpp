#include "simulate/runs.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

#include "geometry/exact.hpp"
#include "geometry/input_error.hpp"
#include "geometry/triangle_distance.hpp"
#include "measure/metrics.hpp"
#include "method/registry.hpp"
#include "reference/reference.hpp"
#include "simulate/simulation.hpp"
#include "support/meshes.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

/// Own methods by trait, never by name; an empty answer fails.
std::vector<std::string> own_exact_detectors() {
    std::vector<std::string> names;
    for (const DetectorEntry& entry : registry().detectors()) {
        if (entry.own && entry.claims_exact) names.push_back(entry.name);
    }
    EXPECT_FALSE(names.empty());
    return names;
}

std::vector<std::string> own_responses() {
    std::vector<std::string> names;
    for (const ResponseEntry& entry : registry().responses()) {
        if (entry.own) names.push_back(entry.name);
    }
    EXPECT_FALSE(names.empty());
    return names;
}

/// The contact generator that a response takes when none is named; `intersection` for a name that nobody has.
std::string own_contact_generator(const std::string& response) {
    for (const ResponseEntry& entry : registry().responses()) {
        if (entry.name == response) return default_contact_generator(parse_method(response));
    }
    return "intersection";
}

bool takes(const ResponseEntry& entry, const std::string& source) {
    return std::find(entry.contact_generators.begin(), entry.contact_generators.end(), source) !=
           entry.contact_generators.end();
}

RunSpec spec_of(const std::string& mode, const std::string& detector, const std::string& response) {
    RunSpec spec;
    spec.mode = mode;
    spec.detector = detector;
    spec.response = response;
    spec.contacts = mode == "closed_loop" ? own_contact_generator(response) : "";
    spec.truth_stride = 5;
    return spec;
}

/// m, between the two bodies of a scene over all their triangles; 0 where two of them meet.
double distance_of_two(const Topology& topology, const Matrix3X& position) {
    const auto corners = [&](Index t) { return corners_of(topology.triangles, position, t); };
    double least = std::numeric_limits<double>::infinity();
    const Range first = topology.bodies[0].triangles;
    const Range second = topology.bodies[1].triangles;
    for (Index a = first.first; a < first.end(); ++a) {
        for (Index b = second.first; b < second.end(); ++b) {
            if (oracle_intersect(corners(a), corners(b))) return 0.0;
            least = std::min(least, triangle_distance(corners(a), corners(b)).squared_distance);
        }
    }
    return std::sqrt(least);
}

TEST(ForceWithoutTouch, OfAClosedLoopIsThatOfTheTicksOneByOne) {
    const Scene scene = test::scene_from_text(test::poke_text());
    for (const std::string response : {"unilateral", "penalty", "penalty:k=100000,reduction=pair"}) {
        RunSpec spec = spec_of("closed_loop", "ohc", response);
        spec.contacts = "tracked_proximity";
        spec.truth_stride = 1;
        std::vector<std::pair<double, double>> ticks;  // force, N, and clearance, m
        double start = distance_of_two(scene.topology, scene.first.position);
        RunLimits limits;
        limits.observe = [&](const Simulation& simulation, const StepRow&) {
            double force = 0.0;
            for (const ContactForce& load : simulation.contact_forces()) force += load.force.norm();
            const double end = distance_of_two(scene.topology, simulation.frame().position);
            ticks.emplace_back(force, std::min(start, end));
            start = end;
        };
        const Record record = run_closed_loop(scene, spec, limits);
        ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
        double peak = 0.0;
        for (const auto& [force, clearance] : ticks) peak = std::max(peak, force);
        ASSERT_GT(peak, 0.0) << response;
        double expected = 0.0;
        for (const auto& [force, clearance] : ticks) {
            if (force > 0.01 * peak) expected = std::max(expected, clearance);
        }
        EXPECT_NEAR(record.summary.at(Metric::force_without_touch_m), expected, 1e-12) << response;
        spec.truth_stride = 2;
        EXPECT_TRUE(std::isnan(run_closed_loop(scene, spec).summary.at(Metric::force_without_touch_m)))
            << "not every tick is judged";
    }
    RunSpec spec = spec_of("closed_loop", "ohc", "thesis");
    spec.truth_stride = 1;
    EXPECT_TRUE(std::isnan(run_closed_loop(scene, spec).summary.at(Metric::force_without_touch_m)))
        << "what acts by wrenches has no force of a pair";
}

TEST(Replay, WhatALimitCutsCountsAsMissedOnEveryTickItCuts) {
    const Scene scene = test::scene_from_text(test::poke_text());
    for (const std::string& detector : own_exact_detectors()) {
        const auto& declared = registry().detector(detector).parameters;
        const bool limited = std::any_of(declared.begin(), declared.end(),
                                         [](const Parameter& parameter) { return parameter.name == "work_budget"; });
        if (!limited) continue;
        RunSpec spec = spec_of("replay", detector, "");
        spec.truth_stride = 1;
        const Record all = make_run(scene, spec);
        std::int64_t most_work = 0;
        for (const StepRow& row : all.rows) most_work = std::max(most_work, row.work.work());
        // Truth is asked for on two ticks only, and yet every cut tick is judged.
        spec.detector = fmt::format("{}:work_budget={}", detector, most_work / 2);
        spec.truth_stride = 1000;
        const Record cut = make_run(scene, spec);
        ASSERT_EQ(all.rows.size(), cut.rows.size());
        double missing = 0.0;
        double ticks = 0.0;
        for (std::size_t i = 0; i < cut.rows.size(); ++i) {
            const StepRow& row = cut.rows[i];
            EXPECT_TRUE(row.truncated || row.pairs == all.rows[i].true_pairs) << detector << " tick " << i;
            if (!row.truncated) continue;
            EXPECT_EQ(row.false_negatives, all.rows[i].true_pairs - row.pairs) << detector << " tick " << i;
            missing += static_cast<double>(row.false_negatives);
            ticks += 1.0;
        }
        EXPECT_GT(missing, 0.0) << detector;
        EXPECT_GT(ticks, 5.0) << detector;
        EXPECT_EQ(cut.summary.at(Metric::truncated_ticks), ticks);
        EXPECT_EQ(cut.summary.at(Metric::false_negatives), missing);
        EXPECT_LT(cut.summary.at(Metric::recall), 1.0);
    }
}

TEST(Replay, EveryDetectorSeesTheSameFramesAndExactOnesMissNothing) {
    const Scene scene = test::scene_from_text(test::poke_text());
    std::set<std::string> hashes;
    for (const std::string& detector : own_exact_detectors()) {
        const Record record = make_run(scene, spec_of("replay", detector, ""));
        EXPECT_TRUE(record.outcome.ok()) << detector << ' ' << record.outcome.message;
        EXPECT_EQ(record.rows.size(), 60U);
        EXPECT_EQ(record.summary.at(Metric::recall), 1.0) << detector;
        EXPECT_EQ(record.summary.at(Metric::precision), 1.0) << detector;
        EXPECT_EQ(record.summary.at(Metric::judged_ticks), 13.0) << "every fifth tick and the last";
        EXPECT_TRUE(std::isnan(record.summary.at(Metric::residual_penetration_max_m)))
            << "a replay leaves nothing over";
        EXPECT_TRUE(record.environment.contains("commit"));
        hashes.insert(record.frames_hash);
    }
    EXPECT_EQ(hashes.size(), 1U);
}

TEST(ClosedLoop, EndsOnTheSameStateTwiceAndReadsBack) {
    const Scene scene = test::scene_from_text(test::poke_text());
    for (const std::string& response : own_responses()) {
        const RunSpec spec = spec_of("closed_loop", own_exact_detectors().front(), response);
        const RunLimits limits{.watched = response == "unilateral"};  // others jitter beyond their scripts' work
        const Record one = make_run(scene, spec, limits);
        const Record two = make_run(scene, spec, limits);
        EXPECT_TRUE(one.outcome.ok()) << response << ' ' << one.outcome.message;
        EXPECT_EQ(one.state_hash, two.state_hash);
        EXPECT_EQ(one.rows.size(), 60U);
        EXPECT_GT(one.summary.at(Metric::pairs_max), 0.0);
        EXPECT_TRUE(std::isfinite(one.summary.at(Metric::residual_penetration_max_m)));
        // The tool goes 2 mm below the sheet's rest plane: nothing can be left deeper.
        EXPECT_LE(one.summary.at(Metric::residual_penetration_max_m), 0.0021);
        EXPECT_EQ(to_json_line(record_from_json_line(to_json_line(one), "f", 1)), to_json_line(one));
    }
}

TEST(ClosedLoop, DifferentExactDetectorsLeadToTheSameState) {
    const Scene scene = test::scene_from_text(test::poke_text());
    std::set<std::string> states;
    for (const std::string& detector : own_exact_detectors()) {
        states.insert(make_run(scene, spec_of("closed_loop", detector, own_responses().front())).state_hash);
    }
    EXPECT_EQ(states.size(), 1U);
}

TEST(ClosedLoop, NearPairsThatADetectorDoesNotBringAreCountedWhereASourceAsksForThem) {
    const Scene scene = test::scene_from_text(test::poke_text());
    const auto summary = [&scene](const std::string& detector, const std::string& source) {
        RunSpec spec = spec_of("closed_loop", detector, "none");
        spec.contacts = source;
        return make_run(scene, spec).summary;
    };
    const auto exact = summary(own_exact_detectors().front(), "tracked_proximity");
    EXPECT_GT(exact.at(Metric::true_proximity_pairs), 0.0);
    EXPECT_EQ(exact.at(Metric::proximity_false_negatives), 0.0);
    EXPECT_GE(exact.at(Metric::query_distance_max_m), exact.at(Metric::query_distance_median_m));
    EXPECT_GT(exact.at(Metric::query_distance_median_m), 0.0);
    // Less is asked of it, since edges that it never reports cannot ask for more; all of that is missed.
    const auto blind = summary("blind", "tracked_proximity");
    EXPECT_GT(blind.at(Metric::true_proximity_pairs), 0.0);
    EXPECT_EQ(blind.at(Metric::proximity_false_negatives), blind.at(Metric::true_proximity_pairs));
    const auto hidden = summary("blind:hide=0.5", "tracked_proximity");
    EXPECT_GT(hidden.at(Metric::proximity_false_negatives), 0.0);
    EXPECT_LT(hidden.at(Metric::proximity_false_negatives), hidden.at(Metric::true_proximity_pairs));
    const auto meeting = summary("blind", "intersection");
    EXPECT_TRUE(std::isnan(meeting.at(Metric::proximity_false_negatives))) << "nobody asks for near pairs";
    EXPECT_TRUE(std::isnan(meeting.at(Metric::query_distance_max_m)));
}

TEST(ClosedLoop, DetailsAreJudgedOnEveryNthJudgedTickAndChangeNothingElse) {
    const Scene scene = test::scene_from_text(test::poke_text());
    RunSpec spec = spec_of("closed_loop", own_exact_detectors().front(), "none");
    spec.contacts = "tracked_proximity";
    spec.truth_stride = 2;
    const Record all = make_run(scene, spec);
    spec.detail_stride = 5;
    const Record some = make_run(scene, spec);
    ASSERT_EQ(all.rows.size(), some.rows.size());
    for (std::size_t i = 0; i < all.rows.size(); ++i) {
        const bool judged = i % 2 == 0 || i + 1 == all.rows.size();
        const bool in_detail = i % 10 == 0 || i + 1 == all.rows.size();
        EXPECT_EQ(all.rows[i].true_proximity_pairs >= 0, judged) << i;
        EXPECT_EQ(some.rows[i].true_proximity_pairs >= 0, in_detail) << i;
        EXPECT_EQ(all.rows[i].false_negatives, some.rows[i].false_negatives) << i;
        EXPECT_EQ(all.rows[i].wrong_side, some.rows[i].wrong_side) << i;
        if (!judged) continue;
        EXPECT_EQ(all.rows[i].residual_penetration, some.rows[i].residual_penetration) << i;
    }
    const Record back = record_from_json_line(to_json_line(some), "f", 1);
    EXPECT_EQ(back.spec.detail_stride, 5);
    EXPECT_EQ(back.rows[10].true_proximity_pairs, some.rows[10].true_proximity_pairs);
    EXPECT_EQ(back.rows[10].proximity_false_negatives, some.rows[10].proximity_false_negatives);
    EXPECT_EQ(back.rows[10].query_distance, some.rows[10].query_distance);
}

TEST(ClosedLoop, ScriptedBodiesLeaveNothingThatAMethodCouldAnswerFor) {
    std::string text = test::press_text(0.001);
    text.replace(text.find("operator"), 8, "prescribed");
    const Scene scene = test::scene_from_text(text);
    RunSpec spec = spec_of("closed_loop", own_exact_detectors().front(), own_responses().front());
    spec.ticks = 120;
    const Record record = make_run(scene, spec);
    EXPECT_GT(record.summary.at(Metric::pairs_max), 0.0);
    EXPECT_TRUE(std::isnan(record.summary.at(Metric::residual_penetration_max_m)));
    EXPECT_TRUE(std::isfinite(record.summary.at(Metric::depth_error_max_m)));
}

TEST(ClosedLoop, NativeContactsAreUnsupportedForExactlyTheResponsesThatCannotReadThem) {
    const Scene scene = test::scene_from_text(test::poke_text());
    const auto& detectors = registry().detectors();
    const auto detector = std::find_if(detectors.begin(), detectors.end(),
                                       [](const DetectorEntry& entry) { return entry.native_contacts; });
    if (detector == detectors.end()) GTEST_SKIP() << "this build has no detector with native contacts";
    EXPECT_FALSE(takes(registry().response("thesis"), "native"));
    for (const ResponseEntry& entry : registry().responses()) {
        RunSpec spec = spec_of("closed_loop", detector->name, entry.name);
        spec.contacts = "native";
        spec.ticks = 5;
        const Record record = make_run(scene, spec);
        EXPECT_EQ(record.outcome.kind == OutcomeKind::unsupported, !takes(entry, "native")) << entry.name;
        EXPECT_EQ(record.rows.empty(), !takes(entry, "native")) << entry.name;
        EXPECT_EQ(record.outcome.message.find("not from 'native'") != std::string::npos, !takes(entry, "native"))
            << record.outcome.message;
    }
}

TEST(ClosedLoop, ProgressCanEndARunEarly) {
    const Scene scene = test::scene_from_text(test::poke_text());
    RunLimits limits;
    limits.progress = [](std::int64_t done) { return done < 10; };
    std::int64_t observed = 0;
    limits.observe = [&observed](const Simulation& simulation, const StepRow& row) {
        EXPECT_EQ(simulation.seen().tick, row.tick);
        ++observed;
    };
    const Record record =
        make_run(scene, spec_of("closed_loop", own_exact_detectors().front(), own_responses().front()), limits);
    EXPECT_EQ(record.rows.size(), 10U);
    EXPECT_EQ(observed, 10);
}

TEST(TimedLoop, ReportsTheTissuesSizeAndTheStepsTakenAndEndsWhereTheJudgedLoopEnds) {
    const Scene scene = test::scene_from_text(test::poke_text());
    Index flat = 0;  // triangles of the sheet, which alone lies in one plane
    for (Index t = 0; t < scene.topology.triangle_count(); ++t) {
        bool in_plane = true;
        for (const Index v : scene.topology.triangles.col(t)) in_plane &= scene.first.position(2, v) == 0.0;
        flat += in_plane ? 1 : 0;
    }
    RunSpec spec = spec_of("closed_loop", "ohc", "unilateral");
    spec.ticks = 40;
    const Record judged = make_run(scene, spec);
    spec.mode = "cost_by_size";
    const Record timed = make_run(scene, spec);
    ASSERT_TRUE(timed.outcome.ok()) << timed.outcome.message;
    EXPECT_EQ(timed.environment.at("run.tissue_triangles"), fmt::format("{}", flat));
    EXPECT_EQ(timed.summary.at(Metric::substeps), scene.materials.substeps);
    EXPECT_EQ(timed.rows.size(), 40U);
    EXPECT_EQ(timed.summary.at(Metric::timed_ticks), 30.0) << "the first ten are dropped";
    EXPECT_GT(timed.summary.at(Metric::advance_median_ns), 0.0);
    EXPECT_EQ(timed.state_hash, judged.state_hash);
    spec.stepper = "implicit";
    EXPECT_EQ(make_run(scene, spec).summary.at(Metric::substeps), 1.0) << "one step a tick, whatever the scene names";
}

TEST(ClosedLoop, WhatSaysThatItActsAsPenaltyWithoutTissueDoes) {
    const Scene scene = test::scene_from_text(test::press_text(0.002));
    ASSERT_FALSE(scene.has_tissue());
    int count = 0;
    for (const ResponseEntry& entry : registry().responses()) {
        if (entry.without_tissue.empty()) continue;
        ++count;
        EXPECT_NE(entry.without_tissue.find("penalty"), std::string::npos) << entry.name;
        const RunSpec spec = spec_of("closed_loop", "brute_force", entry.name);
        RunSpec on_the_same = spec_of("closed_loop", "brute_force", "penalty");
        on_the_same.contacts = spec.contacts;
        const Record penalty = make_run(scene, on_the_same);
        EXPECT_GT(penalty.summary.at(Metric::force_max_n), 0.1);
        EXPECT_EQ(make_run(scene, spec).state_hash, penalty.state_hash) << entry.name;
    }
    EXPECT_GT(count, 0);
}

TEST(ClosedLoop, WhatSaysThatItIsPenaltyOnTissueIs) {
    const Scene scene = test::scene_from_text(test::poke_text());
    ASSERT_TRUE(scene.has_tissue());
    const Record penalty = make_run(scene, spec_of("closed_loop", "brute_force", "penalty"));
    EXPECT_GT(penalty.summary.at(Metric::force_max_n), 0.0);
    std::vector<std::string> same;
    for (const ResponseEntry& entry : registry().responses()) {
        if (entry.control) continue;
        const Record record = make_run(scene, spec_of("closed_loop", "brute_force", entry.name));
        // Some do not work from the spec's contacts.
        if (record.outcome.ok() && record.state_hash == penalty.state_hash && entry.name != "penalty") {
            EXPECT_NE(entry.same_as.find("is penalty"), std::string::npos) << entry.name;
            same.push_back(entry.name);
        } else {
            EXPECT_EQ(entry.same_as, "") << entry.name;
        }
    }
    EXPECT_EQ(same, std::vector<std::string>{"god_object"});
}

TEST(MakeRun, ATurnedStiffnessIsHeldAgainstItsOwnReference) {
    const test::TemporaryFolder temporary;
    const std::filesystem::path file = temporary.path() / "poke.json";
    std::ofstream(file) << test::poke_text();
    const Scene scene = read_scene(file, std::nullopt);
    // A reference that shows no force at k = 400 N/m: all of the run's force is error.
    Reference reference;
    reference.scene = scene.name;
    reference.scene_hash = fmt::format("{:016x}", scene.hash);
    reference.turned_k = 400.0;
    ReferenceSolution& equal_k = reference.equal_k;
    equal_k.available = true;
    equal_k.until = 1.0;
    equal_k.force_bound = 0.125;
    equal_k.position_bound = 0.25;
    equal_k.sample_interval = 1.0;
    equal_k.position_interval = 1.0;
    equal_k.points = {0};
    equal_k.force = Vector3::Zero();
    equal_k.positions = {scene.first.position.col(0)};
    std::filesystem::create_directories(temporary.path() / "reference");
    std::ofstream(reference_file(file, 400.0)) << to_json(reference);

    RunSpec spec = spec_of("closed_loop", "brute_force", "penalty");
    spec.overrides = "k=400";
    Record record = make_run(scene, spec);
    EXPECT_EQ(record.summary.at(Metric::force_bound_equal_k), 0.125);
    EXPECT_EQ(record.summary.at(Metric::position_bound_equal_k), 0.25);
    EXPECT_EQ(record.summary.at(Metric::k_scene_n_per_m), 400.0);
    EXPECT_GT(record.summary.at(Metric::force_error_rms_equal_k), 0.0);
    EXPECT_NE(record.environment.at("reference.hard").find("none is stored for this scene"), std::string::npos);
    for (const char* other : {"k=300", ""}) {
        spec.overrides = other;
        record = make_run(scene, spec);
        EXPECT_TRUE(std::isnan(record.summary.at(Metric::force_error_rms_equal_k))) << other;
        EXPECT_NE(record.environment.at("reference.equal_k").find("none is stored for"), std::string::npos);
    }
}

TEST(MakeRun, UnknownModeOrMethodIsBadInput) {
    const Scene scene = test::scene_from_text(test::poke_text());
    EXPECT_THROW(make_run(scene, spec_of("dance", "", "")), InputError);
    EXPECT_THROW(make_run(scene, spec_of("replay", "no_such_method", "")), InputError);
    EXPECT_THROW(make_run(scene, spec_of("closed_loop", own_exact_detectors().front(), "no_such_method")), InputError);
}

}  // namespace
}  // namespace trocar
