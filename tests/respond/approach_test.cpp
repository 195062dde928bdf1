// Contact before it is late (approach=on): tissue that a tool or bone meets within a tick is held from that tick on.
// Against closed forms: a plane that nothing passes, momentum of an impact without rebound, and no force at all from
// what does not meet.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "measure/depth_truth.hpp"
#include "method/registry.hpp"
#include "scene/scene.hpp"
#include "simulate/simulation.hpp"
#include "support/closed_loop.hpp"
#include "support/created_energy.hpp"
#include "support/known_gap.hpp"
#include "support/scene_runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using test::ClosedLoop;
using test::LoopBody;
using test::make_box;
using test::make_sheet;

const std::string unilateral = "unilateral";

// ---------------------------------------------------------------- tissue that flies into a face

constexpr double speed = 1.0;  // m/s

/// A free sheet of 30 mm that flies at 1 m/s onto the middle of a block's top of 80 mm, in whose frame z is up; the
/// block is turned by `turn`. Triangles of a sheet that is inside altogether cross nothing.
class ThrownSheet {
public:
    ThrownSheet(const std::string& method, const Eigen::Quaterniond& turn, double height)
        : loop_({LoopBody{.name = "block", .kind = BodyKind::rigid, .mesh = turned(make_box(size), turn, 0.0)},
                 LoopBody{.name = "sheet",
                          .kind = BodyKind::tissue,
                          .closed = false,
                          .mesh = turned(make_sheet(6, 0.005), turn, 0.5 * size.z() + height),
                          .pin_rim = false}},
                method),
          up_(turn * Vector3::UnitZ()) {
        const Range sheet = loop_.topology.bodies[1].vertices;
        loop_.frame.velocity.middleCols(sheet.first, sheet.count).colwise() = -speed * up_;
    }
    void step() { EXPECT_TRUE(loop_.step()) << loop_.outcome.message; }
    /// Of the lowest vertex over the block's top, m.
    [[nodiscard]] double height() const {
        return (up_.transpose() * sheet(loop_.frame.position)).minCoeff() - 0.5 * size.z();
    }
    /// Away from the block, over what the sheet came with.
    [[nodiscard]] double momentum() const {
        double sum = 0.0;
        double whole = 0.0;
        const Range range = loop_.topology.bodies[1].vertices;
        for (Index v = range.first; v < range.end(); ++v) {
            const double mass = loop_.materials.mass[static_cast<std::size_t>(v)];
            sum += mass * loop_.frame.velocity.col(v).dot(up_);
            whole += mass * speed;
        }
        return sum / whole;
    }
    [[nodiscard]] Matrix3X sheet(const Matrix3X& of) const {
        const Range range = loop_.topology.bodies[1].vertices;
        return of.middleCols(range.first, range.count);
    }
    [[nodiscard]] const ClosedLoop& loop() const { return loop_; }

private:
    inline static const Vector3 size{0.08, 0.08, 0.02};
    static test::Shape turned(test::Shape mesh, const Eigen::Quaterniond& turn, double up) {
        for (Vector3& point : mesh.vertices) point = turn * (point + up * Vector3::UnitZ());
        return mesh;
    }

    ClosedLoop loop_;
    Vector3 up_;
};

const std::vector<Eigen::Quaterniond> turns{Eigen::Quaterniond::Identity(),
                                            Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized()};

TEST(Approach, ThrownTissueStopsOnAFaceAndDoesNotComeBackFromIt) {
    for (const Eigen::Quaterniond& turn : turns) {
        for (const double height : {0.0003, 0.0011, 0.00237}) {
            ThrownSheet thrown(unilateral, turn, height);
            const double arrival = height / speed;
            for (int tick = 1; tick <= 30; ++tick) {
                thrown.step();
                EXPECT_GE(thrown.height(), -1e-6) << "from " << height << " in tick " << tick;
                // Drag alone slows it down before; the impact takes all that it has, and gives nothing back.
                const double time = 1e-3 * tick;
                if (time < arrival) {
                    EXPECT_NEAR(thrown.momentum(), -std::exp(-5.0 * time), 1e-3) << "from " << height;
                } else if (time > arrival + 1e-3) {
                    // What it has left closes the rest of the gap within the settle time.
                    constexpr double settle_time = 0.003;
                    EXPECT_LE(thrown.momentum(), 1e-4) << "from " << height << " in tick " << tick;
                    EXPECT_GE(thrown.momentum(), -std::exp((arrival - time) / settle_time)) << "from " << height;
                }
            }
        }
    }
}

// ---------------------------------------------------------------- tools that do not meet the tissue

TEST(Approach, GapWhatPassesByOrLeavesGivesNoForce) {
    test::expect_known_gap(
        "features that pass 8 um beside each other are thought to meet along a slanted way: 0.08 N for a tick", [] {
            struct Travel {
                std::string name;
                std::function<Vector3(double)> place;  ///< of the lowest face's middle
                bool starts_near = false;
            };
            // The contact offset of the sheet is 5 um: within it a tool that stands is moved off.
            const std::vector<Travel> paths{
                {"sideways 0.2 mm above", [](double t) { return Vector3(-0.02 + 1.0 * t, 0.0007, 0.0002); }},
                {"down at 0.5 m/s to 0.05 mm above, and up",
                 [](double t) { return Vector3(0.0011, 0.0007, 5e-5 + 0.5 * std::abs(t - 0.01)); }},
                {"sideways at once from 8 um above", [](double t) { return Vector3(0.0011 + 0.5 * t, 0.0007, 8e-6); },
                 true},
                {"up from 8 um above", [](double t) { return Vector3(0.0011, 0.0007, 8e-6 + 0.5 * t); }}};
            const test::Shape tool = make_box(Vector3(0.012, 0.008, 0.01));
            for (const Travel& path : paths) {
                const auto run = [&](double aside) {
                    const auto offset = [=, place = path.place](double t) -> Vector3 {
                        return place(t) + Vector3(0, 0, 0.005 + aside);
                    };
                    return test::tool_on_tissue(tool, offset, make_sheet(12, 0.005), unilateral);
                };
                ClosedLoop beside = run(0.0);
                ClosedLoop away = run(1.0);
                bool watched = false;
                for (int tick = 0; tick < 20; ++tick) {
                    ASSERT_TRUE(beside.step() && away.step());
                    watched = watched || !beside.output.contacts.empty();
                    EXPECT_EQ(beside.tool_force(0), Vector3(Vector3::Zero())) << path.name << " in tick " << tick;
                    const Range sheet = beside.topology.bodies[1].vertices;
                    const Matrix3X moved =
                        (beside.frame.position - away.frame.position).middleCols(sheet.first, sheet.count);
                    constexpr double rounding = 1e-15;  // m
                    ASSERT_LE(moved.cwiseAbs().maxCoeff(), rounding) << path.name << " in tick " << tick;
                }
                if (path.starts_near) {
                    EXPECT_TRUE(watched) << path.name << ": it should have been examined";
                }
            }
        });
}

// ---------------------------------------------------------------- tools driven by an operator

struct Tool {
    std::string name;
    std::string part;
    double bottom = 0.0;  ///< m, below its origin
};

const std::vector<Tool> tools{
    {"ball", R"({"shape":"sphere","radius":0.008,"edge":0.002})", 0.008},
    {"block", R"({"shape":"box","size":[0.02,0.02,0.01],"edge":0.02})", 0.005},
    {"bar on edge", R"({"shape":"box","size":[0.004,0.06,0.004],"edge":0.06,"pose":[0,0,0,0,45,0]})",
     0.002 * std::numbers::sqrt2},
    {"point", R"({"shape":"shaft","radius":0.002,"length":0.06,"edge":0.002})", 0.0}};

/// An operator drives it at `speed` (m/s) from 20 ms above the plane of a sheet to 3 mm below.
Scene landing(const Tool& tool, double driven_at) {
    const double top = 0.0203 * driven_at;
    constexpr double low = -0.003;
    return test::scene_from_text(fmt::format(
        R"({{"format":"trocar-scene-2","name":"landing","unit":"m","dt":0.001,"ticks":60,"seed":1,"bodies":[
      {{"name":"sheet","kind":"tissue","closed":false,"side":"front",
        "parts":[{{"shape":"sheet","size":[0.1,0.1],"edge":0.005}}],"tissue":{{"pinned":"rim"}}}},
      {{"name":"tool","kind":"instrument","closed":true,"parts":[{}],
       "motion":{{"drive":"operator","keys":[{{"time":0,"pose":[0.0003,0.0002,{},0,0,30]}},
                                            {{"time":{},"pose":[0.0003,0.0002,{},0,0,30]}}]}}}}]}})",
        tool.part, top + tool.bottom, (top - low) / driven_at, low + tool.bottom));
}

struct Touch {
    double depth = 0.0;  ///< m, deepest of either in the other
    double below = 0.0;  ///< m, of the tool's lowest point below the sheet's plane
};

/// After the first tick after which the tool is below the plane of the sheet at rest.
Touch first_touch(const Scene& scene, const std::string& method) {
    Simulation simulation(scene, make_detector("ohc_clustered"), make_response(method),
                          registry().contact_generator(default_contact_generator(parse_method(method))));
    DepthTruth truth(scene.topology, scene.first);
    const Index body = scene.topology.bodies[0].kind == BodyKind::instrument ? 0 : 1;
    const Range tool = scene.topology.bodies[static_cast<std::size_t>(body)].vertices;
    for (int tick = 0; tick < 60; ++tick) {
        simulation.step();
        const double depth = truth.measure(simulation.frame()).residual_penetration;
        const double lowest = simulation.frame().position.middleCols(tool.first, tool.count).row(2).minCoeff();
        if (lowest < 0.0) return {depth, -lowest};
    }
    ADD_FAILURE() << "the tool did not land";
    return {};
}

TEST(Approach, TissueIsClearOfAnOperatorDrivenToolAfterTheTickInWhichItLands) {
    double latest = 0.0;
    for (const Tool& tool : tools) {
        for (const double driven_at : {0.25, 0.5, 1.0, 2.0, 3.0}) {
            const Scene scene = landing(tool, driven_at);
            EXPECT_LE(first_touch(scene, unilateral).depth, 1e-5) << tool.name << " at " << driven_at;
            // The plain spring is as soft as the tissue.
            latest = std::max(latest, first_touch(scene, "penalty").depth);
        }
    }
    EXPECT_GT(latest, 1e-4) << "the test should have seen late contact";
}

TEST(Approach, TissueGainsNoMoreThanAnOperatorGivesWhenItsToolLands) {
    for (const Tool& tool : tools) {
        for (const double driven_at : {0.25, 0.5, 1.0, 2.0, 3.0}) {
            const Scene scene = landing(tool, driven_at);
            test::CreatedEnergy created(scene);
            RunLimits limits;
            limits.observe = [&created](const Simulation& now, const StepRow& /*row*/) { created.observe(now); };
            test::run_scene_with(scene, unilateral, 1000, 0, limits);
            EXPECT_LE(created.share(), 1e-6) << tool.name << " at " << driven_at;
        }
    }
}

}  // namespace
}  // namespace trocar
