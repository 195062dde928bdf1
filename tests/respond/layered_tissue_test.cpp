// Tissue in two layers under a tool: a sheet folded over itself, a flat bag, two sheets one above the other; and tools
// that are drawn out. `unilateral` against the heights of the layers over the tool, found by brute force, and the audit
// of energy.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "measure/depth_truth.hpp"
#include "support/closed_loop.hpp"
#include "support/energy.hpp"
#include "support/folded_tissue.hpp"
#include "support/known_gap.hpp"

namespace trocar {
namespace {

using test::ClosedLoop;
using test::LayeredTissue;
using test::LoopBody;
using test::make_bag;
using test::make_fold;
using test::make_shaft;

constexpr double edge = 0.005;  // m
constexpr double gap = 0.003;   // m

std::vector<LayeredTissue> both_tissues(double layer_gap) {
    return {make_fold(0.03, 0.035, layer_gap, edge), make_bag(12, edge, layer_gap)};
}

/// How far the tool's vertices are below a layer at worst, m, measured along the vertical.
double depth_below(const ClosedLoop& loop, Range layer) {
    const Range tool = loop.topology.bodies[0].vertices;
    double worst = 0.0;
    for (Index v = tool.first; v < tool.end(); ++v) {
        const Vector3 x = loop.frame.position.col(v);
        for (const double height : test::heights_at(loop, layer, x)) worst = std::max(worst, height - x.z());
    }
    return worst;
}

TEST(UnilateralLayers, GapToolPressedOrStabbedIntoTwoLayersIsClearOfBothInEveryTick) {
    test::expect_known_gap("one rupture is reported that no depth shows", [] {
        constexpr double clear = 1e-4;  // m
        const auto blunt = make_shaft(0.004, 0.06, 10, 0.0);
        const auto pointed = make_shaft(0.002, 0.06, 8, 0.008);
        for (const bool stab : {false, true}) {
            for (const LayeredTissue& tissue : both_tissues(gap)) {
                // 7 mm down at 50 mm/s, or 9 mm at 0.5 m/s, held, and out again.
                const double speed = stab ? 0.5 : 0.05;
                const double lowest = stab ? -0.009 : -0.007;
                const auto path = [=](double time) {
                    const double travel = std::min(0.005 - speed * time, 0.005);
                    const double back = lowest + speed * (time - 0.3);
                    return Vector3(0.0013, 0.0007, std::max({travel, lowest, std::min(back, 0.005)}));
                };
                ClosedLoop loop =
                    test::tool_on_tissue(stab ? pointed : blunt, path, tissue.mesh, "unilateral", tissue.closed);
                DepthTruth truth(loop.topology, loop.frame);
                const Index first = loop.topology.bodies[1].triangles.first;
                double worst = 0.0;
                double below = 0.0;
                double force = 0.0;
                for (int tick = 0; tick < 520; ++tick) {
                    ASSERT_TRUE(loop.step()) << loop.outcome.message;
                    worst = std::max(worst, truth.measure(loop.frame).residual_penetration);
                    below = std::max({below, depth_below(loop, {first, tissue.upper}),
                                      depth_below(loop, {first + tissue.upper, tissue.lower})});
                    force = std::max(force, loop.tool_force(0).norm());
                    ASSERT_EQ(loop.ruptures, 0) << "tick " << tick;
                }
                EXPECT_LT(worst, clear) << "stab " << stab << " closed " << tissue.closed;
                EXPECT_LT(below, clear) << "stab " << stab << " closed " << tissue.closed;
                EXPECT_GT(force, 0.1) << "both layers must have been pressed";
            }
        }
    });
}

/// What a run of two tissues, bodies 1 and 2, under a tool comes to.
struct StackedCourse {
    double worst = 0.0;    ///< m, depth after any tick
    double created = 0.0;  ///< J, most that the tissue has gained beyond what the tool gave
    double work = 0.0;     ///< J, given by the tool and taken from it, added up
};

StackedCourse run_stacked(const LoopBody& tool, const test::Shape& upper, const LayeredTissue& lower, double between) {
    ClosedLoop loop({tool, LoopBody{.name = "upper", .kind = BodyKind::tissue, .closed = false, .mesh = upper},
                     LoopBody{.name = "lower",
                              .kind = BodyKind::tissue,
                              .closed = lower.closed,
                              .mesh = test::Shape(lower.mesh).move({0.0, 0.0, -between})}},
                    "unilateral");
    DepthTruth truth(loop.topology, loop.frame);
    const double at_rest = test::energy_of(loop.materials, loop.frame);
    StackedCourse course;
    double given_back = 0.0;
    for (int tick = 0; tick < 300; ++tick) {
        const Vector3 before = loop.frame.position.col(0);
        if (!loop.step() || loop.ruptures > 0) {
            ADD_FAILURE() << "tick " << tick << ": " << loop.outcome.message << ", ruptures " << loop.ruptures;
            break;
        }
        course.worst = std::max(course.worst, truth.measure(loop.frame).residual_penetration);
        const double on_tool = loop.tool_force(0).dot(loop.frame.position.col(0) - before);
        given_back += on_tool;
        course.work += std::abs(on_tool);
        course.created = std::max(course.created, test::energy_of(loop.materials, loop.frame) - at_rest + given_back);
    }
    return course;
}

TEST(StackedTissue, GapIsClearOfEachOtherAfterEveryTickOfAStabOrADragAndTakesItsEnergyFromTheTool) {
    test::expect_known_gap("stabbed at 0.5 m/s two sheets 0.3 mm apart overlap by 1.4 mm and gain energy", [] {
        constexpr double clear = 1e-4;  // m
        const int across = 14;
        const test::Shape upper = test::make_sheet(across, edge);
        // Vertex over vertex, vertices that meet edges and faces, and a closed body.
        const std::vector<LayeredTissue> lowers{{.mesh = upper},
                                                {.mesh = test::make_sheet(across - 1, edge * across / (across - 1))},
                                                make_bag(12, edge, 0.02)};
        for (const bool stab : {true, false}) {
            const auto path = [stab](double time) -> Vector3 {
                const double speed = stab ? 0.5 : 0.1;
                const double lowest = stab ? -0.012 : -0.004;
                const double back = lowest + 0.2 * (time - 0.25);
                const double sideways = stab ? 0.0 : 0.1 * std::clamp(time - 0.08, 0.0, 0.12);
                return {0.0013 + sideways, 0.0007, std::max({0.002 - speed * time, lowest, std::min(back, 0.005)})};
            };
            const LoopBody tool{.name = "tool",
                                .kind = BodyKind::instrument,
                                .mesh = stab ? make_shaft(0.002, 0.06, 8, 0.008) : make_shaft(0.004, 0.06, 10, 0.0),
                                .offset = path};
            for (const double between : {0.0003, 0.001}) {
                for (const LayeredTissue& lower : lowers) {
                    const StackedCourse course = run_stacked(tool, upper, lower, between);
                    const std::string name = fmt::format("stab {}, {} mm apart, lower tissue of {} vertices", stab,
                                                         1e3 * between, lower.mesh.vertices.size());
                    EXPECT_LE(course.worst, clear) << name;
                    EXPECT_GT(course.work, 1e-3) << name << ": both must have been pressed";
                    EXPECT_LE(course.created, 0.01 * course.work) << name;
                    // A gap once shown is a gap; the others are asked when it is closed.
                    if (course.worst > clear || course.created > 0.01 * course.work) return;
                }
            }
        }
    });
}

TEST(UnilateralWithdrawal, SheetDoesNotFlyPastAToolThatLeavesItsPocketFast) {
    constexpr double clear = 1e-4;  // m
    const test::Shape sheet = test::make_sheet(14, edge);
    for (const double speed : {0.5, 1.0, 2.0, 3.0}) {
        for (const double point_length : {0.008, 0.0}) {
            const double lowest = -0.008;
            const auto path = [=](double time) {
                const double in = 0.003 - 0.2 * time;
                const double out = lowest + speed * (time - 0.2);
                return Vector3(0.0013, 0.0007, std::max({std::min(in, 0.003), lowest, std::min(out, 0.02)}));
            };
            ClosedLoop loop = test::tool_on_tissue(make_shaft(0.002, 0.06, 8, point_length), path, sheet, "unilateral");
            const Range triangles = loop.topology.bodies[1].triangles;
            double below = 0.0;
            for (int tick = 0; tick < 260; ++tick) {
                ASSERT_TRUE(loop.step()) << loop.outcome.message;
                below = std::max(below, depth_below(loop, triangles));
                ASSERT_EQ(loop.ruptures, 0) << "tick " << tick;
            }
            EXPECT_LT(below, clear) << "speed " << speed << " point " << point_length;
        }
    }
}

TEST(UnilateralWithdrawal, GapToolThatStartsThroughBothWallsOfABagTearsThemAndIsFreeOnceItIsOut) {
    test::expect_known_gap("the walls of the bag are passed without a rupture reported", [] {
        for (const double thickness : {0.01, 0.02}) {
            for (const double below : {0.006, 0.012}) {
                const double lowest = -thickness - below;
                const auto path = [=](double time) {
                    return Vector3(0.0013, 0.0007, std::min(lowest + 0.2 * std::max(time - 0.05, 0.0), 0.03));
                };
                const LayeredTissue bag = make_bag(12, edge, thickness);
                ClosedLoop loop =
                    test::tool_on_tissue(make_shaft(0.002, 0.06, 8, 0.008), path, bag.mesh, "unilateral", true);
                DepthTruth truth(loop.topology, loop.frame);
                EXPECT_GT(truth.measure(loop.frame).residual_penetration, 0.003);
                std::int64_t ruptures = 0;
                const auto ticks = static_cast<int>((0.05 + (0.03 - lowest) / 0.2 + 0.2) * 1000.0);
                for (int tick = 0; tick < ticks; ++tick) {
                    ASSERT_TRUE(loop.step()) << loop.outcome.message;
                    ruptures += loop.ruptures;
                }
                EXPECT_GT(ruptures, 0);
                EXPECT_LT(truth.measure(loop.frame).residual_penetration, 1e-9)
                    << "thickness " << thickness << " below " << below;
                EXPECT_EQ(loop.tool_force(0).norm(), 0.0) << "thickness " << thickness << " below " << below;
            }
        }
    });
}

}  // namespace
}  // namespace trocar
