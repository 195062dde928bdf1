// Size and mesh: the same scene in another size, of another material or on a finer mesh. Truth is dimensional analysis
// (lengths times s, mass times s³ and forces times s⁴ at the same times is the same motion) and, for the force of a
// ball pressed into a stretched sheet, the catenoid that a film of constant tension makes round it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "respond/tissue_scale.hpp"
#include "support/closed_loop.hpp"
#include "support/known_gap.hpp"
#include "support/scene_runs.hpp"
#include "support/scene_samples.hpp"

namespace trocar {
namespace {

using test::run_scene_with;
using test::scene_from_text;

/// A needle 0.5 mm a tick through the plane of a sheet of 40 mm to `depth` (m), and aside by 6 mm; all lengths times s,
/// forces times s⁴.
Scene stab_in_size(double s, double depth) {
    constexpr double youngs_modulus = 38000.0;
    constexpr double thickness = 0.003;
    constexpr double damping = 0.02;
    const std::string text = fmt::format(
        R"({{"format": "trocar-scene-2", "name": "sized", "unit": "m", "dt": 0.001, "ticks": 120, "seed": 1,
 "bodies": [
  {{"name": "sheet", "kind": "tissue", "closed": false, "side": "front",
   "parts": [{{"shape": "sheet", "size": [{0}, {0}], "edge": {1}}}],
   "tissue": {{"pinned": "rim", "youngs_modulus": {2}, "thickness": {3}, "damping": {4}}}}},
  {{"name": "needle", "kind": "instrument", "closed": true,
   "parts": [{{"shape": "needle", "radius": {5}, "length": {6}, "tip_length": {7}, "edge": {5}}}],
   "motion": {{"drive": "prescribed", "keys": [
     {{"time": 0, "pose": [{8}, {9}, {10}, 0, 0, 0]}},
     {{"time": {11}, "pose": [{8}, {9}, {12}, 0, 0, 0]}},
     {{"time": {13}, "pose": [{14}, {9}, {12}, 0, 0, 0]}}]}}}}],
 "contact": [{{"bodies": ["needle", "sheet"], "k": {15}, "mu": {16}}}]}})",
        0.04 * s, 0.005 * s, youngs_modulus * s * s, thickness * s, damping * s * s * s, 0.002 * s, 0.08 * s, 0.008 * s,
        0.0013 * s, 0.0007 * s, 0.001 * s, (0.001 + depth) / 0.5, -depth * s, (0.001 + depth) / 0.5 + 0.03, 0.0073 * s,
        100.0 * s * s * s, 2.0 * s * s * s);
    return scene_from_text(text);
}

TEST(SameSceneInAnotherSize, TearsNowhereElseAndHasTheSameForceAndDepth) {
    const auto run_in_size = [](double s) { return run_scene_with(stab_in_size(s, 0.008), "unilateral"); };
    const Record here = run_in_size(1.0);
    ASSERT_TRUE(here.outcome.ok()) << here.outcome.message;
    double largest = 0.0;
    for (const StepRow& row : here.rows) largest = std::max(largest, row.tool_force.norm());
    ASSERT_GT(largest, 0.1);
    for (const double s : {0.01, 0.1, 10.0, 100.0}) {
        const Record there = run_in_size(s);
        ASSERT_TRUE(there.outcome.ok()) << "s = " << s << " " << there.outcome.message;
        EXPECT_EQ(there.summary.at(Metric::ruptures), 0.0) << "s = " << s;
        ASSERT_EQ(there.rows.size(), here.rows.size());
        for (std::size_t i = 0; i < here.rows.size(); ++i) {
            const Vector3 force = there.rows[i].tool_force / std::pow(s, 4);
            EXPECT_LT((force - here.rows[i].tool_force).norm(), 0.02 * largest) << "s = " << s << " tick " << i;
            EXPECT_LE(there.rows[i].residual_penetration / s, 1e-4) << "s = " << s << " tick " << i;
        }
    }
}

TEST(SameSceneInAnotherSize, GapTearsWhereItTearsToo) {
    test::expect_known_gap("what counts as deep, 0.1 mm, is a length of its own: at a tenth of the size nothing tears",
                           [] {
                               // 30 mm into a sheet of 40 mm: straight to the middle of a side is 36 mm, to a pinned
                               // corner 41 mm, of springs that are to be at most twice as long; beside the needle's
                               // point they are soon.
                               const auto first_tear = [](double s) {
                                   const Record record = run_scene_with(stab_in_size(s, 0.03), "unilateral");
                                   EXPECT_TRUE(record.outcome.ok()) << record.outcome.message;
                                   for (std::size_t i = 0; i < record.rows.size(); ++i) {
                                       if (record.rows[i].ruptures > 0) return static_cast<int>(i);
                                   }
                                   return -1;
                               };
                               const int here = first_tear(1.0);
                               EXPECT_GT(here, 0);
                               EXPECT_EQ(first_tear(0.01), here);
                               EXPECT_NEAR(first_tear(100.0), here, 2);
                           });
}

TEST(FinerMesh, GapKeepsANeedleThatIsDraggedOverItOutsideAsACoarseOneDoes) {
    test::expect_known_gap("up to 0.28 mm for 8 ticks on edges of 2 mm", [] {
        // 4 mm into a sheet of 60 mm, 11 mm aside at 54 mm/s, and then it stands: for triangles half as large as the
        // needle is thick the same nearness counts as touching.
        for (const double edge : {0.005, 0.0025, 0.002}) {
            const std::string text = fmt::format(
                R"({{"format": "trocar-scene-2", "name": "dragged", "unit": "m", "dt": 0.001, "ticks": 450, "seed": 1,
 "bodies": [
  {{"name": "sheet", "kind": "tissue", "closed": false, "side": "front",
   "parts": [{{"shape": "sheet", "size": [0.06, 0.06], "edge": {}}}], "tissue": {{"pinned": "rim"}}}},
  {{"name": "needle", "kind": "instrument", "closed": true,
   "parts": [{{"shape": "needle", "radius": 0.0015, "length": 0.07, "tip_length": 0.006, "edge": 0.0017}}],
   "motion": {{"drive": "prescribed", "keys": [
     {{"time": 0, "pose": [0.0023, -0.0031, 0.004, 0, 0, 0]}},
     {{"time": 0.15, "pose": [0.0023, -0.0031, -0.004, 0, 0, 0]}},
     {{"time": 0.35, "pose": [0.0123, 0.0009, -0.004, 0, 0, 0]}}]}}}}]}})",
                edge);
            const Record record = run_scene_with(scene_from_text(text), "unilateral");
            ASSERT_TRUE(record.outcome.ok()) << record.outcome.message;
            EXPECT_EQ(record.summary.at(Metric::ruptures), 0.0) << edge;
            for (std::size_t i = 0; i < record.rows.size(); ++i) {
                EXPECT_LE(record.rows[i].residual_penetration, 1e-4) << "edge " << edge << " tick " << i;
            }
        }
    });
}

TEST(TissueScales, AreEdgeSideAndWaveSpeedOfTheMaterialOnAnyMesh) {
    // Squares with diagonals: n (n + 1) springs of length e along each axis and n² of √2 e.
    for (const auto& [n, edge] : {std::pair{4, 0.005}, {9, 0.0011}}) {
        const test::ClosedLoop loop(
            {test::LoopBody{.name = "tool", .mesh = test::make_box(Vector3(1, 1, 1))},
             test::LoopBody{
                 .name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = test::make_sheet(n, edge)}},
            "thesis");
        const std::vector<TissueScale> scales = tissue_scales(loop.topology, loop.materials);
        ASSERT_EQ(scales.size(), 2U);
        EXPECT_EQ(scales[0].edge, 0.0);
        const double straight = 2.0 * n * (n + 1);
        const double diagonal = n * n;
        EXPECT_NEAR(scales[1].edge, edge * (straight + std::sqrt(2.0) * diagonal) / (straight + diagonal), 1e-12);
        EXPECT_NEAR(scales[1].side, n * edge, 1e-12);
        EXPECT_NEAR(scales[1].wave_speed, std::sqrt(38000.0 / 1060.0), 1e-9);
    }
}

// ------------------------------------------------------------ ball on a film
/// Force (N) of a ball of `radius` that is `depth` into a film of `tension` (N/m) on a ring of radius `rim`. Outside
/// the contact a film without pressure is a catenoid r = c cosh(z / c), which meets the ball at the angle θ with c = R
/// sin²θ; the force is 2 π σ c.
double film_force(double radius, double depth, double rim, double tension) {
    double low = 1e-6;
    double high = 1.2;
    double neck = 0.0;
    for (int i = 0; i < 100; ++i) {
        const double angle = 0.5 * (low + high);
        neck = radius * std::pow(std::sin(angle), 2);
        const double reached = radius * (1.0 - std::cos(angle)) +
                               neck * (std::acosh(rim / neck) - std::acosh(radius * std::sin(angle) / neck));
        (reached < depth ? low : high) = angle;
    }
    return 2.0 * std::numbers::pi * tension * neck;
}

/// Mean force over the last 50 ms of a ball that goes 4 mm into a sheet of 60 mm, nearly all of whose tension is
/// preload, at `place` (m).
double pressed_ball(double radius, double edge, const Vector3& place) {
    const std::string text = fmt::format(
        R"({{"format": "trocar-scene-2", "name": "film", "unit": "m", "dt": 0.001, "ticks": 300, "seed": 1,
 "bodies": [
  {{"name": "sheet", "kind": "tissue", "closed": false, "side": "front",
   "parts": [{{"shape": "sheet", "size": [0.06, 0.06], "edge": {0}}}],
   "tissue": {{"pinned": "rim", "youngs_modulus": 1520, "preload": 5}}}},
  {{"name": "ball", "kind": "instrument", "closed": true,
   "parts": [{{"shape": "sphere", "radius": {1}, "edge": 0.002}}],
   "motion": {{"drive": "prescribed", "keys": [
     {{"time": 0, "pose": [{2}, {3}, {4}, 0, 0, 0]}}, {{"time": 0.2, "pose": [{2}, {3}, {5}, 0, 0, 0]}}]}}}}],
 "contact": [{{"bodies": ["ball", "sheet"], "k": 100, "mu": 2}}]}})",
        edge, radius, place.x(), place.y(), radius + 0.001, radius - 0.004);
    const Record record = run_scene_with(scene_from_text(text), "unilateral", 300);
    EXPECT_TRUE(record.outcome.ok()) << record.outcome.message;
    double force = 0.0;
    for (std::size_t i = record.rows.size() - 50; i < record.rows.size(); ++i) {
        force += record.rows[i].tool_force.z() / 50.0;
    }
    return force;
}

TEST(BallOnAFilm, ForceTendsToTheCatenoidsFromAboveWhereverOnTheMeshAndByLessThanATenthWhereTheContactSpansAnEdge) {
    // σ = 1.5 p E h for a network of equilateral triangles (√3 p k, k = √3/2 E h). A square pinned along its rim is
    // for a load in its middle a disc 1.0787 times as wide (conformal radius). Slopes up to a half, for which a
    // network of straight springs is not a film, leave a few percent. The contact's radius is R sin θ = √(R c): 5.0 mm
    // for 15 mm, 3.9 mm for 10 mm.
    const double tension = 1.5 * 5.0 * 1520.0 * 0.003;
    for (const double radius : {0.01, 0.015}) {
        const double film = film_force(radius, 0.004, 1.0787 * 0.03, tension);
        const bool spans_an_edge = std::sqrt(radius * film / (2.0 * std::numbers::pi * tension)) > 0.0049;
        // In the middle of an edge of the mesh of 5 mm, and on a vertex.
        for (const Vector3& place : {Vector3(0, 0, 0), Vector3(0.0025, 0, 0)}) {
            const double coarse = pressed_ball(radius, 0.005, place);
            const double fine = pressed_ball(radius, 0.0025, place);
            EXPECT_LT(std::abs(fine - film), 0.04 * film) << "radius " << radius << " at " << place.transpose();
            EXPECT_GT(coarse, fine);
            EXPECT_LT(coarse, (spans_an_edge ? 1.10 : 1.15) * fine);
        }
    }
}

}  // namespace
}  // namespace trocar
