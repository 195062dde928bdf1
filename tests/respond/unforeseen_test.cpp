// Ways of touching tissue that no shipped scene has: `unilateral` keeps to 0.1 mm in every tick or names a
// rupture, and never answers with a force that no tissue could give.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "support/courses.hpp"
#include "support/known_gap.hpp"
#include "support/scene_runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using test::clear_depth;
using test::ClosedLoop;
using test::Course;
using test::LoopBody;
using test::make_box;
using test::make_shaft;
using test::make_sheet;
using test::run_course;
using test::Shape;
using test::tool_on_tissue;

TEST(UnilateralLanding, FlatEndThatComesToStandExactlyInTheSheetsPlaneThrowsNothingIntoIt) {
    // At 40 ms all of the end's triangles lie in the sheet's plane, to rounding: the triangles overlap by millimetres
    // in the plane that they share, and nothing is inside. Then it stands, or goes on.
    for (const double depth : {0.0, 0.004}) {
        ClosedLoop loop = tool_on_tissue(
            make_shaft(0.006, 0.05, 12, 0.0),
            [depth](double t) { return Vector3(0.0013, 0.0007, 0.001 - std::min(0.025 * t, 0.001 + depth)); },
            make_sheet(12, 0.005), "unilateral");
        const Course course = run_course(loop, 260);
        EXPECT_LE(course.worst_depth, clear_depth) << depth;
        EXPECT_EQ(course.ruptures, 0) << depth;
    }
}

TEST(UnilateralOpenTool, BladeThatCutsDownIntoASheetIsHeldUpAndNotPushedAside) {
    // Two triangles upright over the sheet: half of its vertices are below the blade's plane, none behind the blade.
    // The sheet is flat, so that what carries the blade can lean by the slope of its dent only.
    const Shape blade{{{-0.006, 0.0, 0.0}, {0.006, 0.0, 0.0}, {0.006, 0.0, 0.012}, {-0.006, 0.0, 0.012}},
                      {{0, 1, 2}, {0, 2, 3}}};
    for (const double turn : {0.0, 0.5, 0.8, -0.8, 2.0}) {
        ClosedLoop loop(
            {LoopBody{
                 .name = "blade",
                 .kind = BodyKind::instrument,
                 .closed = false,
                 .mesh = Shape(blade).rotate(Vector3::UnitZ(), turn),
                 .offset =
                     [](double t) {
                         return Vector3(0.0013, 0.0007, 0.001 - 0.05 * std::min({t, 0.08, std::max(0.0, 0.3 - t)}));
                     }},
             LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = make_sheet(12, 0.005)}},
            "unilateral");
        double aside = 0.0;
        double up = 0.0;
        for (int tick = 0; tick < 300; ++tick) {
            ASSERT_TRUE(loop.step()) << loop.outcome.message;
            aside = std::max(aside, loop.tool_force(0).head<2>().norm());
            up = std::max(up, loop.tool_force(0).z());
        }
        EXPECT_GT(up, 0.05) << turn;
        EXPECT_LT(aside, 0.3 * up) << turn;
    }
}

/// Force along its axis over force across on a bar that lies on its edge and is drawn along that edge. The bar is
/// longer than the sheet's triangles: between its ends it touches with points on its edge only.
double drag_share(double friction) {
    const Shape bar = make_box(Vector3(0.034, 0.003, 0.003)).rotate(Vector3::UnitX(), 0.25 * 3.14159265358979);
    const auto offset = [](double t) {
        constexpr double press_until = 0.1;  // s
        const double down = 0.03 * std::min(t, press_until);
        return Vector3(-0.003 + 0.02 * std::max(0.0, t - press_until), 0.0013, 0.0022 - down);
    };
    ClosedLoop loop = tool_on_tissue(bar, offset, make_sheet(8, 0.01), fmt::format("unilateral:friction={}", friction));
    double along = 0.0;
    double across = 0.0;
    for (int tick = 0; tick < 400; ++tick) {
        EXPECT_TRUE(loop.step()) << loop.outcome.message;
        if (tick < 250) continue;
        along -= loop.tool_force(0).x();
        across += loop.tool_force(0).tail<2>().norm();
    }
    EXPECT_GT(across, 150 * 0.02);
    return along / across;
}

/// A needle stuck through the plane of a sheet and dragged along it, by the scene of a stranger.
constexpr const char* dragged_needle =
    R"({"format":"trocar-scene-2","name":"dragged_needle","unit":"m","dt":0.001,"ticks":597,"seed":1,"bodies":[
      {"name":"sheet","kind":"tissue","closed":false,"side":"front",
       "parts":[{"shape":"sheet","size":[0.1,0.1],"edge":0.0025}],"tissue":{"pinned":"rim"}},
      {"name":"needle","kind":"instrument","closed":true,"trocar":[-0.000376,0.002033,0.2],
       "parts":[{"shape":"needle","radius":0.001,"length":0.08,"tip_length":0.005277,"edge":0.002}],
       "motion":{"drive":"prescribed","keys":[{"time":0.02,"pose":[-0.000376,0.002033,0.012,0,0,0]},
                                              {"time":0.05,"pose":[-0.000376,0.002033,-0.005996,0,0,0]},
                                              {"time":0.33743,"pose":[-0.00841,0.01395,-0.004797,0,0,0]}]}}]})";

TEST(UnilateralFold, NeedleDraggedWithItsPointInAPocketIsNotFoldedOver) {
    // The point stays in the bottom of its pocket while the wall ahead is drawn back over the cone: it folds at an edge
    // between the cone's own vertices.
    const Record record = test::run_scene_with(test::scene_from_text(dragged_needle), "unilateral");
    EXPECT_EQ(record.summary.at(Metric::ruptures), 0.0);
    EXPECT_LE(record.summary.at(Metric::residual_penetration_max_m), clear_depth);
    EXPECT_GT(record.summary.at(Metric::force_max_n), 0.3);
}

/// A shaft pressed 4.8 mm into a sheet, where it then stands still for 0.67 s.
constexpr const char* resting_shaft =
    R"({"format":"trocar-scene-2","name":"resting_shaft","unit":"m","dt":0.001,"ticks":700,"seed":1,"bodies":[
      {"name":"sheet","kind":"tissue","closed":false,"side":"front",
       "parts":[{"shape":"sheet","size":[0.1,0.1],"edge":0.0035}],"tissue":{"pinned":"rim"}},
      {"name":"shaft","kind":"instrument","closed":true,"trocar":[0.003494203558375027,-0.0024876330048711247,0.2],
       "parts":[{"shape":"shaft","radius":0.002,"length":0.12,"edge":0.003}],
       "motion":{"drive":"prescribed",
        "keys":[{"time":0,"pose":[0.003494203558375027,-0.0024876330048711247,0.008,0,0,0]},
                {"time":0.02567,"pose":[0.003494203558375027,-0.0024876330048711247,-0.004835484260774331,0,0,0]}]}}]})";

TEST(UnilateralPress, SheetUnderAToolThatStandsStillComesToRest) {
    // The triangle under the middle of the shaft's end tilts while it slides there. Nothing does work on the tissue any
    // more, and its springs are damped.
    const Record record = test::run_scene_with(test::scene_from_text(resting_shaft), "unilateral");
    EXPECT_EQ(record.summary.at(Metric::ruptures), 0.0);
    EXPECT_LE(record.summary.at(Metric::residual_penetration_settled_m), clear_depth);
    EXPECT_GT(record.summary.at(Metric::force_max_n), 0.3);
}

TEST(UnilateralFriction, BarDrawnAlongTheEdgeThatItLiesOnHasFrictionByCoulombsLaw) {
    // What its ends push ahead of them counts apart.
    const double smooth = drag_share(0.0);
    for (const double friction : {0.1, 0.3}) {
        EXPECT_NEAR(drag_share(friction) - smooth, friction, 0.03 * friction) << smooth;
    }
}

/// What a sheet of the loop's material carries at its strain limit round a tool with all triangles that it touches, N:
/// tension E h (preload + limit) times the circumference.
double strength(double radius, double edge) { return 38000.0 * 0.003 * (0.2 + 1.0) * 6.2832 * (radius + edge); }

TEST(UnilateralRim, GapToolOverAPinnedRimTearsItAndIsNotPressedHarderThanTissueCanPress) {
    test::expect_known_gap("no rupture is reported and up to 12 N press at a pinned rim", [] {
        // Pins hold the rim at x = 30 mm where the tool must pass: dragged out over it, pressed on it, dragged in from
        // beyond it, all 3 mm below the sheet's plane.
        struct Travel {
            const char* name;
            std::function<Vector3(double)> offset;
            int last_key;  ///< tick
        };
        const double down = -0.003;
        const auto drag = [](double from, double to, double t) {
            return from + (to - from) * std::clamp((t - 0.1) / 0.5, 0.0, 1.0);
        };
        const Travel travels[] = {
            {"out", [&](double t) { return Vector3(drag(0.015, 0.045, t), 0.0007, std::max(0.005 - 0.1 * t, down)); },
             600},
            {"on it", [&](double t) { return Vector3(0.0302, 0.0007, std::max(0.005 - 0.05 * t, down)); }, 160},
            {"in", [&](double t) { return Vector3(drag(0.05, 0.02, t), 0.0007, down); }, 600}};
        for (const Travel& path : travels) {
            ClosedLoop loop =
                tool_on_tissue(make_shaft(0.004, 0.05, 10, 0.003), path.offset, make_sheet(12, 0.005), "unilateral");
            const Course course = run_course(loop, path.last_key + 200);
            EXPECT_GT(course.ruptures, 0) << path.name;
            EXPECT_LE(course.deep_unreported, 100) << path.name;
            EXPECT_LE(course.force, strength(0.004, 0.005)) << path.name;
        }
    });
}

TEST(UnilateralRim, ToolBesideAPinnedRimIsHeldWithoutTearing) {
    // The tool's side is 2 mm from the rim: triangles that it touches have pinned corners and can still follow.
    ClosedLoop loop = tool_on_tissue(
        make_shaft(0.004, 0.05, 10, 0.003),
        [](double t) { return Vector3(0.024, 0.0007, std::max(0.002 - 0.05 * t, -0.003)); }, make_sheet(12, 0.005),
        "unilateral");
    const Course course = run_course(loop, 300);
    EXPECT_LE(course.worst_depth, clear_depth);
    EXPECT_EQ(course.ruptures, 0);
}

}  // namespace
}  // namespace trocar
