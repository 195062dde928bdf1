// Ways of touching tissue that no shipped scene has: the corrected response keeps to 0.1 mm in every tick or names a
// rupture, and never answers with a force that no tissue could give.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "measure/depth_truth.hpp"
#include "support/closed_loop.hpp"

namespace trocar {
namespace {

using test::ClosedLoop;
using test::LoopBody;
using test::make_shaft;
using test::make_sheet;
using test::Mesh;

constexpr double clear = 1e-4;  // m, what the requirement calls clear

/// What a run comes to.
struct Course {
    double worst_depth = 0.0;  ///< m, after any tick
    double last_depth = 0.0;   ///< m
    double force = 0.0;        ///< N, largest on the tool
    std::int64_t ruptures = 0;
};

/// Body 0 is the tool.
Course run(ClosedLoop& loop, int ticks) {
    Course course;
    DepthTruth truth(loop.topology, loop.frame);
    for (int tick = 0; tick < ticks; ++tick) {
        if (!loop.step()) {
            ADD_FAILURE() << "tick " << tick << ": " << loop.outcome.message;
            break;
        }
        course.last_depth = truth.measure(loop.frame).max_depth;
        course.worst_depth = std::max(course.worst_depth, course.last_depth);
        course.force = std::max(course.force, loop.tool_force(0).norm());
        course.ruptures += loop.effect.ruptures;
    }
    return course;
}

ClosedLoop loop_of(const Mesh& tool, std::function<Vector3(double)> offset, const Mesh& sheet,
                   const std::string& method = "thesis:profile=corrected") {
    return ClosedLoop(
        {LoopBody{.name = "tool", .kind = BodyKind::instrument, .mesh = tool, .offset = std::move(offset)},
         LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = sheet}},
        method);
}

TEST(CorrectedLanding, FlatEndThatComesToStandExactlyInTheSheetsPlaneThrowsNothingIntoIt) {
    // At 40 ms all of the end's triangles lie in the sheet's plane, to rounding: the triangles overlap by millimetres
    // in the plane that they share, and nothing is inside. Then it stands, or goes on.
    for (const double depth : {0.0, 0.004}) {
        ClosedLoop loop = loop_of(
            make_shaft(0.006, 0.05, 12, 0.0),
            [depth](double t) { return Vector3(0.0013, 0.0007, 0.001 - std::min(0.025 * t, 0.001 + depth)); },
            make_sheet(12, 0.005));
        const Course course = run(loop, 260);
        EXPECT_LE(course.worst_depth, clear) << depth;
        EXPECT_EQ(course.ruptures, 0) << depth;
    }
}

}  // namespace
}  // namespace trocar
