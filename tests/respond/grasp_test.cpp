// Grasping (METHODS §10) on one vertex that hangs on one spring, where every force has a closed form.
#include "respond/grasp.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "method/registry.hpp"
#include "scene/scene.hpp"
#include "simulate/simulation.hpp"
#include "support/materials.hpp"
#include "support/meshes.hpp"
#include "support/reported_contacts.hpp"
#include "support/scene_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

/// Corners of two jaws above and below the origin, and of a tissue triangle whose first corner lies between them and
/// whose second one is so far (m) along x.
Matrix3X jaws_over_tissue(double along) {
    Matrix3X position(3, 9);
    position.col(0) = Vector3(0.0, 0.0, 0.0005);
    position.col(1) = Vector3(-0.001, 0.0, 0.01);
    position.col(2) = Vector3(0.0, 0.001, 0.01);
    position.col(3) = Vector3(0.0, 0.0, -0.0005);
    position.col(4) = Vector3(-0.001, 0.0, 0.008);
    position.col(5) = Vector3(0.0, -0.001, 0.008);
    position.col(6) = Vector3::Zero();
    position.col(7) = Vector3(along, 0.0, 0.0);
    position.col(8) = Vector3(0.0, 0.05, 0.0);
    return position;
}

/// A response that holds what its jaws grasp by springs, and does nothing else.
class GraspAlone final : public Response {
public:
    explicit GraspAlone(const GraspSettings& settings) : settings_(settings) {}
    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        materials_ = &materials;
        springs_.prepare(topology, materials);
        grasp_.prepare(topology, materials, settings_);
    }
    void respond(const Frame& frame, double dt, const ContactSet& contacts,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        grasp_.update(*topology_, *materials_, frame, contacts);
        grasp_.hold_by_springs(*materials_, springs_, frame, dt, output);
        output.grasped = static_cast<std::int64_t>(grasp_.held().size());
        grasp_.remember(frame);
    }

private:
    GraspSettings settings_;
    const Topology* topology_ = nullptr;
    const Materials* materials_ = nullptr;
    VertexSprings springs_;
    Grasp grasp_;
};

/// A tool of two jaws (triangles above and below the origin) and a tissue triangle whose first corner lies between
/// them; its spring of 100 N/m and 10 mm leads along x to a pinned corner.
struct Bench {
    static constexpr double spring_k = 100.0;  // N/m
    static constexpr double rest = 0.01;       // m
    static constexpr Index held = 6;           // the tissue vertex between the jaws
    Topology topology;
    Materials materials;
    Frame frame;
    ContactSet contacts;
    ResponseOutput output;
    std::vector<Wrench> reaction;
    std::unique_ptr<Response> response;
    std::unique_ptr<MassSpring> tissue;

    explicit Bench(const std::string& method) : Bench(make_response(method)) {}
    explicit Bench(const GraspSettings& settings, double strain_limit = 10.0)
        : Bench(std::make_unique<GraspAlone>(settings), strain_limit) {}
    explicit Bench(std::unique_ptr<Response> of, double strain_limit = 10.0) : response(std::move(of)) {
        Triangles jaws(3, 2);
        jaws.col(0) << 0, 1, 2;
        jaws.col(1) << 3, 4, 5;
        topology =
            make_topology({Body{.name = "tool", .kind = BodyKind::instrument, .vertex_count = 6, .triangles = jaws},
                           test::triangle_body("tissue", BodyKind::tissue, false)});
        frame.position = jaws_over_tissue(rest);
        frame.previous = frame.position;
        frame.velocity = Matrix3X::Zero(3, 9);
        frame.pose.assign(2, {});
        materials = test::empty_materials(topology);
        materials.springs = {{.i = 6, .j = 7, .rest = rest, .k = spring_k}};
        materials.pinned = {0, 0, 0, 0, 0, 0, 0, 1, 1};
        for (std::size_t v = 6; v < 9; ++v) materials.mass[v] = 1e-4;
        materials.drag[6] = 0.1;
        materials.strain_limit = strain_limit;
        output.resize(9, 2);
        response->prepare(topology, materials);
        tissue = std::make_unique<MassSpring>(topology, materials);
    }

    /// The tissue corner as it touches a jaw: named by a pair, too flat to be pushed.
    void touch(Index jaw) {
        Contact contact;
        contact.a = jaw;
        contact.b = 2;
        contact.kind = ContactCase::coplanar;
        contact.normal = jaw == 0 ? Vector3(-Vector3::UnitZ()) : Vector3(Vector3::UnitZ());
        contacts.contacts.push_back(contact);
    }
    /// One tick with the jaw at `jaw` and the tool moved by `travel` along -x.
    void step(double jaw, double travel) {
        const Vector3 before = frame.pose[0].translation;
        const Vector3 now(-travel, 0.0, 0.0);
        for (Index v = 0; v < 6; ++v) {
            frame.previous.col(v) = frame.position.col(v);
            frame.position.col(v) += now - before;
            frame.velocity.col(v) = (now - before) / 1e-3;
        }
        frame.pose[0].translation = now;
        frame.pose[0].jaw = jaw;
        test::report_at_tick_start(topology, frame, contacts);
        response->respond(frame, 1e-3, contacts, {}, output);
        reaction.assign(2, {});
        ASSERT_TRUE(tissue->advance(output, 1e-3, frame, reaction).ok());
    }
    void settle(double jaw, double travel, int ticks = 400) {
        for (int tick = 0; tick < ticks; ++tick) step(jaw, travel);
    }
    /// Force on the tool, N: what the tissue's integrator gave back and what the response added.
    [[nodiscard]] Vector3 tool_force() const { return reaction[0].force + output.wrench[0].force; }
    /// Of the one spring and the vertex that hangs on it, J.
    [[nodiscard]] double energy() const {
        const double stretch = strain() * rest;
        const double speed = frame.velocity.col(held).norm();
        return 0.5 * spring_k * stretch * stretch + 0.5 * materials.mass[held] * speed * speed;
    }
    [[nodiscard]] double strain() const { return (frame.position.col(7) - frame.position.col(6)).norm() / rest - 1.0; }
    /// Closes on the vertex with both jaws touching.
    void close() {
        touch(0);
        touch(1);
        step(1.0, 0.0);
        step(0.1, 0.0);
        contacts.clear();
    }
};

TEST(Grasp, FollowedVertexLoadsTheToolWithStiffnessTimesTravel) {
    Bench bench("thesis");
    bench.close();
    ASSERT_EQ(bench.output.grasped, 1);
    EXPECT_LT(bench.tool_force().norm(), 1e-9) << "taking hold shows no force of its own";
    for (const double travel : {0.001, 0.004, 0.02}) {
        bench.settle(0.1, travel, 3);
        EXPECT_NEAR(bench.frame.position(0, Bench::held), -travel, 1e-12);
        EXPECT_NEAR(bench.tool_force().x(), Bench::spring_k * travel, 1e-9);
    }
}

TEST(Grasp, HoldsWhatLiesNoFurtherFromTheTipThanTheJawsAreLong) {
    // The tip is 20 mm beyond the vertex.
    for (const bool both_jaws : {true, false}) {
        for (const auto& [length, holds] : {std::pair{0.012, 0}, {0.018, 0}, {0.022, 1}, {0.12, 1}}) {
            Bench bench(GraspSettings{.both_jaws = both_jaws, .jaw_length = length});
            bench.materials.tip[0] = Vector3(0.0, 0.0, -0.02);
            bench.close();
            EXPECT_EQ(bench.output.grasped, holds) << both_jaws << " " << length;
        }
    }
}

TEST(Grasp, HeldBySpringsItIsTwoSpringsInSeries) {
    for (const double k : {300.0, 900.0}) {
        Bench bench(GraspSettings{.both_jaws = true, .stiffness = k});
        bench.close();
        ASSERT_EQ(bench.output.grasped, 1);
        EXPECT_LT(bench.tool_force().norm(), 1e-9) << "taking hold shows no force of its own";
        for (int tick = 0; tick <= 100; ++tick) bench.step(0.1, 4e-5 * tick);
        bench.settle(0.1, 0.004);
        EXPECT_NEAR(bench.tool_force().x(), 0.004 * k * Bench::spring_k / (k + Bench::spring_k), 1e-6);
    }
}

TEST(Grasp, SlipsJustAboveTheSlipForceAndSaysSo) {
    // In series 300 and 100 N/m carry 75 N/m × travel: 2 N at 26.67 mm.
    const auto detached = [](const auto& method, double travel) {
        Bench bench(method);
        bench.close();
        std::int64_t count = 0;
        for (double x = 0.0; x <= travel; x += 2e-5) {
            bench.step(0.1, x);
            count += bench.output.detached;
        }
        for (int tick = 0; tick < 400; ++tick) {
            bench.step(0.1, travel);
            count += bench.output.detached;
        }
        EXPECT_EQ(bench.output.grasped, 1 - count);
        return count;
    };
    EXPECT_EQ(detached("thesis:profile=corrected", 0.025), 0);
    EXPECT_EQ(detached("thesis:profile=corrected", 0.028), 1);
    EXPECT_EQ(detached(GraspSettings{.both_jaws = true, .slip_force = 1.0}, 0.0145), 1);
    EXPECT_EQ(detached(GraspSettings{.both_jaws = true, .slip_force = 3.0}, 0.028), 0);
    EXPECT_EQ(detached("thesis", 0.028), 0) << "the thesis knows no slip";
}

TEST(Grasp, TearsLooseAtTheStrainLimit) {
    Bench bench(GraspSettings{.both_jaws = true, .slip_force = 1000.0}, 1.0);
    bench.close();
    std::int64_t count = 0;
    double largest = 0.0;
    for (int tick = 0; tick < 2000 && count == 0; ++tick) {
        bench.step(0.1, 2e-5 * tick);
        count += bench.output.detached;
        largest = std::max(largest, bench.strain());
    }
    EXPECT_EQ(count, 1);
    EXPECT_GT(largest, 0.99);
}

TEST(Grasp, ClosesBelowTwoTenthsAndOpensAboveThree) {
    Bench bench("thesis");
    bench.touch(0);
    const auto grasped = [&](double jaw) {
        bench.step(jaw, 0.0);
        return bench.output.grasped;
    };
    EXPECT_EQ(grasped(1.0), 0);
    EXPECT_EQ(grasped(0.25), 0);
    EXPECT_EQ(grasped(0.21), 0);
    EXPECT_EQ(grasped(0.19), 1);
    EXPECT_EQ(grasped(0.25), 1) << "hysteresis";
    EXPECT_EQ(grasped(0.29), 1);
    EXPECT_EQ(grasped(0.31), 0);
    EXPECT_EQ(grasped(0.25), 0) << "only falling through 0.2 closes";
    EXPECT_EQ(grasped(0.19), 1);
}

TEST(Grasp, OneJawIsEnoughForTheThesisAndNotForTheCorrection) {
    for (const bool corrected : {false, true}) {
        Bench bench(corrected ? "thesis:profile=corrected" : "thesis");
        bench.touch(0);
        bench.step(1.0, 0.0);
        bench.step(0.1, 0.0);
        EXPECT_EQ(bench.output.grasped, corrected ? 0 : 1);
    }
}

TEST(Grasp, JawsThatAreBodiesOfOneInstrumentCloseTogetherAndThoseOfTwoDoNot) {
    // One jaw above and one below a tissue corner; both jaws must touch it.
    for (const bool is_one : {true, false}) {
        const Topology topology =
            make_topology({test::triangle_body("upper", BodyKind::instrument, true, "grasper"),
                           test::triangle_body("lower", BodyKind::instrument, true, is_one ? "grasper" : "hook"),
                           test::triangle_body("tissue", BodyKind::tissue, false)});
        Materials materials = test::empty_materials(topology);
        materials.mass.assign(9, 1e-4);
        Frame frame;
        frame.position = jaws_over_tissue(0.05);
        frame.pose.assign(3, {});
        ContactSet contacts;
        for (const Index jaw : {0, 1}) {
            Contact contact;
            contact.a = contact.body_a = jaw;
            contact.b = contact.body_b = 2;
            contact.kind = ContactCase::coplanar;
            contact.normal = jaw == 0 ? Vector3(-Vector3::UnitZ()) : Vector3(Vector3::UnitZ());
            contacts.contacts.push_back(contact);
        }
        Grasp grasp;
        grasp.prepare(topology, materials, {.both_jaws = true});
        grasp.remember(frame);
        for (Pose& pose : frame.pose) pose.jaw = 0.1;
        grasp.update(topology, materials, frame, contacts);
        ASSERT_EQ(grasp.held().size(), is_one ? 1U : 0U);
        EXPECT_EQ(grasp.holds(6, 0), is_one);
        EXPECT_EQ(grasp.holds(6, 1), is_one) << "what one part holds, no part pushes away";
    }
}

TEST(Grasp, TakesWhatTouchesTheJawsWithinTheirCylinderByEveryKindOfContact) {
    // A tool of three corners far from the origin, whose jaws lead from its tip towards its middle, 12 mm long and
    // 2.5 mm thick to every side. The tissue's only spring is 10 mm long: nearer than 0.2 mm touches.
    const Vector3 tip(0.4, -0.7, 0.9);
    const Vector3 axis(0.6, 0.0, 0.8);
    const Topology topology = make_topology(
        {test::triangle_body("tool", BodyKind::instrument), test::triangle_body("tissue", BodyKind::tissue, false)});
    Materials materials = test::empty_materials(topology);
    materials.springs = {{.i = 3, .j = 4, .rest = 0.01, .k = 100.0}};
    materials.mass.assign(6, 1e-4);
    materials.tip.assign(2, tip);
    // Of the tissue's corners the first is so far (m) along the jaws and to the side, the others are too far away.
    const auto held = [&](ContactCase kind, double along, double aside, double gap) {
        Frame frame;
        frame.position.resize(3, 6);
        frame.position.col(0) = tip + 0.05 * axis + Vector3(0.0, 0.002, 0.0);
        frame.position.col(1) = tip + 0.05 * axis + Vector3(0.0, -0.001, 0.001);
        frame.position.col(2) = tip + 0.05 * axis - Vector3(0.0, 0.001, 0.001);
        frame.position.col(3) = tip + along * axis + aside * Vector3::UnitY();
        frame.position.col(4) = frame.position.col(5) = tip + Vector3(0.1, 0.1, 0.1);
        frame.pose.assign(2, {});
        Contact contact;
        contact.kind = kind;
        contact.body_a = 0;
        contact.body_b = 1;
        contact.normal = Vector3::UnitY();
        if (kind == ContactCase::point_face) {
            contact.on_a = ContactPoint::at_vertex(0);
            contact.on_b = {{4, 5, 3}, {0.2, 0.3, 0.5}};
            contact.gap = gap;
        } else if (kind == ContactCase::edge_edge) {
            contact.on_a = {{0, 1, -1}, {0.5, 0.5, 0.0}};
            contact.on_b = {{4, 3, -1}, {0.5, 0.5, 0.0}};
            contact.gap = gap;
        } else {
            contact.a = 0;
            contact.b = 1;
        }
        ContactSet contacts;
        contacts.contacts.push_back(contact);
        Grasp grasp;
        grasp.prepare(topology, materials, {});
        grasp.remember(frame);
        frame.pose[0].jaw = 0.1;
        grasp.update(topology, materials, frame, contacts);
        EXPECT_TRUE(grasp.held().empty() || grasp.held().front().vertex == 3);
        return grasp.held().size();
    };
    struct Place {
        double along, aside;  // m
        std::size_t holds;
    };
    for (const Place& place : {Place{0.0119, 0.0, 1},
                               {0.0121, 0.0, 0},
                               {0.006, 0.0024, 1},
                               {0.006, -0.0026, 0},
                               {-0.0024, 0.0, 1},
                               {-0.0026, 0.0, 0}}) {
        for (const ContactCase kind : {ContactCase::coplanar, ContactCase::point_face, ContactCase::edge_edge}) {
            EXPECT_EQ(held(kind, place.along, place.aside, 1e-4), place.holds)
                << static_cast<int>(kind) << " at " << place.along << ", " << place.aside;
        }
        EXPECT_EQ(held(ContactCase::touch, place.along, place.aside, 0.0), 0U) << "what only touches in a point";
    }
    for (const ContactCase kind : {ContactCase::point_face, ContactCase::edge_edge}) {
        EXPECT_EQ(held(kind, 0.006, 0.0, 1.9e-4), 1U) << static_cast<int>(kind);
        EXPECT_EQ(held(kind, 0.006, 0.0, 2.1e-4), 0U) << static_cast<int>(kind);
    }
    materials.pinned[3] = 1;
    EXPECT_EQ(held(ContactCase::coplanar, 0.006, 0.0, 0.0), 0U) << "what is held already";
}

TEST(Grasp, ReleasedVertexComesToRest) {
    for (const char* method : {"thesis", "thesis:profile=corrected"}) {
        Bench bench(method);
        bench.close();
        for (int tick = 0; tick <= 100; ++tick) bench.step(0.1, 5e-5 * tick);
        double largest = 0.0;
        for (int tick = 0; tick < 400; ++tick) {
            bench.step(1.0, 0.005);
            if (tick < 50) largest = std::max(largest, bench.frame.velocity.col(Bench::held).norm());
            EXPECT_EQ(bench.output.grasped, 0);
        }
        EXPECT_LT(bench.frame.velocity.col(Bench::held).norm(), 1e-3 * largest) << method;
        EXPECT_EQ(bench.tool_force().norm(), 0.0) << method;
    }
}

TEST(Grasp, LettingGoTheForceFallsEvenlyToZero) {
    // At rest 300 and 100 N/m in series carry 75 N/m × travel; while it is let go the vertex stays near equilibrium.
    constexpr double travel = 0.005;
    constexpr double first = 75.0 * travel;
    for (const int ticks : {100, 200}) {
        Bench bench(GraspSettings{.both_jaws = true, .release_time = 1e-3 * ticks});
        bench.close();
        for (int tick = 0; tick <= 100; ++tick) bench.step(0.1, travel / 100 * tick);
        bench.settle(0.1, travel);
        ASSERT_NEAR(bench.tool_force().x(), first, 1e-6);
        // It moves by first / 100 N/m meanwhile, against its drag and the grasp's damper.
        const double speed = first / Bench::spring_k / (1e-3 * ticks);
        const double dampers = (2.0 * std::sqrt(300.0 * 1e-4) + 0.1) * speed;
        for (int tick = 1; tick <= ticks + 10; ++tick) {
            bench.step(1.0, travel);
            EXPECT_EQ(bench.output.grasped, 0);
            const double left = std::max(0.0, 1.0 - static_cast<double>(tick) / ticks);
            EXPECT_NEAR(bench.tool_force().x(), left * first, dampers + 0.01 * first) << tick;
            EXPECT_NEAR(bench.strain() * Bench::rest * Bench::spring_k, left * first, dampers + 0.01 * first) << tick;
        }
        EXPECT_EQ(bench.tool_force().norm(), 0.0);
    }
}

TEST(Grasp, LetGoAtOnceWithoutReleaseTimeOrByTheThesis) {
    const auto let_go = [](Bench bench, const char* what) {
        bench.close();
        bench.settle(0.1, 0.005);
        ASSERT_GT(bench.tool_force().x(), 0.3) << what;
        bench.step(1.0, 0.005);
        EXPECT_EQ(bench.tool_force().norm(), 0.0) << what;
    };
    let_go(Bench("thesis"), "thesis");
    let_go(Bench(GraspSettings{.both_jaws = true, .release_time = 0.0}), "no release time");
}

TEST(Grasp, LettingGoAddsNoEnergy) {
    double slower_than = std::numeric_limits<double>::infinity();
    for (const double time : {0.0, 0.002, 0.01, 0.05, 0.2}) {
        Bench bench(GraspSettings{.both_jaws = true, .release_time = time});
        bench.close();
        for (int tick = 0; tick <= 100; ++tick) bench.step(0.1, 5e-5 * tick);
        bench.settle(0.1, 0.005);
        double before = bench.energy();
        double fastest = 0.0;
        for (int tick = 0; tick < 300; ++tick) {
            bench.step(1.0, 0.005);
            EXPECT_LE(bench.energy(), before * (1.0 + 1e-9) + 1e-18) << time << " tick " << tick;
            before = bench.energy();
            fastest = std::max(fastest, bench.frame.velocity.col(Bench::held).norm());
        }
        // Held back for longer, it gets less fast.
        EXPECT_LT(fastest, slower_than) << time;
        slower_than = fastest;
    }
}

TEST(Grasp, TakenAgainWhileLetGoItIsHeldByOneSpring) {
    Bench bench("thesis:profile=corrected");
    bench.close();
    for (int tick = 0; tick <= 100; ++tick) bench.step(0.1, 5e-5 * tick);
    bench.step(1.0, 0.005);
    ASSERT_EQ(bench.output.contacts.size(), 3U) << "one for each axis";
    bench.touch(0);
    bench.touch(1);
    bench.step(0.1, 0.005);
    EXPECT_EQ(bench.output.grasped, 1);
    EXPECT_EQ(bench.output.contacts.size(), 3U);
}

/// What a shipped scene shows of its grasp.
struct Shown {
    std::int64_t most = 0;        ///< vertices held
    std::int64_t detached = 0;    ///< vertices that slipped
    double strain = 0.0;          ///< largest
    double jump_at_attach = 0.0;  ///< N
    double jump = 0.0;            ///< N, from one tick to the next, the largest once something was held
    bool grew_while_closed = false;
    double speed_at_end = 0.0;  ///< m/s, largest of the tissue
    std::int64_t held_at_end = 0;
};

Shown run_shipped(const char* name, const std::string& method) {
    const Scene scene = test::shipped_scene(name);
    Simulation simulation(scene, make_detector("ohc"), make_response(method),
                          registry().contact_generator("intersection"));
    Shown shown;
    StepRow last;
    for (std::int64_t tick = 0; tick < scene.ticks; ++tick) {
        const StepRow row = simulation.step();
        EXPECT_EQ(row.outcome, OutcomeKind::ok) << name << " tick " << tick;
        if (tick > 0 && last.grasped == 0 && row.grasped > 0) {
            shown.jump_at_attach = std::max(shown.jump_at_attach, (row.tool_force - last.tool_force).norm());
        } else if (tick > 0 && row.grasped > last.grasped) {
            shown.grew_while_closed = true;
        }
        if (shown.most > 0) shown.jump = std::max(shown.jump, (row.tool_force - last.tool_force).norm());
        shown.most = std::max(shown.most, row.grasped);
        shown.detached += row.detached;
        shown.strain = std::max(shown.strain, row.max_strain);
        last = row;
    }
    shown.held_at_end = last.grasped;
    const Range tissue = scene.topology.bodies.back().vertices;
    shown.speed_at_end = simulation.frame().velocity.middleCols(tissue.first, tissue.count).colwise().norm().maxCoeff();
    return shown;
}

TEST(GraspScenes, PullToLargeStrainAndLetGo) {
    for (const char* name : {"i2t_grasp", "i2t_two_grasp"}) {
        for (const bool corrected : {false, true}) {
            const Shown shown = run_shipped(name, corrected ? "thesis:profile=corrected" : "thesis");
            EXPECT_GE(shown.most, 3) << name;
            EXPECT_FALSE(shown.grew_while_closed) << name;
            EXPECT_EQ(shown.held_at_end, 0) << name;
            EXPECT_LT(shown.speed_at_end, 0.2) << name << ": it swings out";
            if (corrected) {
                EXPECT_LE(shown.jump_at_attach, 0.5) << name;
                EXPECT_LE(shown.jump, 0.5) << name << ": nor when it slips or is let go";
                EXPECT_GT(shown.strain, 0.9) << name;
                EXPECT_LT(shown.strain, 1.001) << name << ": the strain limit holds";
                EXPECT_EQ(shown.detached, shown.most) << name << ": at the limit every vertex slips";
            } else {
                EXPECT_GT(shown.strain, 2.0) << name << ": follows the tool whatever the strain";
                EXPECT_EQ(shown.detached, 0) << name;
            }
        }
    }
}

TEST(GraspScenes, LetGoAtOnceTheForceJumps) { EXPECT_GT(run_shipped("i2t_grasp", "thesis").jump, 1.0); }

}  // namespace
}  // namespace trocar
