#include "simulate/simulation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "geometry/input_error.hpp"
#include "method/registry.hpp"
#include "simulate/frame_source.hpp"
#include "simulate/query_distance.hpp"
#include "support/meshes.hpp"
#include "support/scene_runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using test::poke_text;
using test::press_text;
using test::scene_from_text;

/// Reports nothing, so that only the harness is under test.
class Blind : public Detector {
public:
    void prepare(const Topology& /*topology*/, const Frame& /*frame*/) override {}
    void update(const Frame& frame, double /*query_distance*/) override { frames.push_back(frame); }
    void detect(const Frame& /*frame*/, ContactSet& contacts) override { contacts.clear(); }
    std::vector<Frame> frames;
};

class Throwing final : public Blind {
public:
    void detect(const Frame& frame, ContactSet& contacts) override {
        if (frame.tick == 3) throw std::runtime_error("out of cheese");
        Blind::detect(frame, contacts);
    }
};

class Idle : public Response {
public:
    void prepare(const Topology& /*topology*/, const Materials& /*materials*/) override {}
    void respond(const Frame& /*frame*/, double /*dt*/, const ContactSet& /*contacts*/,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
    }
};

/// Puts one bad force on a tissue vertex at tick 5.
class Poisonous final : public Idle {
public:
    explicit Poisonous(Index vertex) : vertex_(vertex) {}
    void respond(const Frame& frame, double /*dt*/, const ContactSet& /*contacts*/,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        output.held_force.setZero(3, frame.position.cols());
        if (frame.tick == 5) output.held_force(2, vertex_) = std::nan("");
    }

private:
    Index vertex_;
};

/// Says what every body bears, as one does that puts tissue somewhere: no contact carries it.
class Bearing final : public Idle {
public:
    explicit Bearing(std::vector<Wrench> wrench) : wrench_(std::move(wrench)) {}
    void respond(const Frame& /*frame*/, double /*dt*/, const ContactSet& /*contacts*/,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        output.wrench = wrench_;
    }

private:
    std::vector<Wrench> wrench_;
};

const ContactGeneratorEntry& meeting_triangles() { return registry().contact_generator("intersection"); }

Range range_of(const Scene& scene, const std::string& name) {
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.name == name) return body.vertices;
    }
    ADD_FAILURE() << "no body " << name;
    return {};
}

TEST(Simulation, PreviousIsWhereABodyWasATickAgoWhileItMovesAndWhenItHasStopped) {
    // The script ends at 0.04 s, in the middle of the run.
    const Scene scene = scene_from_text(poke_text());
    Simulation simulation(scene, std::make_unique<Blind>(), nullptr, meeting_triangles());
    const Range tool = range_of(scene, "tool");
    Matrix3X before;
    int moved = 0;
    for (int tick = 0; tick < 60; ++tick) {
        simulation.step();
        const Frame& seen = simulation.seen();
        const Matrix3X now = seen.position.middleCols(tool.first, tool.count);
        if (tick > 0) {
            ASSERT_EQ(Matrix3X(seen.previous.middleCols(tool.first, tool.count)), before) << tick;
            moved += now == before ? 0 : 1;
        }
        before = now;
    }
    EXPECT_EQ(moved, 40);
}

TEST(Simulation, ScriptedBodyFollowsItsPosesExactly) {
    const Scene scene = scene_from_text(poke_text());
    const Range tool = range_of(scene, "tool");
    Simulation simulation(scene, std::make_unique<Blind>(), nullptr, meeting_triangles());
    for (int tick = 0; tick < 60; ++tick) {
        const StepRow row = simulation.step();
        ASSERT_TRUE(simulation.outcome().ok()) << simulation.outcome().message;
        EXPECT_EQ(row.tick, tick);
        EXPECT_EQ(row.time, tick * 0.001);
        const Frame& seen = simulation.seen();
        EXPECT_EQ(seen.tick, tick);
        const double moved = tick < 40 ? 0.005 * tick / 40.0 : 0.005;
        for (Index v = tool.first; v < tool.end(); ++v) {
            EXPECT_NEAR(seen.position(2, v), scene.first.position(2, v) - moved, 1e-15);
            const double speed = tick == 0 || tick > 40 ? 0.0 : -0.125;
            EXPECT_NEAR(seen.velocity(2, v), speed, 1e-11);
        }
        EXPECT_EQ(seen.moved.has_value(), tick > 0) << "the first frame has none before it";
        if (tick == 0) continue;
        const bool tool_moves = tick <= 40;
        EXPECT_EQ(std::find(seen.moved->begin(), seen.moved->end(), tool) != seen.moved->end(), tool_moves) << tick;
    }
    EXPECT_EQ(simulation.frame().hash(), simulation.seen().hash()) << "nothing advances without a response";
}

TEST(Simulation, OnlyStagesThatTheSceneNamesArePresent) {
    const Scene tissue = scene_from_text(poke_text());
    Simulation with(tissue, std::make_unique<Blind>(), std::make_unique<Idle>(), meeting_triangles());
    for (const std::int64_t ns : with.step().stage_ns) EXPECT_GE(ns, 0);
    Simulation without(tissue, std::make_unique<Blind>(), nullptr, meeting_triangles());
    const StepRow row = without.step();
    EXPECT_EQ(row.stage_ns[static_cast<std::size_t>(Stage::respond)], -1);
    EXPECT_EQ(row.stage_ns[static_cast<std::size_t>(Stage::advance)], -1);
    EXPECT_GE(row.stage_ns[static_cast<std::size_t>(Stage::contacts)], 0);

    std::string text = press_text(0.001);
    text.replace(text.find("operator"), 8, "prescribed");
    const Scene scripted = scene_from_text(text);
    EXPECT_TRUE(scripted.materials.springs.empty());
    Simulation rigid(scripted, std::make_unique<Blind>(), std::make_unique<Idle>(), meeting_triangles());
    EXPECT_EQ(rigid.step().stage_ns[static_cast<std::size_t>(Stage::advance)], -1);
    EXPECT_EQ(rigid.yielding_pairs(), std::vector<std::uint8_t>{0});
}

TEST(Simulation, NonFiniteForceIsAnOutcomeAndTheFrameStays) {
    const Scene scene = scene_from_text(poke_text());
    const Range sheet = range_of(scene, "sheet");
    Simulation simulation(scene, std::make_unique<Blind>(), std::make_unique<Poisonous>(sheet.first + sheet.count / 2),
                          meeting_triangles());
    Frame before;
    for (int tick = 0; tick < 5; ++tick) simulation.step();
    before = simulation.frame();
    const StepRow row = simulation.step();
    EXPECT_EQ(row.outcome, OutcomeKind::not_finite);
    EXPECT_TRUE(simulation.outcome().message.starts_with("respond: ")) << simulation.outcome().message;
    EXPECT_EQ(simulation.frame().position, before.position);
    EXPECT_EQ(simulation.frame().tick, before.tick);
    EXPECT_EQ(simulation.step().outcome, OutcomeKind::not_finite) << "a failed run does not go on";
}

TEST(Simulation, MethodThatThrowsHasFailedAndNothingElse) {
    const Scene scene = scene_from_text(poke_text());
    Simulation simulation(scene, std::make_unique<Throwing>(), std::make_unique<Idle>(), meeting_triangles());
    for (int tick = 0; tick < 3; ++tick) EXPECT_EQ(simulation.step().outcome, OutcomeKind::ok);
    EXPECT_EQ(simulation.step().outcome, OutcomeKind::threw);
    EXPECT_NE(simulation.outcome().message.find("detect: out of cheese"), std::string::npos);
}

TEST(Simulation, ALoadThatNoContactCarriesIsShownForTheWholeInstrumentWithItsMomentAboutTheTip) {
    nlohmann::json text = nlohmann::json::parse(poke_text());
    nlohmann::json tool = text["bodies"][1];
    tool["instrument"] = "grasper";
    tool["tip"] = {0.01, 0.02, -0.03};
    text["bodies"][1] = tool;
    tool["name"] = "jaw";
    text["bodies"].push_back(tool);
    tool["name"] = "hook";
    tool["instrument"] = "hook";
    text["bodies"].push_back(tool);
    const Scene scene = scene_from_text(text.dump());
    std::vector<Wrench> wrench(scene.topology.bodies.size());
    Vector3 force = Vector3::Zero();
    Vector3 moment = Vector3::Zero();
    for (std::size_t b = 0; b < wrench.size(); ++b) {
        if (scene.topology.bodies[b].kind != BodyKind::instrument) continue;
        const auto number = static_cast<double>(b);
        wrench[b] = {.force = Vector3(0.1 + number, -0.2, 0.3 * number),
                     .moment = Vector3(0.01, 0.02 * number, -0.03 - number)};
        if (scene.topology.bodies[b].instrument != "grasper") continue;
        force += wrench[b].force;
        moment += wrench[b].moment;
    }
    Simulation simulation(scene, std::make_unique<Blind>(), std::make_unique<Bearing>(wrench), meeting_triangles());
    const StepRow row = simulation.step();
    ASSERT_TRUE(simulation.outcome().ok()) << simulation.outcome().message;
    for (std::size_t b = 0; b < wrench.size(); ++b) {
        EXPECT_EQ(simulation.body_loads()[b].force, wrench[b].force) << b;
        EXPECT_EQ(simulation.body_loads()[b].moment, wrench[b].moment) << b;
    }
    // The script begins at (0.001, 0.0007, 0.011), not turned.
    const Vector3 tip = Vector3(0.001, 0.0007, 0.011) + Vector3(0.01, 0.02, -0.03);
    EXPECT_LT((row.tool_force - force).norm(), 1e-15);
    EXPECT_LT((row.tool_moment - (moment - tip.cross(force))).norm(), 1e-15);
}

TEST(Simulation, OperatorWithoutContactFollowsItsScript) {
    const Scene scene = scene_from_text(press_text(-0.0005));
    const Range tool = range_of(scene, "tool");
    Simulation simulation(scene, std::make_unique<Blind>(), std::make_unique<Idle>(), meeting_triangles());
    StepRow row;
    for (int tick = 0; tick < 400; ++tick) row = simulation.step();
    EXPECT_GE(row.stage_ns[static_cast<std::size_t>(Stage::advance)], 0);
    EXPECT_EQ(simulation.yielding_pairs(), std::vector<std::uint8_t>{1});
    const Vector3 moved = simulation.frame().position.col(tool.first) - scene.first.position.col(tool.first);
    EXPECT_NEAR(moved.z(), -0.0005, 1e-6);
}

TEST(Simulation, ReplayAnswersLikeTheLoopThatMadeTheFrames) {
    const Scene scene = scene_from_text(poke_text());
    const auto source = scene_frames(scene, 45);
    Simulation replay(scene, neutral_pairs(), nullptr, meeting_triangles());
    Frame frame;
    std::int64_t pairs = 0;
    while (source->next(frame)) {
        const StepRow row = replay.replay(frame);
        EXPECT_EQ(row.tick, frame.tick);
        EXPECT_EQ(row.outcome, OutcomeKind::ok);
        EXPECT_EQ(row.contacts_offered, row.pairs);
        EXPECT_TRUE(std::isnan(row.tool_force.x()));
        pairs += row.pairs;
    }
    EXPECT_GT(pairs, 0);
    // One bad frame is that frame's outcome; the next one is answered again.
    Frame bad = frame;
    bad.position(1, 3) = std::nan("");
    ASSERT_FALSE(replay.contacts().pairs.empty());
    const StepRow failed = replay.replay(bad);
    EXPECT_EQ(failed.outcome, OutcomeKind::not_finite);
    EXPECT_EQ(failed.pairs, 0);
    EXPECT_TRUE(replay.contacts().pairs.empty()) << "pairs of the frame before are no answer to this one";
    EXPECT_EQ(replay.replay(frame).outcome, OutcomeKind::ok);
}

TEST(QueryDistance, IsTheMarginDoubledUntilItHoldsWhatMayCome) {
    // One triangle of tissue with sides of 3, 4 and 5 mm: a mean edge of 4 mm, a margin of 0.4 mm.
    Scene scene;
    scene.topology = make_topology({test::triangle_body("one", BodyKind::tissue, false)});
    scene.first.position = Matrix3X::Zero(3, 3);
    scene.first.position(0, 1) = 0.003;
    scene.first.position(1, 2) = 0.004;
    const QueryDistance query_distance(scene);
    EXPECT_NEAR(query_distance.edge(), 0.004, 1e-15);
    struct Case {
        double driven, tissue, deep;  // mm
        double query_distance;        // mm
        bool is_cut;
    };
    for (const Case& one_case : {Case{0.0, 0.0, 0.0, 0.4, false},
                                 {0.0, 0.5, 0.0, 1.6, false},
                                 {0.5, 0.0, 0.0, 1.6, false},
                                 {0.0, 0.0, 0.5, 1.6, false},
                                 {0.2, 0.3, 0.4, 1.6, false},
                                 {1.5, 1.0, 0.0, 3.2, false},
                                 {0.0, 3.0, 3.5, 12.8, false},
                                 {40.0, 0.0, 0.0, 51.2, false},
                                 // Of what tissue does, two mean edges.
                                 {0.0, 30.0, 0.0, 12.8, true},
                                 {0.0, 60.0, 90.0, 12.8, true}}) {
        const auto& [driven, tissue, deep, expected, is_cut] = one_case;
        EXPECT_NEAR(query_distance.of(1e-3 * driven, 1e-3 * tissue, 1e-3 * deep), 1e-3 * expected, 1e-12)
            << driven << " " << tissue << " " << deep;
        EXPECT_EQ(query_distance.is_cut(1e-3 * driven, 1e-3 * tissue, 1e-3 * deep), is_cut)
            << driven << " " << tissue << " " << deep;
    }
}

TEST(ContactGenerator, UnknownWordIsRefused) {
    EXPECT_EQ(registry().contact_generator("native").name, "native");
    EXPECT_THROW((void)registry().contact_generator("magic"), InputError);
}

}  // namespace
}  // namespace trocar
