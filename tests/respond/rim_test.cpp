// A tool against the free rim of a hole: the sheet has no face beyond its rim, so that neither sides of faces nor
// depths below them say what is inside the tool.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "measure/depth_truth.hpp"
#include "support/closed_loop.hpp"

namespace trocar {
namespace {

using test::ClosedLoop;
using test::make_shaft;
using test::make_sheet;
using test::Shape;

constexpr double clear = 1e-4;  // m, what the requirement calls clear

/// Without the triangles that have a corner within `radius` of the middle, and without the points that are left over.
/// `round`: the corners of the hole are moved onto a circle.
Shape with_hole(const Shape& sheet, double radius, bool round) {
    Shape mesh;
    std::map<Index, Index> number;
    for (const auto& triangle : sheet.triangles) {
        const bool cut = std::any_of(triangle.begin(), triangle.end(), [&](Index v) {
            return sheet.vertices[static_cast<std::size_t>(v)].head<2>().norm() < radius;
        });
        if (cut) continue;
        std::array<Index, 3> kept{};
        for (std::size_t i = 0; i < 3; ++i) {
            const auto [place, is_new] = number.try_emplace(triangle[i], static_cast<Index>(mesh.vertices.size()));
            if (is_new) mesh.vertices.push_back(sheet.vertices[static_cast<std::size_t>(triangle[i])]);
            kept[i] = place->second;
        }
        mesh.triangles.push_back(kept);
    }
    for (Vector3& p : mesh.vertices) {
        const double r = p.norm();
        if (round && r < 1.25 * radius) p *= radius / r;
    }
    return mesh;
}

/// How far the sheet is inside an upright shaft with this axis and inscribed radius, m: by the distance of its edges
/// from the axis in the plane, where they are above the shaft's end.
double depth_in_shaft(const ClosedLoop& loop, const Vector3& axis, double radius) {
    double deepest = 0.0;
    const auto at = [&](Index v) { return Vector3(loop.frame.position.col(v) - axis); };
    const Range triangles = loop.topology.bodies[1].triangles;
    for (Index t = triangles.first; t < triangles.end(); ++t) {
        for (int i = 0; i < 3; ++i) {
            const Vector3 p = at(loop.topology.triangles(i, t));
            const Vector3 q = at(loop.topology.triangles((i + 1) % 3, t));
            if (std::min(p.z(), q.z()) < 0.0) continue;
            const Eigen::Vector2d edge = (q - p).head<2>();
            const double along = std::clamp(-p.head<2>().dot(edge) / edge.squaredNorm(), 0.0, 1.0);
            deepest = std::max(deepest, radius - (p.head<2>() + along * edge).norm());
        }
    }
    return deepest;
}

struct Drag {
    double radius = 0.004;
    double edge = 0.005;
    double beyond = 0.006;  ///< m, further than to where the shaft touches the hole
    bool round = true;
    double hole = 0.012;  ///< m, radius

    static constexpr int sides = 12;
    static constexpr double speed = 0.1;  ///< m/s
    [[nodiscard]] double path() const { return hole - radius + beyond; }
    [[nodiscard]] Vector3 place(double time) const { return {std::min(speed * time, path()), 0.0007, -0.03}; }
    [[nodiscard]] double inscribed() const { return radius * std::cos(std::numbers::pi / sides); }
    [[nodiscard]] ClosedLoop loop() const {
        const int squares = static_cast<int>(std::lround(0.1 / edge));
        return test::tool_on_tissue(
            make_shaft(radius, 0.06, sides, 0.003), [drag = *this](double time) { return drag.place(time); },
            with_hole(make_sheet(squares, edge), hole, round), "unilateral");
    }
};

class DragAgainstRim : public testing::TestWithParam<Drag> {};

TEST_P(DragAgainstRim, LeavesNoPartOfTheSheetInsideTheShaft) {
    const Drag drag = GetParam();
    ClosedLoop loop = drag.loop();
    DepthTruth truth(loop.topology, loop.frame);
    double force = 0.0;
    for (int tick = 0; tick < 300; ++tick) {
        ASSERT_TRUE(loop.step()) << loop.outcome.message;
        ASSERT_EQ(loop.ruptures, 0) << tick;
        EXPECT_LE(depth_in_shaft(loop, drag.place(loop.frame.time), drag.inscribed()), clear) << tick;
        EXPECT_LE(truth.measure(loop.frame).residual_penetration, clear) << tick;
        force = std::max(force, loop.tool_force(0).norm());
    }
    // It is the sheet that holds the shaft back, not an empty hole.
    EXPECT_GT(force, 0.1);
}

INSTANTIATE_TEST_SUITE_P(UnilateralRim, DragAgainstRim,
                         testing::Values(Drag{}, Drag{.beyond = 0.009}, Drag{.radius = 0.0025}, Drag{.round = false},
                                         Drag{.radius = 0.0025, .round = false}));

/// So far that the sheet folds and crumples in front of the shaft. What is inside on the way is out again 200 ms after
/// the end, and stays out, where the sheet has not torn. Whether a crumpled sheet tears depends on the diagonals of the
/// shaft's faces; one of the five may.
TEST(UnilateralFarDragAgainstRim, EndsWithNoPartOfTheSheetInsideTheShaft) {
    int torn = 0;
    for (const Drag& drag :
         {Drag{.edge = 0.0025, .beyond = 0.012, .round = false}, Drag{.edge = 0.0025, .beyond = 0.012},
          Drag{.radius = 0.0025, .edge = 0.0025, .beyond = 0.0105, .round = false},
          Drag{.beyond = 0.018, .round = false, .hole = 0.006},
          Drag{.radius = 0.0025, .edge = 0.0025, .beyond = 0.011, .round = false, .hole = 0.006}}) {
        SCOPED_TRACE(testing::Message() << "radius " << drag.radius << ", edge " << drag.edge << ", round "
                                        << drag.round << ", hole " << drag.hole);
        ClosedLoop loop = drag.loop();
        DepthTruth truth(loop.topology, loop.frame);
        const double settled = drag.path() / Drag::speed + 0.2;
        bool tears = false;
        while (!tears && loop.frame.time < settled + 0.1) {
            ASSERT_TRUE(loop.step()) << loop.outcome.message;
            tears = loop.ruptures > 0;
            const double depth = truth.measure(loop.frame).residual_penetration;
            if (tears || loop.frame.time < settled) continue;
            EXPECT_LE(depth_in_shaft(loop, drag.place(loop.frame.time), drag.inscribed()), clear) << loop.frame.time;
            EXPECT_LE(depth, clear) << loop.frame.time;
        }
        if (tears) {
            ++torn;
        } else {
            EXPECT_GT(loop.tool_force(0).norm(), 0.1);
        }
    }
    EXPECT_LE(torn, 1);
}

}  // namespace
}  // namespace trocar
