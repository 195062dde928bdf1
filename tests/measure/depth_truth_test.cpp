#include "measure/depth_truth.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "measure/body_surface.hpp"
#include "measure/edge_depth.hpp"
#include "measure/permutation.hpp"
#include "measure/surface_distance.hpp"
#include "measure/vertical_crossings.hpp"
#include "support/meshes.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"

namespace trocar {
namespace {

using test::Shape;
using test::sheet;
using test::sphere;

Shape octahedron(double radius) {
    Shape shape{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
    return shape.scale(radius);
}

Shape torus(double large, double small, int around, int across) {
    Shape shape;
    for (int i = 0; i < around; ++i) {
        for (int j = 0; j < across; ++j) {
            const double u = 2.0 * std::numbers::pi * i / around;
            const double v = 2.0 * std::numbers::pi * j / across;
            const double r = large + small * std::cos(v);
            shape.vertices.emplace_back(r * std::cos(u), r * std::sin(u), small * std::sin(v));
        }
    }
    const auto at = [&](int i, int j) { return static_cast<Index>((i % around) * across + j % across); };
    for (int i = 0; i < around; ++i) {
        for (int j = 0; j < across; ++j) {
            shape.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            shape.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return shape;
}

/// Prism along z about the origin with n sides, its corners on a circle of this radius.
Shape prism(double radius, double height, int n) { return test::shaft(radius, height, n, 1).move({0, 0, -height / 2}); }

Shape points_only(std::vector<Vector3> points) { return {std::move(points), {}}; }

/// Two bodies; the first moves, the second stands still unless a test moves it.
struct World {
    Topology topology;
    Frame frame;
    Matrix3X start;

    World(const Shape& first, const Shape& second, bool second_closed) {
        const test::World world = test::make_world(
            "two",
            {{BodyKind::instrument, first}, {.kind = BodyKind::instrument, .shape = second, .closed = second_closed}});
        topology = world.topology;
        start = world.frame.position;
        place(Vector3::Zero());
    }
    void place(const Vector3& offset, const std::function<Vector3(const Vector3&)>& deform = {}) {
        frame.position = start;
        const Range tool = topology.bodies[0].vertices;
        for (Index v = 0; v < topology.vertex_count; ++v) {
            if (tool.contains(v)) {
                frame.position.col(v) += offset;
            } else if (deform) {
                frame.position.col(v) = deform(start.col(v));
            }
        }
    }
    void shift_second(const Vector3& by) {
        place(Vector3::Zero(), [&by](const Vector3& p) { return Vector3(p + by); });
    }
};

/// m, of a point to the nearest of some triangles, asked one after the other.
double distance_one_by_one(const World& world, Range range, const Vector3& p) {
    double square = std::numeric_limits<double>::infinity();
    for (Index t = range.first; t < range.end(); ++t) {
        const Corners c = corners_of(world.topology.triangles, world.frame.position, t);
        square = std::min(square, squared_distance_to_triangle(c[0], c[1], c[2], p));
    }
    return std::sqrt(square);
}

TEST(DepthTruth, SinkingBallReportsTrueDepth) {
    // A fine ball of 10 mm sinks into the tip of a coarse octahedron of 50 mm below it.
    const double radius = 0.01;
    World world(sphere(radius, 24), octahedron(0.05), true);
    for (Index v = world.topology.bodies[1].vertices.first; v < world.topology.vertex_count; ++v) {
        world.start.col(v).z() -= 0.05;  // tip of the octahedron at the origin
    }
    world.place({0, 0, 0.02});
    DepthTruth truth(world.topology, world.frame);
    EXPECT_EQ(truth.measure(world.frame).residual_penetration, 0.0);
    // Faces of the octahedron |x| + |y| + |z| <= r: a point on the axis `below` under the tip is below/sqrt(3) deep.
    for (const double below : {0.001, 0.004, 0.009}) {
        world.place({0, 0, radius - below});
        const DepthTruth::Result result = truth.measure(world.frame);
        EXPECT_NEAR(truth.depth_of_vertex(24 * 23 + 1, 1), below / std::sqrt(3.0), 1e-15) << "its lowest";
        // The tip is inside the ball too, and deeper there: `below` from the ball's lowest point, less the chords.
        EXPECT_LE(result.residual_penetration, below);
        EXPECT_GT(result.residual_penetration, 0.985 * below);
        EXPECT_GT(result.wrong_side, 0);
        EXPECT_EQ(truth.depth_of_vertex(24 * 23, 1), 0.0) << "its highest";
    }
}

TEST(DepthTruth, PokeIntoASheetReportsTheKnownDepth) {
    // Heights include exact touch and samples right above vertices and edges of the sheet.
    for (const double size : {0.1, 0.08, 1.0 / 3.0}) {
        World world(points_only({{0, 0, 0.01}, {0.01, 0.01, 0.02}}), sheet(size, 10), false);
        world.place(Vector3::Zero());
        DepthTruth truth(world.topology, world.frame);
        for (const double down : {0.005, 0.01, 0.0105, 0.014, 0.0199, 0.02, 0.025, 0.013, 0.01, 0.0}) {
            world.place({0, 0, -down});
            const DepthTruth::Result result = truth.measure(world.frame);
            const double expected = std::max(0.0, down - 0.01);
            EXPECT_NEAR(result.residual_penetration, expected, 1e-15) << down;
            EXPECT_EQ(result.wrong_side, (down > 0.01 ? 1 : 0) + (down > 0.02 ? 1 : 0)) << down;
            EXPECT_EQ(result.wrong_side_vertices, result.wrong_side) << "the shape has no area";
        }
    }
}

TEST(DepthTruth, SheetThatMovesOverThePointIsTheSameAsThePointMoving) {
    World world(points_only({{0.003, 0.002, 0.01}}), sheet(0.1, 10), false);
    DepthTruth truth(world.topology, world.frame);
    // Pinned rim, middle pulled up over the point and back.
    for (const double height : {0.005, 0.02, 0.03, 0.012, 0.002}) {
        world.place(Vector3::Zero(), [height](const Vector3& p) {
            const bool rim = std::abs(p.x()) > 0.0499 || std::abs(p.y()) > 0.0499;
            return Vector3(p.x(), p.y(), rim ? 0.0 : height);
        });
        const DepthTruth::Result result = truth.measure(world.frame);
        EXPECT_NEAR(result.residual_penetration, std::max(0.0, height - 0.01), 1e-15) << height;
    }
    // The whole sheet, rim included, moves up, then sideways beneath it and back up from there.
    for (const auto& [offset, expected] : {std::pair{Vector3(0, 0, 0.015), 0.005},
                                           {Vector3(0, 0, 0.0), 0.0},
                                           {Vector3(0.2, 0, 0.0), 0.0},
                                           {Vector3(0.2, 0, 0.02), 0.0},
                                           {Vector3(0, 0, 0.02), 0.0},
                                           {Vector3(0, 0, 0.004), 0.006}}) {
        world.shift_second(offset);
        const DepthTruth::Result result = truth.measure(world.frame);
        EXPECT_NEAR(result.residual_penetration, expected, 1e-15) << offset.transpose();
    }
}

TEST(DepthTruth, ToolThatStartsThroughTheSheetIsJudgedFromItsFarEnd) {
    for (const double sign : {1.0, -1.0}) {
        World world(points_only({{0, 0, 0.03 * sign}, {0, 0, -0.005 * sign}, {0.01, 0, 0.004 * sign}}), sheet(0.1, 10),
                    false);
        DepthTruth truth(world.topology, world.frame);
        EXPECT_EQ(truth.depth_of_vertex(1, 1), 0.005);
        const DepthTruth::Result result = truth.measure(world.frame);
        EXPECT_EQ(result.residual_penetration, 0.005);
        EXPECT_EQ(result.wrong_side, 1);
        world.place({0, 0, 0.006 * sign});
        EXPECT_EQ(truth.measure(world.frame).wrong_side, 0);
    }
}

TEST(DepthTruth, ToolThroughTheSheetBelongsOnTheDeclaredSide) {
    // A bar from z = -30 mm to 10 mm, or the other way up: its far end is behind the sheet, or in front.
    for (const double up : {1.0, -1.0}) {
        for (const SheetSide side : {SheetSide::front, SheetSide::back}) {
            Shape bar = test::shaft(0.0015, 0.04, 3, 3).move({0.0113, 0.0071, -0.03});
            for (Vector3& p : bar.vertices) p.z() *= up;
            World world(bar, sheet(0.1, 10), false);
            world.topology.bodies[1].start_side = side;
            DepthTruth truth(world.topology, world.frame);
            const double sign = side == SheetSide::front ? 1.0 : -1.0;
            const Range points = world.topology.bodies[0].vertices;
            for (Index v = 0; v < points.count; ++v) {
                const double z = world.start(2, v);
                EXPECT_NEAR(truth.depth_of_vertex(v, 1), std::max(0.0, -sign * z), 1e-15) << z << " declared " << sign;
            }
            // Pulled out on the declared side nothing is left; pushed through, everything is.
            world.place({0, 0, 0.04 * sign});
            EXPECT_EQ(truth.measure(world.frame).wrong_side, 0);
            world.place({0, 0, -0.04 * sign});
            EXPECT_EQ(truth.measure(world.frame).wrong_side, points.count + DepthTruth::default_area_samples);
        }
    }
}

TEST(DepthTruth, ClearanceIsTheGapToThePlane) {
    World world(sphere(0.01, 24), sheet(0.1, 10), false);
    world.place({0, 0, 0.0117});
    DepthTruth truth(world.topology, world.frame);
    truth.measure(world.frame);
    EXPECT_NEAR(truth.clearance(), 0.0017, 1e-15);
}

TEST(DepthTruth, GoingAroundTheRimIsNoPenetration) {
    World world(points_only({{0, 0, 0.01}}), sheet(0.1, 10), false);
    DepthTruth truth(world.topology, world.frame);
    for (const Vector3& offset : {Vector3(0.2, 0, 0), Vector3(0.2, 0, -0.03), Vector3(0, 0, -0.03)}) {
        world.place(offset);
        EXPECT_EQ(truth.measure(world.frame).wrong_side, 0) << offset.transpose();
    }
    // From below it is now above that is wrong; exactly along a row of vertices, through a rim vertex and a corner.
    world.place(Vector3(0, 0, 0.01));
    EXPECT_EQ(truth.measure(world.frame).wrong_side, 1);
    for (const Vector3& offset : {Vector3(0.05, 0.05, 0.01), Vector3(0.2, 0.2, 0.01), Vector3(0.2, 0.2, -0.03),
                                  Vector3(0.05, 0.05, -0.03), Vector3(0, 0, -0.03)}) {
        world.place(offset);
        truth.measure(world.frame);
    }
    EXPECT_EQ(truth.measure(world.frame).wrong_side, 1) << "through the sheet and around the rim is one crossing";
}

TEST(DepthTruth, RimThatHasSlippedPastPointsOfABodyLeavesNothingBeyondTheSheet) {
    // A sheet comes from the right until its rim is 2 mm inside a ball of 5 mm, goes up through the ball's upper half
    // and away above it. At the end nothing meets; on the way the rim alone is inside, by 5 mm less its distance from
    // the middle.
    World world(sphere(0.005, 24), sheet(0.01, 20), false);
    const auto rim_at = [&world](double x, double z) { world.shift_second({x + 0.005, 0.0003, z}); };
    rim_at(0.0055, 0.0012);
    DepthTruth truth(world.topology, world.frame);
    for (const double x : {0.0047, 0.0039, 0.003}) {
        rim_at(x, 0.0012);
        EXPECT_NEAR(truth.measure(world.frame).residual_penetration, 0.005 - std::hypot(x, 0.0012), 1e-4) << x;
    }
    for (const double z : {0.0019, 0.0027, 0.0033, 0.0042}) {
        rim_at(0.003, z);
        EXPECT_NEAR(truth.measure(world.frame).residual_penetration, std::max(0.0, 0.005 - std::hypot(0.003, z)), 1e-4)
            << z;
    }
    for (const double x : {0.003, 0.006}) {
        rim_at(x, 0.0055);
        EXPECT_EQ(truth.measure(world.frame).wrong_side, 0) << x;
    }
}

TEST(DepthTruth, RimThatHasSlippedPastMostOfABodyLeavesNothingBeyondEither) {
    // As above, but the rim goes so far in and so low that it passes most points of the ball on its way up.
    World world(sphere(0.005, 24).rotate({1, 0, 0}, std::numbers::pi / 2.0), sheet(0.01, 20), false);
    const auto rim_at = [&world](double x, double z) { world.shift_second({x + 0.005, 0.0003, z}); };
    rim_at(0.0055, -0.0035);
    DepthTruth truth(world.topology, world.frame);
    std::int64_t most_undecided = 0;
    const auto look = [&](double x, double z) {
        rim_at(x, z);
        const DepthTruth::Result result = truth.measure(world.frame);
        EXPECT_NEAR(result.residual_penetration, std::max(0.0, 0.005 - std::abs(z)), 1e-4) << x << ' ' << z;
        most_undecided = std::max(most_undecided, result.side_undecided);
    };
    for (const double x : {0.0037, 0.0017, -0.0004, -0.0023, -0.0031}) {
        rim_at(x, -0.0035);
        truth.measure(world.frame);
    }
    for (const double z : {-0.0021, -0.0009, 0.0011, 0.0023, 0.0037, 0.0041}) look(-0.0031, z);
    EXPECT_GT(most_undecided, (world.topology.bodies[0].vertices.count + DepthTruth::default_area_samples) / 2)
        << "what the sheet has passed hangs together with the rest round its rim";
    rim_at(-0.0031, 0.0055);
    const DepthTruth::Result end = truth.measure(world.frame);
    EXPECT_EQ(end.wrong_side, 0);
    EXPECT_EQ(end.side_undecided, 0) << "nothing meets, so nothing is open";
}

TEST(DepthTruth, BodyWhoseAnchorTheSheetPassesWithItsRimInsideIsUndecidedUntilItIsBack) {
    // A strip, narrower than the ball, is pushed into it lengthwise and out on the other side, below its leftmost
    // point, and then lifted past that point.
    World world(sphere(0.005, 24), sheet(0.012, 20), false);
    const auto strip_at = [&](double x, double z) {
        world.place(Vector3::Zero(),
                    [&](const Vector3& p) { return Vector3(p.x() + x + 0.006, 0.3 * p.y() + 0.0001, z); });
    };
    strip_at(0.0055, -0.0011);
    DepthTruth truth(world.topology, world.frame);
    const auto open = [&](double x, double z) {
        strip_at(x, z);
        return truth.measure(world.frame).side_undecided;
    };
    const auto samples = static_cast<std::int64_t>(world.topology.bodies[0].vertices.count) + 1000;
    for (const double x : {0.0031, -0.0013, -0.0061}) EXPECT_EQ(open(x, -0.0011), 0) << x;
    EXPECT_EQ(open(-0.0061, 0.0013), samples);
    EXPECT_EQ(open(-0.0061, 0.0061), samples) << "it may have been the strip or its rim that passed";
    EXPECT_EQ(open(-0.0061, 0.0013), samples);
    EXPECT_LT(open(-0.0061, -0.0011), samples);
    for (const double x : {-0.0013, 0.0031, 0.0055}) open(x, -0.0011);
    const DepthTruth::Result end = truth.measure(world.frame);
    EXPECT_EQ(end.wrong_side, 0);
    EXPECT_EQ(end.side_undecided, 0);
}

TEST(DepthTruth, TipBeyondAHoleWhoseRimIsInsideTheShaftIsUndecidedAndTheRimHasTheDepth) {
    // A shaft of 2 mm stands 20 mm through a hole of 3 mm that never touched it. The hole closes until its rim is
    // 0.1 mm inside the shaft, and opens again.
    const double radius = 0.002;
    Shape holed = sheet(0.02, 60);
    std::erase_if(holed.triangles, [&](const std::array<Index, 3>& face) {
        return std::any_of(face.begin(), face.end(), [&](Index v) {
            return holed.vertices[static_cast<std::size_t>(v)].head<2>().norm() < 0.003;
        });
    });
    for (Vector3& p : holed.vertices) {
        if (p.norm() < 0.003) p = Vector3(0, 0, -1);  // what the hole leaves over
    }
    World world(prism(radius, 0.06, 48), holed, false);
    const auto hole_of = [&](double wanted) {
        world.place({0, 0, 0.0103}, [&](const Vector3& p) {
            const double r = p.norm();
            const double share = std::clamp((0.006 - r) / 0.003, 0.0, 1.0);  // the rim moves most
            return r > 0.5 ? p : Vector3(p * (1.0 + share * (wanted / r - 1.0)));
        });
    };
    hole_of(0.003);
    DepthTruth truth(world.topology, world.frame);
    EXPECT_EQ(truth.measure(world.frame).wrong_side, 0);
    hole_of(0.0015);
    const DepthTruth::Result closed = truth.measure(world.frame);
    EXPECT_GT(closed.side_undecided, 100);
    EXPECT_GT(closed.residual_penetration, 0.0);
    EXPECT_LT(closed.residual_penetration, 0.0006) << "not the 20 mm that the tip is away";
    EXPECT_TRUE(std::isnan(truth.depth_of_vertex(0, 1))) << "at the tip";
    EXPECT_EQ(truth.depth_of_vertex(50, 1), 0.0) << "at the other end";
    std::int64_t open = 0;
    truth.each_sample([&](const DepthTruth::Judgement& sample) {
        if (sample.side == Side::undecided) ++open;
        EXPECT_EQ(std::isnan(sample.depth), sample.side == Side::undecided);
    });
    EXPECT_EQ(open, closed.side_undecided);
    hole_of(0.003);
    const DepthTruth::Result end = truth.measure(world.frame);
    EXPECT_EQ(end.wrong_side, 0);
    EXPECT_EQ(end.side_undecided, 0);
}

TEST(DepthTruth, HookRoundTheRimStartsOnTheRightSide) {
    // A C of boxes encloses the rim x = 50 mm with one arm above the sheet and one below, and never meets it: the
    // straight path from arm to arm goes through the sheet, the path over the hook does not.
    Shape hook;
    const auto ring = [&hook](double x, double z) {
        for (const auto& [y, out] :
             {std::pair{0.001, 1.0}, std::pair{-0.001, 1.0}, std::pair{-0.001, -1.0}, std::pair{0.001, -1.0}}) {
            hook.vertices.emplace_back(x + 0.0003 * out, y + 0.0007, z * (1.0 + 0.1 * out));
        }
    };
    const std::vector<std::array<double, 2>> spine{{0.03, 0.004},    {0.04, 0.004},  {0.055, 0.0039},
                                                   {0.055, -0.0039}, {0.04, -0.004}, {0.03, -0.004}};
    for (const auto& [x, z] : spine) ring(x, z);
    for (Index i = 0; i + 1 < static_cast<Index>(spine.size()); ++i) {
        for (Index k = 0; k < 4; ++k) {
            const Index a = 4 * i + k;
            const Index b = 4 * i + (k + 1) % 4;
            hook.triangles.push_back({a, b, b + 4});
            hook.triangles.push_back({a, b + 4, a + 4});
        }
    }
    const auto last = static_cast<Index>(hook.vertices.size()) - 4;
    hook.triangles.insert(hook.triangles.end(),
                          {{0, 2, 1}, {0, 3, 2}, {last, last + 1, last + 2}, {last, last + 2, last + 3}});
    World world(hook, sheet(0.1, 20), false);
    DepthTruth truth(world.topology, world.frame);
    DepthTruth::Result result = truth.measure(world.frame);
    EXPECT_EQ(result.wrong_side, 0);
    EXPECT_EQ(result.side_undecided, 0);
    // Pushed down until the sheet is inside the upper arm, up to its rim, and on until it is above both arms.
    world.place({0, 0, -0.0041});
    result = truth.measure(world.frame);
    EXPECT_GT(result.side_undecided, 0);
    EXPECT_GT(result.residual_penetration, 1e-4);
    EXPECT_LT(result.residual_penetration, 1e-3) << "the arm is that thick";
    world.place({0, 0, -0.006});
    result = truth.measure(world.frame);
    EXPECT_EQ(result.wrong_side, 0) << "as if it had been driven round the rim";
    EXPECT_EQ(result.side_undecided, 0);
}

TEST(DepthTruth, PartOfABodyThatIsCutOffIsBeyondTheSheetHoweverTheRimStands) {
    // The same sheet goes up through the ball as a whole: its rim is outside, the ball's top is cut off.
    World world(sphere(0.005, 24), sheet(0.03, 20), false);
    const auto height = [&world](double z) { world.shift_second({0.0001, 0.0003, z}); };
    height(0.0055);
    DepthTruth truth(world.topology, world.frame);
    for (const double z : {0.0047, 0.0041, 0.0033}) {
        height(z);
        EXPECT_NEAR(truth.measure(world.frame).residual_penetration, 0.005 - z, 1e-4) << z;
    }
}

TEST(DepthTruth, CrossingsOfARandomWalkAgreeWithTheSideOfThePlane) {
    // The flat sheet is huge: the side is the sign of z. Steps land on the plane, on vertices and on edges all the
    // time.
    World world(points_only({{0, 0, 1}}), sheet(64.0, 16), false);
    DepthTruth truth(world.topology, world.frame);
    std::mt19937_64 random(11);
    for (int i = 0; i < 3000; ++i) {
        const Vector3 at(static_cast<double>(random() % 41) - 20.0, static_cast<double>(random() % 41) - 20.0,
                         static_cast<double>(random() % 7) - 3.0);
        world.place(at - Vector3(0, 0, 1));
        const DepthTruth::Result result = truth.measure(world.frame);
        ASSERT_EQ(result.wrong_side, at.z() < 0.0 ? 1 : 0) << i << ": " << at.transpose();
        ASSERT_EQ(result.residual_penetration, at.z() < 0.0 ? -at.z() : 0.0);
    }
}

TEST(DepthTruth, TiesOfAnAlignedWalkRoundAFreeRimAreBrokenAsByASmallStep) {
    // An octahedron and a small sheet of integer coordinates, both driven about on a lattice: vertices, edges and faces
    // meet each other and the rim exactly all the time. Where both are decided, every sample has the side that it has
    // after the small step that ties are thought broken by.
    std::mt19937_64 random(3);
    int wrong = 0;
    int decided = 0;
    int undecided = 0;
    for (int walk = 0; walk < 40; ++walk) {
        World aligned(octahedron(2.0), sheet(6.0, 6), false);
        World stepped(octahedron(2.0), sheet(6.0, 6), false);
        const Vector3 small(1e-9, 1e-6, 1e-3);
        const auto place = [&](const Vector3& ball_at, const Vector3& sheet_at) {
            const auto driven = [&](const Vector3& p) { return Vector3(p + sheet_at); };
            aligned.place(ball_at, driven);
            stepped.place(ball_at + small, driven);
        };
        place({0, 0, 3}, {0, 0, 0});
        DepthTruth truth(aligned.topology, aligned.frame, {}, 0);
        DepthTruth other(stepped.topology, stepped.frame, {}, 0);
        for (int step = 0; step < 60; ++step) {
            const auto whole = [&](int most) { return static_cast<double>(random() % (2 * most + 1)) - most; };
            place({whole(5), whole(5), whole(3)}, step % 3 == 0 ? Vector3(whole(2), whole(2), 0) : Vector3::Zero());
            truth.measure(aligned.frame);
            other.measure(stepped.frame);
            std::vector<Side> sides;
            other.each_sample([&](const DepthTruth::Judgement& one) {
                if (one.from == 0) sides.push_back(one.side);
            });
            std::size_t i = 0;
            truth.each_sample([&](const DepthTruth::Judgement& one) {
                if (one.from != 0) return;
                if (one.side == Side::undecided || sides[i] == Side::undecided) {
                    ++undecided;
                } else {
                    EXPECT_EQ(one.side, sides[i]) << walk << ' ' << step << " sample " << i;
                    ++decided;
                }
                wrong += one.side == Side::wrong ? 1 : 0;
                ++i;
            });
        }
    }
    EXPECT_GT(wrong, 1000);
    EXPECT_GT(decided, undecided) << "leaps with the rim inside leave much open";
}

TEST(DepthTruth, EdgeOfASheetThroughAToolIsAsDeepAsItsChord) {
    // The rim x = 50 mm of a sheet with edges of 5 mm passes beside the axis of a shaft whose radius is 2 mm: the
    // vertices at y = +-2.5 mm stay outside. The chord's middle is nearest to the face at x = -apothem.
    const int sides = 16;
    const double radius = 0.002;
    const double turn = std::numbers::pi / sides;  // a face's middle towards the sheet
    World world(prism(radius, 0.1, sides).rotate(Vector3::UnitZ(), turn), sheet(0.1, 20), false);
    world.place({0.06, 0.0025, 0.001});
    DepthTruth truth(world.topology, world.frame, {}, 1);
    const double apothem = radius * std::cos(std::numbers::pi / sides);
    for (const double inside : {0.0001, 0.0004, 0.001}) {
        world.place({0.05 + apothem - inside, 0.0025, 0.001});
        const DepthTruth::Result result = truth.measure(world.frame);
        EXPECT_NEAR(result.residual_penetration, inside, 1e-3 * inside);
        EXPECT_EQ(result.wrong_side_vertices, 0);
        EXPECT_GE(result.wrong_side, 1);
    }
    world.place({0.05 + apothem + 1e-6, 0.0025, 0.001});
    const DepthTruth::Result apart = truth.measure(world.frame);
    EXPECT_EQ(apart.residual_penetration, 0.0);
    EXPECT_EQ(apart.wrong_side, 0);
}

TEST(DepthTruth, EdgesInsideAreAsDeepAsEveryPointOfThemSays) {
    // Against the obvious way: many points of every edge of either body, judged by all triangles of the other.
    const auto inside = [](const Triangles& triangles, Range range, const Matrix3X& at, const Vector3& p) {
        int sum = 0;
        for (Index t = range.first; t < range.end(); ++t) {
            sum += upward_crossing(at.col(triangles(0, t)), at.col(triangles(1, t)), at.col(triangles(2, t)), p);
        }
        return sum != 0;
    };
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    int deep = 0;
    for (int trial = 0; trial < 24; ++trial) {
        Shape tool = trial % 2 == 0 ? prism(0.003, 0.06, 7) : torus(0.01, 0.004, 9, 6);
        const Eigen::Quaterniond turn = test::random_turn(unit, random);
        for (Vector3& p : tool.vertices) p = turn * p;
        World world(tool, sphere(0.012, 6), true);
        world.place(0.013 * test::random_vector(unit, random));
        const Topology& topology = world.topology;
        const Matrix3X& at = world.frame.position;
        double most = 0.0;
        for (const auto& [own, other] : {std::array<std::size_t, 2>{0, 1}, std::array<std::size_t, 2>{1, 0}}) {
            const Range from = topology.bodies[own].triangles;
            const Range into = topology.bodies[other].triangles;
            for (Index t = from.first; t < from.end(); ++t) {
                for (int corner = 0; corner < 3; ++corner) {
                    const Vector3 p = at.col(topology.triangles(corner, t));
                    const Vector3 q = at.col(topology.triangles((corner + 1) % 3, t));
                    for (int i = 0; i <= 400; ++i) {
                        const Vector3 x = p + i / 400.0 * (q - p);
                        if (!inside(topology.triangles, into, at, x)) continue;
                        most = std::max(most, distance_one_by_one(world, into, x));
                    }
                }
            }
        }
        DepthTruth truth(topology, world.frame, {}, 1);
        const double reported = truth.measure(world.frame).residual_penetration;
        EXPECT_GE(reported, std::max(0.99 * most, most - 0.06 / 1024.0)) << trial;
        EXPECT_LE(reported, most + 0.5 * 0.06 / 400.0) << trial;
        if (most > 1e-3) ++deep;
    }
    EXPECT_GE(deep, 8);
}

/// Depths of all vertices, as edge_depth takes them.
std::vector<double> bounds_of(const Triangles& triangles, const Matrix3X& position, const RayTree& rays,
                              const SurfaceDistance& surface) {
    std::vector<double> bounds;
    for (const auto& p : position.colwise()) {
        bounds.push_back(rays.crossings(triangles, position, p) == 0 ? not_inside
                                                                     : surface.distance(triangles, position, p));
    }
    return bounds;
}

TEST(EdgeDepth, AnEdgeThroughTwoCubesIsInsideTwiceAndAsDeepAsItsDistanceToTheNearestFace) {
    // Cubes of 2 mm whose middles are 6 mm apart along x. The first edge begins 20 mm before the one and ends 4 mm
    // behind the other, 0.4 mm below their tops: it is through both with its middle outside. It is listed both ways.
    // The second lies in the first cube, 0.3 mm deep where it begins and 0.5 mm where it ends; the third passes above.
    for (const Vector3& at : {Vector3(0.0, 0.0, 0.0), Vector3(0.3, -0.2, 0.7)}) {
        const auto cube = [&at](double x) { return test::slab(0.002, 0.002, 1).move(at + Vector3(x, 0.0, 0.001)); };
        const test::World world =
            test::make_world("cubes", {{BodyKind::rigid, cube(0.0)}, {BodyKind::rigid, cube(0.006)}});
        const Triangles& triangles = world.topology.triangles;
        Matrix3X position = world.frame.position;
        ASSERT_EQ(position.cols(), 16);
        position.conservativeResize(3, 22);
        position.col(16) = at + Vector3(-0.02, 0.0003, 0.0006);
        position.col(17) = at + Vector3(0.01, 0.0003, 0.0006);
        position.col(18) = at + Vector3(0.0002, -0.0007, 0.0001);
        position.col(19) = at + Vector3(-0.0002, -0.0005, 0.0001);
        position.col(20) = at + Vector3(-0.02, 0.0003, 0.0011);
        position.col(21) = at + Vector3(0.01, 0.0003, 0.0011);
        RayTree rays;
        rays.prepare(triangles, {0, 24}, position);
        SurfaceDistance surface;
        surface.prepare(triangles, {0, 24}, position);
        const auto depth_of = [&](const std::vector<std::array<Index, 2>>& edges) {
            return edge_depth(triangles, position, edges, rays, surface, bounds_of(triangles, position, rays, surface));
        };
        const EdgeDepth through = depth_of({{16, 17}, {17, 16}});
        EXPECT_EQ(through.stretches, 2);
        EXPECT_NEAR(through.depth, 0.0004, 1e-9);
        // A face that an edge leaves into another cube that holds it too ends no stretch.
        const test::World nested = test::make_world(
            "nested", {{BodyKind::rigid, cube(0.0)}, {BodyKind::rigid, test::slab(0.001, 0.001, 1).move(at)}});
        Matrix3X places = nested.frame.position;
        places.conservativeResize(3, 18);
        places.col(16) = position.col(16);
        places.col(17) = position.col(17);
        RayTree nested_rays;
        nested_rays.prepare(nested.topology.triangles, {0, 24}, places);
        SurfaceDistance nested_surface;
        nested_surface.prepare(nested.topology.triangles, {0, 24}, places);
        EXPECT_EQ(
            edge_depth(nested.topology.triangles, places, std::vector<std::array<Index, 2>>{{16, 17}}, nested_rays,
                       nested_surface, bounds_of(nested.topology.triangles, places, nested_rays, nested_surface))
                .stretches,
            1);
        const EdgeDepth within = depth_of({{18, 19}});
        EXPECT_EQ(within.stretches, 1);
        EXPECT_NEAR(within.depth, 0.0005, 0.0002 / 500.0) << "1/512 of the way from 0.3 mm to it";
        const EdgeDepth above = depth_of({{20, 21}});
        EXPECT_EQ(above.stretches, 0);
        EXPECT_EQ(above.depth, 0.0);
        const EdgeDepth all = depth_of({{16, 17}, {18, 19}, {20, 21}});
        EXPECT_EQ(all.stretches, 3);
        EXPECT_EQ(all.depth, within.depth);
    }
}

TEST(EdgeDepth, AChordWhoseEndsTouchTheSurfaceIsAsDeepAsItsMiddle) {
    // From the middle of a cube's upper face to the middle of one of its sides, exactly and just beside: the middle of
    // the edge is 2.5 mm below both.
    const Shape cube = test::slab(0.01, 0.01, 1).move({0.0, 0.0, 0.005});
    for (const double beside : {0.0, 1e-9, -1e-9}) {
        const test::World world = test::make_world("cube", {{BodyKind::rigid, cube}});
        Matrix3X position = world.frame.position;
        position.conservativeResize(3, 10);
        position.col(8) = Vector3(0.0, 0.0, 0.005 + beside);
        position.col(9) = Vector3(0.005 + beside, 0.0, 0.0);
        RayTree rays;
        rays.prepare(world.topology.triangles, {0, 12}, position);
        SurfaceDistance surface;
        surface.prepare(world.topology.triangles, {0, 12}, position);
        const EdgeDepth found =
            edge_depth(world.topology.triangles, position, std::vector<std::array<Index, 2>>{{8, 9}}, rays, surface,
                       bounds_of(world.topology.triangles, position, rays, surface));
        EXPECT_EQ(found.stretches, 1) << beside;
        EXPECT_NEAR(found.depth, 0.0025, 1e-8) << beside;
    }
}

TEST(DepthTruth, TorusHoleIsOutside) {
    const double large = 0.03;
    const double small = 0.01;
    World world(points_only({{0, 0, 0}, {large, 0, 0}, {0, large + 0.009, 0.001}, {large + 0.011, 0, 0}}),
                torus(large, small, 64, 32), true);
    DepthTruth truth(world.topology, world.frame);
    truth.measure(world.frame);
    EXPECT_EQ(truth.depth_of_vertex(0, 1), 0.0);
    EXPECT_NEAR(truth.depth_of_vertex(1, 1), small, 2e-4) << "chords of the tessellation";
    EXPECT_NEAR(truth.depth_of_vertex(2, 1), small - std::hypot(0.009, 0.001), 2e-4);
    EXPECT_EQ(truth.depth_of_vertex(3, 1), 0.0);
    EXPECT_TRUE(std::isnan(truth.depth_of_vertex(0, 0)));
}

TEST(DepthTruth, InvertedNormalsDoNotTurnAClosedBodyInsideOut) {
    Shape inside_out = sphere(0.02, 12);
    for (auto& face : inside_out.triangles) std::swap(face[0], face[1]);
    World world(points_only({{0, 0, 0}, {0, 0, 0.03}}), inside_out, true);
    DepthTruth truth(world.topology, world.frame);
    truth.measure(world.frame);
    EXPECT_GT(truth.depth_of_vertex(0, 1), 0.015);
    EXPECT_EQ(truth.depth_of_vertex(1, 1), 0.0);
}

TEST(DepthTruth, MeanIsTheAreaMeanOverPenetratingSamples) {
    // A big flat triangle at depth 2 mm under a sheet: every sample is exactly that deep.
    World world({{{-0.01, -0.01, 0.01}, {0.01, -0.01, 0.01}, {0, 0.01, 0.01}}, {{0, 1, 2}}}, sheet(0.1, 10), false);
    DepthTruth truth(world.topology, world.frame);
    world.place({0, 0, -0.012});
    const DepthTruth::Result result = truth.measure(world.frame);
    EXPECT_NEAR(result.residual_penetration_mean, 0.002, 1e-15);
    EXPECT_NEAR(result.residual_penetration, 0.002, 1e-15);
    EXPECT_EQ(result.wrong_side, 3 + DepthTruth::default_area_samples);
}

TEST(DepthTruth, UncountedBodyPairsStayOutOfTheResult) {
    World world(points_only({{0, 0, 0}}), sphere(0.02, 12), true);
    const std::vector<std::uint8_t> counted{0};
    DepthTruth truth(world.topology, world.frame, counted);
    EXPECT_EQ(truth.measure(world.frame).residual_penetration, 0.0);
    EXPECT_GT(truth.depth_of_vertex(0, 1), 0.0);
}

TEST(DepthTruth, NonFiniteFrameHasNoAnswerAndLeavesNoTrace) {
    World world(points_only({{0, 0, 0.01}}), sheet(0.1, 10), false);
    DepthTruth truth(world.topology, world.frame);
    Frame broken = world.frame;
    broken.position(0, 5) = std::nan("");
    EXPECT_TRUE(std::isnan(truth.measure(broken).residual_penetration));
    EXPECT_EQ(truth.measure(broken).wrong_side, -1);
    world.place({0, 0, -0.02});
    EXPECT_NEAR(truth.measure(world.frame).residual_penetration, 0.01, 1e-15);
}

TEST(DepthTruth, OrderOfTheBodiesMakesNoDifferenceAndEverySampleSaysWhereItRides) {
    // The rim of a sheet goes into a ball and up in it; once the ball is the first body and once the second. Vertices
    // come in their own order, then places on triangles.
    World world(sphere(0.005, 24), sheet(0.01, 20), false);
    const auto rim_at = [&](double x, double z) {
        world.shift_second({x + 0.005, 0.0003, z});
        world.frame.previous = world.frame.position;
        world.frame.velocity = Matrix3X::Zero(3, world.frame.position.cols());
    };
    rim_at(0.0055, 0.0012);
    const Permutation swapped = with_bodies_in_order(world.topology, {1, 0});
    DepthTruth truth(world.topology, world.frame);
    DepthTruth other(swapped.topology, swapped.permuted(world.frame));
    int wrong = 0;
    for (const auto& [x, z] :
         {std::pair{0.0047, 0.0012}, {0.0039, 0.0012}, {0.003, 0.0012}, {0.003, 0.0027}, {0.003, 0.0042}}) {
        rim_at(x, z);
        const DepthTruth::Result one = truth.measure(world.frame);
        const DepthTruth::Result two = other.measure(swapped.permuted(world.frame));
        EXPECT_NEAR(two.residual_penetration, std::max(0.0, 0.005 - std::hypot(x, z)), 1e-4) << x << ' ' << z;
        EXPECT_NEAR(two.residual_penetration, one.residual_penetration, 1e-15);
        EXPECT_NEAR(two.residual_penetration_mean, one.residual_penetration_mean, 1e-15);
        EXPECT_EQ(two.wrong_side, one.wrong_side);
        EXPECT_EQ(two.wrong_side_vertices, one.wrong_side_vertices);
        EXPECT_EQ(two.side_undecided, one.side_undecided);
        std::array<std::vector<DepthTruth::Judgement>, 2> of_one;
        std::array<std::vector<DepthTruth::Judgement>, 2> of_two;
        truth.each_sample([&](const DepthTruth::Judgement& sample) {
            of_one.at(static_cast<std::size_t>(sample.from)).push_back(sample);
        });
        other.each_sample([&](const DepthTruth::Judgement& sample) {
            of_two.at(static_cast<std::size_t>(1 - sample.from)).push_back(sample);
        });
        for (std::size_t body = 0; body < 2; ++body) {
            const Range vertices = world.topology.bodies[body].vertices;
            const Range in_two = swapped.topology.bodies[1 - body].vertices;
            const auto count = static_cast<std::size_t>(vertices.count);
            ASSERT_EQ(of_one.at(body).size(), count + DepthTruth::default_area_samples);
            ASSERT_EQ(of_two.at(body).size(), of_one.at(body).size());
            for (std::size_t i = 0; i < of_one.at(body).size(); ++i) {
                const DepthTruth::Judgement& a = of_one.at(body)[i];
                const DepthTruth::Judgement& b = of_two.at(body)[i];
                EXPECT_EQ(a.into, 1 - a.from);
                EXPECT_EQ(b.into, 1 - b.from);
                const bool is_vertex = i < count;
                EXPECT_EQ(a.vertex, is_vertex ? vertices.first + static_cast<Index>(i) : -1);
                EXPECT_EQ(b.vertex, is_vertex ? in_two.first + static_cast<Index>(i) : -1);
                EXPECT_EQ(a.place.triangle < 0, is_vertex);
                if (!is_vertex) {
                    EXPECT_EQ(swapped.triangle[static_cast<std::size_t>(b.place.triangle)], a.place.triangle);
                }
                EXPECT_EQ(b.place.weights, a.place.weights);
                EXPECT_EQ(b.side, a.side);
                EXPECT_EQ(std::isnan(b.depth), std::isnan(a.depth));
                if (!std::isnan(a.depth)) {
                    EXPECT_NEAR(b.depth, a.depth, 1e-15);
                }
                wrong += a.side == Side::wrong ? 1 : 0;
            }
        }
    }
    EXPECT_GT(wrong, 10);
}

TEST(BodySurface, AreaSamplesOfATriangleAreRobertsSequenceFolded) {
    // 1/2 + n (1/g, 1/g²) modulo 1 from n = 1 on, where g³ = g + 1 (Roberts 2018); beyond the diagonal turned round.
    double g = 1.0;
    for (int i = 0; i < 60; ++i) g = std::cbrt(1.0 + g);
    const Topology topology = make_topology({test::triangle_body("one", BodyKind::tissue, false)});
    Matrix3X position = Matrix3X::Zero(3, 3);
    position(0, 1) = 1.0;
    position(1, 2) = 1.0;
    constexpr int count = 20;
    const BodySurface surface(topology, 0, position, position, count);
    ASSERT_EQ(surface.sample_count(), surface.vertex_count() + static_cast<std::size_t>(count));
    for (int n = 1; n <= count; ++n) {
        double x = std::fmod(0.5 + n / g, 1.0);
        double y = std::fmod(0.5 + n / (g * g), 1.0);
        if (x + y > 1.0) {
            x = 1.0 - x;
            y = 1.0 - y;
        }
        const Vector3 point = surface.point(surface.vertex_count() + static_cast<std::size_t>(n - 1));
        EXPECT_LT((point - Vector3(x, y, 0.0)).norm(), 1e-13) << n;
    }
}

TEST(SurfaceDistance, TreeAgreesWithEveryTriangleAsPreparedAnewAndAsMoved) {
    World world(sphere(0.01, 6), torus(0.03, 0.01, 24, 12), true);
    world.place({0.1, 0.0, 0.0});
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> uniform(-0.06, 0.06);
    SurfaceDistance tree;
    for (const std::size_t body : {0, 1, 0, 1}) {
        const Range range = world.topology.bodies[body].triangles;
        tree.prepare(world.topology.triangles, range, world.frame.position);
        for (const bool moved : {false, true}) {
            if (moved) {
                for (Index v = 0; v < world.topology.vertex_count; ++v) {
                    world.frame.position.col(v) += 0.1 * test::random_vector(uniform, random);
                }
                tree.refit(world.topology.triangles, world.frame.position);
            }
            for (int i = 0; i < 100; ++i) {
                const Vector3 p = test::random_vector(uniform, random);
                EXPECT_EQ(tree.distance(world.topology.triangles, world.frame.position, p),
                          distance_one_by_one(world, range, p));
            }
        }
    }
}

TEST(SurfaceDistance, BoundAlongASegmentIsTheLeastOverAllTrianglesOfTheFartherEnd) {
    World world(sphere(0.01, 6), torus(0.03, 0.01, 24, 12), true);
    const Triangles& triangles = world.topology.triangles;
    const Range range = world.topology.bodies[1].triangles;
    const Matrix3X& position = world.frame.position;
    SurfaceDistance tree;
    tree.prepare(triangles, range, position);
    std::mt19937_64 random(6);
    std::uniform_real_distribution<double> uniform(-0.06, 0.06);
    for (int i = 0; i < 200; ++i) {
        const Vector3 p = test::random_vector(uniform, random);
        const Vector3 q = i % 2 == 0 ? test::random_vector(uniform, random) : p + 0.02 * Vector3(p.y(), p.z(), p.x());
        double least = std::numeric_limits<double>::infinity();
        for (Index t = range.first; t < range.end(); ++t) {
            const Corners c = corners_of(triangles, position, t);
            least = std::min(least, std::max(squared_distance_to_triangle(c[0], c[1], c[2], p),
                                             squared_distance_to_triangle(c[0], c[1], c[2], q)));
        }
        const double bound = tree.bound_along(triangles, position, p, q, 0.0);
        EXPECT_EQ(bound, std::sqrt(least));
        for (int j = 0; j <= 10; ++j)
            EXPECT_LE(distance_one_by_one(world, range, p + 0.1 * j * (q - p)), bound + 1e-15);
        const double within = tree.bound_along(triangles, position, p, q, 1.5 * bound);
        EXPECT_GE(within, bound);
        EXPECT_LE(within, 1.5 * bound) << "a search that need not go on still ends within what is enough";
    }
}

TEST(SurfaceDistance, OfTrianglesAtOnePlaceIsThatOfOne) {
    Shape copies;
    for (int i = 0; i < 8; ++i) copies.add(test::triangle({0, 0, 1}, {3, 0, 1}, {0, 4, 1}));
    World world(points_only({}), copies, false);
    SurfaceDistance tree;
    tree.prepare(world.topology.triangles, world.topology.bodies[1].triangles, world.frame.position);
    EXPECT_EQ(tree.distance(world.topology.triangles, world.frame.position, {1, 1, 3}), 2.0);
    EXPECT_EQ(tree.distance(world.topology.triangles, world.frame.position, {-3, 1, -3}), 5.0);
    RayTree rays;
    rays.prepare(world.topology.triangles, world.topology.bodies[1].triangles, world.frame.position);
    EXPECT_EQ(rays.crossings(world.topology.triangles, world.frame.position, {1, 1, 0}), 8);
    EXPECT_EQ(rays.crossings(world.topology.triangles, world.frame.position, {1, 1, 2}), 0);
}

TEST(SurfaceDistance, TriangleDistanceHasTheClosedForms) {
    const Vector3 a(0, 0, 0);
    const Vector3 b(1, 0, 0);
    const Vector3 c(0, 1, 0);
    EXPECT_DOUBLE_EQ(squared_distance_to_triangle(a, b, c, {0.25, 0.25, 2}), 4.0);
    EXPECT_DOUBLE_EQ(squared_distance_to_triangle(a, b, c, {0.5, -1, 1}), 2.0);
    EXPECT_DOUBLE_EQ(squared_distance_to_triangle(a, b, c, {1, 1, 0}), 0.5);
    EXPECT_DOUBLE_EQ(squared_distance_to_triangle(a, b, c, {-3, -4, 0}), 25.0);
    EXPECT_DOUBLE_EQ(squared_distance_to_triangle(a, b, b, {2, 0, 1}), 2.0);
    EXPECT_DOUBLE_EQ(squared_distance_to_triangle(a, a, a, {0, 3, 4}), 25.0);
}

TEST(UpwardCrossing, ClosedSurfaceIsCrossedEvenlyFromAnyPointHoweverAligned) {
    // All rays of a lattice through a lattice-aligned octahedron: the sum must be 1 strictly inside and 0 strictly
    // outside.
    const Shape shape = octahedron(4.0);
    for (int x = -5; x <= 5; ++x) {
        for (int y = -5; y <= 5; ++y) {
            for (int z = -5; z <= 5; ++z) {
                const int norm = std::abs(x) + std::abs(y) + std::abs(z);
                if (norm == 4) continue;
                int sum = 0;
                for (const auto& [a, b, c] : shape.triangles) {
                    sum += upward_crossing(shape.vertices[static_cast<std::size_t>(a)],
                                           shape.vertices[static_cast<std::size_t>(b)],
                                           shape.vertices[static_cast<std::size_t>(c)], Vector3(x, y, z));
                }
                EXPECT_EQ(sum, norm < 4 ? 1 : 0) << x << ' ' << y << ' ' << z;
            }
        }
    }
}

}  // namespace
}  // namespace trocar
