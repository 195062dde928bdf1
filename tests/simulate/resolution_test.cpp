// An interval without contact, and how a run after it is held against the same scene with contact at every tick.
#include "simulate/resolution.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "geometry/input_error.hpp"
#include "measure/depth_truth.hpp"
#include "simulate/runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using Tick = ResolutionTrail::Tick;

/// A ball of radius 8 mm is moved from 3 mm above a pinned sheet at z = 0 to 2 mm below it and rests there. The first
/// key is at `from`, the last one 0.1 s later.
Scene moved_through(double from, const std::string& contact_off, std::int64_t ticks) {
    std::string text = R"({"format":"trocar-scene-2","name":"through","dt":0.001,"ticks":)" + std::to_string(ticks) +
                       R"(,"contact_off":)" + contact_off + R"(,"bodies":[
      {"name":"sheet","kind":"tissue","closed":false,"parts":[{"shape":"sheet","size":[0.06,0.06],"edge":0.006}]},
      {"name":"tool","kind":"instrument","closed":true,"parts":[{"shape":"sphere","radius":0.008,"edge":0.002}],
       "motion":{"drive":"prescribed","keys":[{"time":)" +
                       std::to_string(from) + R"(,"pose":[0.001,0.0007,0.011,0,0,0]},{"time":)" +
                       std::to_string(from + 0.1) + R"(,"pose":[0.001,0.0007,0.006,0,0,0]}]}}]})";
    return test::scene_from_text(text);
}

RunSpec spec_of(const std::string& response, const std::string& mode = "resolution") {
    RunSpec spec;
    spec.mode = mode;
    spec.detector = "ohc_clustered";
    spec.response = response;
    spec.contacts = default_contact_generator(parse_method(response));
    spec.truth_stride = 1;
    return spec;
}

std::string refusal_of(const std::string& contact_off) {
    try {
        moved_through(0.0, contact_off, 10);
    } catch (const InputError& error) {
        return error.what();
    }
    return {};
}

TEST(ContactOff, IsTwoAscendingTimesOfWhichTheSecondIsNotBeforeTheStart) {
    for (const char* wrong : {"0.1", "[0.1]", "[0.1,0.2,0.3]", "[0.2,0.1]", "[0.1,0.1]", "[-0.2,-0.1]", "[\"a\",1]"}) {
        EXPECT_NE(refusal_of(wrong).find("/contact_off"), std::string::npos) << wrong << ": " << refusal_of(wrong);
    }
    EXPECT_EQ(refusal_of("[-0.1,0]"), "");
}

TEST(ContactOff, HoldsFromItsFirstTickToTheOneBeforeItsLastWhateverTheTimesAreRoundedTo) {
    for (const std::int64_t first : {0, 3, 57, 58}) {
        const Scene scene = moved_through(
            0.0, "[" + std::to_string(0.001 * static_cast<double>(first)) + "," + std::to_string(0.001 * 63) + "]",
            100);
        for (std::int64_t tick = 0; tick < 100; ++tick) {
            EXPECT_EQ(scene.has_contact_at(tick), tick < first || tick >= 63) << tick;
        }
        EXPECT_EQ(scene.prelude_ticks(), 0);
    }
    EXPECT_EQ(moved_through(-0.1, "[-0.1,0]", 100).prelude_ticks(), 100);
}

TEST(ContactOff, LeavesTheResponseNothingAndTheDetectorNoMisses) {
    const Scene scene = moved_through(0.0, "[0.07,0.12]", 140);
    std::int64_t silent = 0;
    RunLimits limits;
    limits.observe = [&](const Simulation& simulation, const StepRow& row) {
        if (scene.has_contact_at(row.tick)) return;
        ++silent;
        EXPECT_EQ(row.pairs, 0);
        EXPECT_EQ(row.contacts_offered, 0);
        EXPECT_EQ(row.tool_force, Vector3(Vector3::Zero()));
        EXPECT_EQ(row.false_negatives, -1) << "not judged";
        EXPECT_GT(row.work.work(), 0) << "the detector is called";
        EXPECT_TRUE(simulation.output().contacts.empty());
    };
    const Record record = run_closed_loop(scene, spec_of("penalty", "closed_loop"), limits);
    ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
    EXPECT_EQ(silent, 50);
    EXPECT_EQ(value_of(record.summary, Metric::false_negatives), 0.0);
    EXPECT_GT(record.rows[69].pairs, 0);
    EXPECT_GT(record.rows[121].pairs, 0);
}

TEST(ContactOff, ChangesNothingWhileNothingMeets) {
    Scene scene = moved_through(0.0, "[0,0.04]", 140);
    const std::string with = run_closed_loop(scene, spec_of("penalty", "closed_loop")).state_hash;
    scene.contact_off.reset();
    EXPECT_EQ(with, run_closed_loop(scene, spec_of("penalty", "closed_loop")).state_hash);
}

/// The side of a body that lies wholly behind a sheet is known from the path alone.
TEST(ContactOff, TruthFollowsTheScriptsFromTheirCleanState) {
    Scene scene = moved_through(-0.1, "[-0.1,0]", 3);
    for (MotionKey& key : scene.bodies[0].motion->keys) {
        if (key.time >= 0.0) key.translation.z() = -0.02;
    }
    scene.first = scripted_frame(scene, 0);
    Record record = run_closed_loop(scene, spec_of("none", "closed_loop"));
    EXPECT_NEAR(record.rows[0].residual_penetration, 0.028, 5e-4) << "farthest point of the ball from the sheet";
    scene.contact_off.reset();
    record = run_closed_loop(scene, spec_of("none", "closed_loop"));
    EXPECT_EQ(record.rows[0].residual_penetration, 0.0) << "without the path it belongs there";
}

TEST(Twin, IsTheSceneItselfFromItsCleanStateOn) {
    const Scene scene = moved_through(-0.1, "[-0.1,0]", 210);
    const Scene twin = twin_of(scene);
    EXPECT_FALSE(twin.contact_off);
    EXPECT_EQ(twin.ticks, 310);
    for (const std::int64_t tick : {-100, -50, 0, 20}) {
        const double difference =
            (scripted_frame(twin, tick + 100).position - scripted_frame(scene, tick).position).cwiseAbs().maxCoeff();
        EXPECT_LT(difference, 1e-15) << tick;
    }
    EXPECT_EQ(twin.first.position, scripted_frame(scene, -100).position);
}

TEST(Resolution, AScriptedDepthIsWhatItIsAndNoResponseResolvesNothing) {
    const Record record = make_run(moved_through(-0.1, "[-0.1,0]", 210), spec_of("none"));
    ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
    EXPECT_NEAR(value_of(record.summary, Metric::resolution_depth_before_m), 0.002, 1e-4);
    EXPECT_NEAR(value_of(record.summary, Metric::resolution_depth_after_m), 0.002, 1e-4);
    EXPECT_NEAR(value_of(record.summary, Metric::resolution_depth_twin_m), 0.002, 1e-4);
    EXPECT_EQ(value_of(record.summary, Metric::resolution_resolved), 0.0);
    EXPECT_EQ(value_of(record.summary, Metric::resolution_cleared), 0.0);
    EXPECT_EQ(value_of(record.summary, Metric::resolution_meets), 1.0);
    EXPECT_TRUE(std::isnan(value_of(record.summary, Metric::resolution_ticks)));
    EXPECT_EQ(record.environment.at("resolution.cause"), "no direction");
}

/// Where contact was off while nothing met, a run is its twin.
TEST(Resolution, ARunThatIsItsTwinIsResolvedAtOnce) {
    const Scene scene = moved_through(0.0, "[0,0.02]", 230);
    const Record record = make_run(scene, spec_of("unilateral"));
    ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
    EXPECT_EQ(value_of(record.summary, Metric::resolution_place_difference_m), 0.0);
    EXPECT_EQ(value_of(record.summary, Metric::resolution_depth_before_m), 0.0);
    EXPECT_EQ(record.environment.at("resolution.twin"), "ok");
}

TEST(Resolution, TruthThatJudgesTheWindowAloneSaysThereWhatItSaysWhenItJudgesEveryTick) {
    const Scene scene = moved_through(0.0, "[0.07,0.12]", 340);
    const RunSpec spec = spec_of("unilateral", "closed_loop");
    const Record every = run_closed_loop(scene, spec);
    RunLimits limits;
    limits.judged = {119, 320};
    const Record window = run_closed_loop(scene, spec, limits);
    ASSERT_EQ(window.rows.size(), every.rows.size());
    for (std::size_t t = 0; t < every.rows.size(); ++t) {
        if (t < 119 || t >= 320) {
            EXPECT_TRUE(std::isnan(window.rows[t].residual_penetration)) << t;
            continue;
        }
        EXPECT_EQ(window.rows[t].residual_penetration, every.rows[t].residual_penetration) << t;
        EXPECT_EQ(window.rows[t].wrong_side_area, every.rows[t].wrong_side_area) << t;
        EXPECT_EQ(window.rows[t].true_pairs, every.rows[t].true_pairs) << t;
    }
    EXPECT_GT(every.rows[119].residual_penetration, 0.0);
}

TEST(Resolution, ASceneWithoutAWindowIsBadInput) {
    EXPECT_THROW(make_run(moved_through(-0.1, "[-0.1,0]", 199), spec_of("none")), InputError);
    Scene scene = moved_through(-0.1, "[-0.1,0]", 210);
    scene.contact_off.reset();
    EXPECT_THROW(make_run(scene, spec_of("none")), InputError);
}

/// A trail in which the bodies are apart at once and the tool feels 1 N, as the twin has it.
ResolutionTrail good(const Scene& scene) {
    ResolutionTrail trail;
    trail.ticks.assign(200, {.force = Vector3(0, 0, 1), .energy = 2.0, .offered = 3, .used = 3});
    trail.mean_position = scene.first.position;
    trail.last_position = scene.first.position;
    trail.meets = true;
    trail.depth_before = 0.002;
    return trail;
}

struct ResolutionCase {
    const char* name;
    std::function<void(ResolutionTrail& trail, ResolutionTrail& twin)> change;
    Unresolved cause;
    double ticks;  ///< where it is resolved
    bool cleared = false;
};

/// Each limit from both sides. The sheet's edges have about 6 mm.
TEST(Resolution, EveryCriterionDecides) {
    const Scene scene = moved_through(-0.1, "[-0.1,0]", 210);
    constexpr double edge = 0.006;
    const auto deep = [](double depth, std::size_t from, std::size_t to) {
        return [=](ResolutionTrail& trail, ResolutionTrail&) {
            for (std::size_t t = from; t < to; ++t) trail.ticks[t].depth = depth;
        };
    };
    const auto all = [](double Tick::*member, double value) {
        return [=](ResolutionTrail& trail, ResolutionTrail&) {
            for (Tick& tick : trail.ticks) tick.*member = value;
        };
    };
    const std::vector<ResolutionCase> cases{
        {"at once", [](ResolutionTrail&, ResolutionTrail&) {}, Unresolved::none, 0, true},
        {"shallow", deep(0.015 * edge, 0, 200), Unresolved::none, 0, true},
        {"deep for 17 ticks", deep(0.001, 0, 17), Unresolved::none, 17},
        {"deep again", deep(0.001, 60, 61), Unresolved::none, 61},
        {"deep to the end", deep(0.001, 0, 200), Unresolved::balance_of_forces, 0},
        {"falling",
         [](ResolutionTrail& trail, ResolutionTrail&) {
             for (std::size_t t = 0; t < 200; ++t) trail.ticks[t].depth = 0.002 - 8e-6 * static_cast<double>(t);
         },
         Unresolved::too_slow, 0},
        {"as deep as the twin",
         [](ResolutionTrail& trail, ResolutionTrail& twin) {
             for (ResolutionTrail* one : {&trail, &twin}) {
                 for (Tick& tick : one->ticks) tick.depth = 0.0009;
             }
         },
         Unresolved::none, 0},
        {"twin more than half as deep",
         [](ResolutionTrail& trail, ResolutionTrail& twin) {
             for (ResolutionTrail* one : {&trail, &twin}) {
                 for (Tick& tick : one->ticks) tick.depth = 0.0011;
             }
         },
         Unresolved::wrong_side_held, 0},
        {"area on the wrong side", all(&Tick::wrong_side_area, 1e-4), Unresolved::balance_of_forces, 0},
        {"area that samples do not resolve", all(&Tick::wrong_side_area, 0.5 * edge * edge), Unresolved::none, 0, true},
        {"strained", all(&Tick::strain_over, 0.01), Unresolved::unstable, 0},
        {"torn", [](ResolutionTrail& trail, ResolutionTrail&) { trail.ticks[150].ruptures = 1; }, Unresolved::rupture,
         0},
        {"a third more force",
         [](ResolutionTrail& trail, ResolutionTrail&) {
             for (Tick& tick : trail.ticks) tick.force.z() = 1.33;
         },
         Unresolved::wrong_side_held, 0},
        {"a fifth more force",
         [](ResolutionTrail& trail, ResolutionTrail&) {
             for (Tick& tick : trail.ticks) tick.force.z() = 1.2;
         },
         Unresolved::none, 0, true},
        {"pushed the other way",
         [](ResolutionTrail& trail, ResolutionTrail&) {
             for (Tick& tick : trail.ticks) {
                 tick.force.z() = -1.0;
                 tick.depth = 0.001;
             }
         },
         Unresolved::wrong_side_held, 0},
        {"nothing offered",
         [](ResolutionTrail& trail, ResolutionTrail&) {
             for (Tick& tick : trail.ticks) {
                 tick = {};
                 tick.depth = 0.001;
             }
         },
         Unresolved::nothing_reported, 0},
        {"one vertex elsewhere",
         [&scene](ResolutionTrail& trail, ResolutionTrail&) {
             trail.mean_position.col(scene.topology.vertex_count - 30).x() += 0.01;
         },
         Unresolved::none, 0, true},
        {"all vertices elsewhere",
         [](ResolutionTrail& trail, ResolutionTrail&) { trail.mean_position.array() += 0.3 * edge; },
         Unresolved::wrong_side_held, 0},
        {"ended early", [](ResolutionTrail& trail, ResolutionTrail&) { trail.ticks.resize(120); },
         Unresolved::wrong_side_held, 0},
    };
    for (const ResolutionCase& one : cases) {
        SCOPED_TRACE(one.name);
        ResolutionTrail trail = good(scene);
        ResolutionTrail twin = good(scene);
        one.change(trail, twin);
        const Resolution result = compare_resolution(scene, {}, trail, twin);
        EXPECT_EQ(text_of(result.cause), text_of(one.cause));
        const bool resolved = one.cause == Unresolved::none;
        EXPECT_EQ(value_of(result.figures, Metric::resolution_resolved), resolved ? 1.0 : 0.0);
        EXPECT_EQ(value_of(result.figures, Metric::resolution_cleared), one.cleared ? 1.0 : 0.0);
        const double ticks = value_of(result.figures, Metric::resolution_ticks);
        EXPECT_TRUE(resolved ? ticks == one.ticks : std::isnan(ticks)) << ticks;
    }
    const Resolution failed = compare_resolution(scene, {OutcomeKind::unstable, ""}, good(scene), good(scene));
    EXPECT_EQ(value_of(failed.figures, Metric::resolution_resolved), 0.0);
    EXPECT_EQ(failed.cause, Unresolved::unstable);
}

TEST(Resolution, FiguresAreThoseOfTheirDefinition) {
    const Scene scene = moved_through(-0.1, "[-0.1,0]", 310);
    ResolutionTrail trail = good(scene);
    trail.ticks[0].force = Vector3(3, 0, 4);
    trail.ticks[1].force = Vector3(0, 0, 1);
    trail.ticks[9].energy = 5.0;
    trail.ticks[20].overshoot = 0.003;
    trail.ticks.back().wrong_side_area = 1e-6;
    trail.last_position.col(scene.topology.vertex_count - 30).y() += 0.004;
    ResolutionTrail twin = good(scene);
    twin.ticks[50].overshoot = 0.001;
    const Summary figures = compare_resolution(scene, {}, trail, twin).figures;
    EXPECT_DOUBLE_EQ(value_of(figures, Metric::resolution_kick), 5.0);
    EXPECT_DOUBLE_EQ(value_of(figures, Metric::resolution_force_step_n), 5.0);
    EXPECT_DOUBLE_EQ(value_of(figures, Metric::resolution_excess_energy), 1.5);
    EXPECT_DOUBLE_EQ(value_of(figures, Metric::resolution_overshoot_m), 0.002);
    EXPECT_DOUBLE_EQ(value_of(figures, Metric::resolution_wrong_side_m2), 1e-6);
    EXPECT_NEAR(value_of(figures, Metric::resolution_left_behind_m), 0.004, 1e-15);
}

}  // namespace
}  // namespace trocar
