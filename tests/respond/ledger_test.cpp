// The crossing ledger against sides that are known otherwise: closed forms at the start, the winding number of a sheet
// closed by a cap far below on long random drags, and the rules by which a penetration is given up.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "contact/derive.hpp"
#include "respond/common.hpp"
#include "respond/crossing_ledger.hpp"
#include "support/closed_loop.hpp"

namespace trocar {
namespace {

using test::ClosedLoop;
using test::LoopBody;
using test::make_shaft;
using test::make_sheet;
using test::Mesh;

Mesh moved(Mesh mesh, const Vector3& by) {
    for (Vector3& p : mesh.points) p += by;
    return mesh;
}

/// Solid angle of a triangle over 4 pi (van Oosterom, Strackee 1983).
double winding_part(const Vector3& p, const Vector3& q, const Vector3& r, const Vector3& x) {
    const Vector3 a = p - x;
    const Vector3 b = q - x;
    const Vector3 c = r - x;
    return std::atan2(a.dot(b.cross(c)), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() + b.dot(c) * a.norm() +
                                             c.dot(a) * b.norm()) /
           (2.0 * std::numbers::pi);
}

/// World, ledger and contacts of one frame; the tool is body 0, the tissue body 1.
struct LedgerWorld {
    ClosedLoop loop;
    SurfaceNeighbours surface;
    CrossingLedger ledger;
    LedgerWorld(const Mesh& tool, const Mesh& tissue, bool closed, SheetSide side = SheetSide::front,
                bool on_edges = false)
        : loop({LoopBody{.name = "tool", .kind = BodyKind::instrument, .mesh = tool},
                LoopBody{.name = "tissue", .kind = BodyKind::tissue, .closed = closed, .mesh = tissue}},
               "penalty") {
        loop.topology.bodies[1].start_side = side;
        surface.prepare(loop.topology);
        ledger.prepare(loop.topology, tissue_scales(loop.topology, loop.materials), on_edges);
    }
    /// One call on the frame, with the contacts that it has.
    void update() {
        ContactSet contacts;
        const auto detector = make_detector("brute_force");
        detector->prepare(loop.topology, loop.frame);
        detector->update(loop.frame, 0.0);
        detector->detect(loop.frame, contacts);
        derive(loop.topology, loop.frame, contacts);
        ledger.update(loop.topology, surface, loop.frame, contacts);
    }
    [[nodiscard]] Range tool() const { return loop.topology.bodies[0].vertices; }
};

TEST(LedgerStart, BodyThroughAnOpenSheetBelongsOnTheDeclaredSide) {
    // From 5 mm deep to nearly all of a 60 mm shaft behind the sheet, and the shaft coming up from behind.
    for (const double bottom : {-0.005, -0.02, -0.057}) {
        for (const bool turned : {false, true}) {
            for (const SheetSide side : {SheetSide::front, SheetSide::back}) {
                Mesh shaft = moved(make_shaft(0.0025, 0.06, 8, 0.01), Vector3(0.0011, 0.0007, bottom));
                if (turned) {
                    for (Vector3& p : shaft.points) p = Vector3(p.x(), -p.y(), -p.z());
                }
                LedgerWorld world(shaft, make_sheet(10, 0.005), false, side);
                world.update();
                std::size_t wrong = 0;
                for (Index v = 0; v < world.tool().count; ++v) {
                    const double z = world.loop.frame.position(2, v);
                    // Front to back counts +1; the sheet is the plane z = 0.
                    const int expected = side == SheetSide::front ? (z < 0.0 ? 1 : 0) : (z > 0.0 ? -1 : 0);
                    EXPECT_EQ(world.ledger.count(v, 1), expected) << "z " << z << " bottom " << bottom;
                    wrong += expected != 0 ? 1 : 0;
                }
                ASSERT_EQ(world.ledger.penetrations().size(), wrong);
                for (const Penetration& p : world.ledger.penetrations()) {
                    const double z = world.loop.frame.position(2, p.sample.vertex);
                    EXPECT_NEAR(p.depth, std::abs(z), 1e-12);
                    EXPECT_NEAR(p.normal.z(), side == SheetSide::front ? 1.0 : -1.0, 1e-12);
                }
            }
        }
    }
}

TEST(LedgerStart, BodyThatDoesNotCrossBelongsWhereItIs) {
    for (const SheetSide side : {SheetSide::front, SheetSide::back}) {
        for (const double z : {0.004, -0.064}) {
            LedgerWorld world(moved(make_shaft(0.0025, 0.06, 8, 0.01), Vector3(0.0011, 0.0007, z)),
                              make_sheet(10, 0.005), false, side);
            world.update();
            for (Index v = 0; v < world.tool().count; ++v) EXPECT_EQ(world.ledger.count(v, 1), 0);
        }
    }
}

TEST(LedgerStart, ClosedBodyIsJudgedByTheWindingNumber) {
    // The organ is a convex prism with a point: inside where all faces have the point behind them.
    const Mesh organ = make_shaft(0.02, 0.05, 9, 0.01);
    LedgerWorld world(moved(make_shaft(0.0025, 0.06, 8, 0.01), Vector3(0.0031, 0.0017, 0.045)), organ, true);
    world.update();
    int inside = 0;
    for (Index v = 0; v < world.tool().count; ++v) {
        const Vector3 x = world.loop.frame.position.col(v);
        bool behind_all = true;
        for (const auto& t : organ.triangles) {
            const Vector3 a = organ.points[static_cast<std::size_t>(t[0])];
            const Vector3 n = (organ.points[static_cast<std::size_t>(t[1])] - a)
                                  .cross(organ.points[static_cast<std::size_t>(t[2])] - a);
            behind_all = behind_all && n.dot(x - a) < 0.0;
        }
        EXPECT_EQ(world.ledger.count(v, 1), behind_all ? 1 : 0) << x.transpose();
        inside += behind_all ? 1 : 0;
    }
    EXPECT_GT(inside, 0);
    EXPECT_LT(inside, world.tool().count);
}

TEST(LedgerCheck, PutsRightAndCountsWhatAFrameThatWasNoNumberHasLost) {
    const Mesh organ = make_shaft(0.02, 0.05, 9, 0.01);
    LedgerWorld world(moved(make_shaft(0.0025, 0.06, 8, 0.01), Vector3(0.0031, 0.0017, 0.1)), organ, true);
    const Matrix3X start = world.loop.frame.position;
    const Range tool = world.tool();
    world.update();
    world.loop.frame.position.middleCols(tool.first, tool.count).setConstant(std::nan(""));
    world.ledger.update(world.loop.topology, world.surface, world.loop.frame, {});
    // 75 mm lower: from z = 25 mm on it stands in the organ, which ends at 50 mm. The way there was not seen.
    world.loop.frame.position = start;
    world.loop.frame.position.middleCols(tool.first, tool.count).row(2).array() -= 0.075;
    for (std::int64_t tick = 0; tick < CrossingLedger::check_period; ++tick) {
        world.ledger.update(world.loop.topology, world.surface, world.loop.frame, {});
    }
    std::int64_t inside = 0;
    for (Index v = 0; v < tool.count; ++v) {
        const bool in = world.loop.frame.position(2, v) < 0.05;
        EXPECT_EQ(world.ledger.count(v, 1), in ? 1 : 0) << world.loop.frame.position(2, v);
        inside += in ? 1 : 0;
    }
    EXPECT_GT(inside, 10);
    EXPECT_EQ(world.ledger.repairs(), inside);
}

TEST(LedgerCheck, HasNothingToRepairOnAWellBehavedDrag) {
    const Mesh organ = make_shaft(0.02, 0.05, 9, 0.01);
    LedgerWorld world(moved(make_shaft(0.0025, 0.06, 8, 0.01), Vector3(0.0031, 0.0017, 0.055)), organ, true);
    const Matrix3X start = world.loop.frame.position;
    const Range tool = world.tool();
    int crossings = 0;
    for (int tick = 0; tick < 600; ++tick) {
        world.loop.frame.position = start;
        world.loop.frame.position.middleCols(tool.first, tool.count).colwise() +=
            Vector3(0.03 * std::sin(0.031 * tick), 0.02 * std::sin(0.047 * tick), -0.05 * std::sin(0.05 * tick));
        world.ledger.update(world.loop.topology, world.surface, world.loop.frame, {});
        crossings += world.ledger.penetrations().empty() ? 0 : 1;
    }
    EXPECT_GT(crossings, 50);
    EXPECT_EQ(world.ledger.repairs(), 0);
}

TEST(LedgerParity, IsTheExactSideOfAFlutteringSheetOnALongDrag) {
    // Sheet and a cap from its rim to a point far below enclose a space: inside it is behind the sheet.
    constexpr int n = 10;
    const Mesh sheet = make_sheet(n, 0.005);
    Mesh probe;
    probe.points = {Vector3::Zero(), Vector3(1e-5, 0, 0), Vector3(0, 1e-5, 0)};
    probe.triangles = {{0, 1, 2}};
    LedgerWorld world(moved(probe, Vector3(0, 0, 0.01)), sheet, false);
    std::map<std::pair<Index, Index>, int> directed;
    for (const auto& t : sheet.triangles) {
        for (std::size_t i = 0; i < 3; ++i) ++directed[{t[i], t[(i + 1) % 3]}];
    }
    std::vector<std::pair<Index, Index>> rim;
    for (const auto& [edge, count] : directed) {
        if (directed.find({edge.second, edge.first}) == directed.end()) rim.push_back(edge);
    }
    ASSERT_EQ(rim.size(), 4U * n);
    const Vector3 far_below(0, 0, -1.0);
    std::mt19937_64 generator(11);
    std::normal_distribution<double> normal(0.0, 1.0);
    const Matrix3X rest = world.loop.frame.position;
    Frame frame = world.loop.frame;
    Vector3 place = Vector3::Zero();
    int behind_ticks = 0;
    int changes = 0;
    int before = 0;
    for (int tick = 0; tick < 6000; ++tick) {
        if (tick > 0) {
            place += 0.002 * Vector3(normal(generator), normal(generator), normal(generator)) -
                     0.05 * (place + Vector3(0, 0, 0.01));
            place = place.cwiseMax(Vector3(-0.02, -0.02, -0.04)).cwiseMin(Vector3(0.02, 0.02, 0.03));
            for (Index v = 0; v < 3; ++v) frame.position.col(v) = rest.col(v) + place;
            for (Index v = 3; v < world.loop.topology.vertex_count; ++v) {
                if (world.loop.materials.pinned[static_cast<std::size_t>(v)] != 0) continue;
                frame.position.col(v) =
                    rest.col(v) + 0.002 * Vector3(normal(generator), normal(generator), normal(generator));
            }
        }
        world.ledger.update(world.loop.topology, world.surface, frame, {});
        for (Index v = 0; v < 3; ++v) {
            const Vector3 x = frame.position.col(v);
            double winding = 0.0;
            for (const auto& t : sheet.triangles) {
                winding += winding_part(frame.position.col(3 + t[0]), frame.position.col(3 + t[1]),
                                        frame.position.col(3 + t[2]), x);
            }
            for (const auto& [u, w] : rim) {
                winding += winding_part(frame.position.col(3 + w), frame.position.col(3 + u), far_below, x);
            }
            const int side = static_cast<int>(std::lround(winding));
            ASSERT_EQ(world.ledger.count(v, 1), side) << "tick " << tick << " at " << x.transpose();
            if (v > 0) continue;
            behind_ticks += side != 0 ? 1 : 0;
            changes += side != before ? 1 : 0;
            before = side;
        }
    }
    EXPECT_GT(changes, 200);
    EXPECT_GT(behind_ticks, 1000);
    EXPECT_LT(behind_ticks, 5500);
}

TEST(LedgerParity, TissueAgainstTissueIsCountedFromBothSides) {
    // A ball of tissue sinks through a tissue sheet and comes back; both move.
    const Mesh ball = moved(make_shaft(0.008, 0.02, 9, 0.004), Vector3(0.0013, 0.0007, 0.004));
    ClosedLoop loop(
        {LoopBody{.name = "ball", .kind = BodyKind::tissue, .mesh = ball, .pin_rim = false},
         LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = make_sheet(10, 0.005)}},
        "penalty");
    SurfaceNeighbours surface;
    surface.prepare(loop.topology);
    CrossingLedger ledger;
    ledger.prepare(loop.topology, tissue_scales(loop.topology, loop.materials), false);
    const Matrix3X start = loop.frame.position;
    Frame frame = loop.frame;
    const Range balls = loop.topology.bodies[0].vertices;
    const Range sheet = loop.topology.bodies[1].vertices;
    for (int tick = 0; tick < 200; ++tick) {
        const double down = 0.015 * (1.0 - std::cos(0.0628 * tick));
        const double wave = 0.002 * std::sin(0.3 * tick);
        frame.position = start;
        frame.position.middleCols(balls.first, balls.count).row(2).array() -= down;
        frame.position.middleCols(sheet.first, sheet.count).row(2).array() += wave;
        ledger.update(loop.topology, surface, frame, {});
        for (Index v = balls.first; v < balls.end(); ++v) {
            ASSERT_EQ(ledger.count(v, 1), frame.position(2, v) < wave ? 1 : 0) << tick;
        }
        for (Index v = sheet.first; v < sheet.end(); ++v) {
            double winding = 0.0;
            for (const auto& t : ball.triangles) {
                winding += winding_part(frame.position.col(t[0]), frame.position.col(t[1]), frame.position.col(t[2]),
                                        frame.position.col(v));
            }
            ASSERT_EQ(ledger.count(v, 0), static_cast<int>(std::lround(winding))) << tick;
        }
    }
}

TEST(LedgerParity, PointsOnALongEdgeAreOnTheSideWhereTheEdgeIs) {
    // A bar whose corners stay beyond the rim goes down and up through a flat sheet, ten degrees askew: no vertex of it
    // ever crosses.
    const double bar = 0.004;
    Mesh mesh = test::make_box(Vector3(bar, 0.06, bar));
    const Eigen::AngleAxisd askew(0.1745, Vector3::UnitZ());
    for (Vector3& p : mesh.points) p = askew * p + Vector3(0.0013, 0.0007, 0.0);
    LedgerWorld world(mesh, make_sheet(8, 0.005), false, SheetSide::front, true);
    const Matrix3X start = world.loop.frame.position;
    const Range tool = world.tool();
    int behind = 0;
    for (int tick = 0; tick < 200; ++tick) {
        const double z = 0.004 * std::cos(0.1 * tick);
        world.loop.frame.position = start;
        world.loop.frame.position.leftCols(tool.count).row(2).array() += z;
        world.update();
        for (Index v = 0; v < tool.count; ++v) ASSERT_EQ(world.ledger.count(v, 1), 0);
        // The bar's four long edges join corners that differ in y alone.
        for (const auto& [u, v] : {std::pair{0, 2}, {1, 3}, {4, 6}, {5, 7}}) {
            const double depth = -world.loop.frame.position(2, u);
            const auto layers = world.ledger.layers_on_edge(v, u, 1);
            if (depth > 0.0) {
                ASSERT_FALSE(layers.empty()) << "tick " << tick << " depth " << depth;
                ++behind;
            }
            for (const Penetration& p : layers) {
                ASSERT_NEAR(p.depth, depth, 1e-12) << "tick " << tick;
                ASSERT_NEAR(p.normal.z(), 1.0, 1e-12);
            }
        }
    }
    EXPECT_GT(behind, 200);
    EXPECT_LT(behind, 600);
}

TEST(LedgerResting, AToolThatTouchesASheetFromBehindIsNoPenetration) {
    // Bone below a sheet that lies on it: every vertex of the bone is behind the sheet, where it belongs.
    Mesh spike = make_shaft(0.0015, 0.03, 6, 0.02);
    for (Vector3& p : spike.points) p = Vector3(p.x(), -p.y(), -p.z());
    const auto run = [&](double top) {
        ClosedLoop loop(
            {LoopBody{.name = "bone",
                      .mesh = moved(spike, Vector3(0.0011, 0.0007, -0.001)),
                      .offset = [top](double t) { return Vector3(0, 0, std::min(top + 0.001, 0.1 * t)); }},
             LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = make_sheet(8, 0.005)}},
            "thesis:profile=corrected");
        double lowest = 0.0;
        for (int tick = 0; tick < 150; ++tick) {
            EXPECT_TRUE(loop.step()) << loop.outcome.message;
            const Range sheet = loop.topology.bodies[1].vertices;
            lowest = std::min(lowest, loop.frame.position.row(2).segment(sheet.first, sheet.count).minCoeff());
        }
        return lowest;
    };
    // Never pulled down onto the spike. (The sheet swings a little once it is lifted.)
    EXPECT_GT(run(0.003), -1e-4);
}

// ------------------------------------------------------------ giving up
struct Ending {
    std::int64_t ruptures = 0;
    int first_tick = -1;
    double strain = 0.0;  ///< largest before the first rupture
};

Ending run_stab(const std::string& method, const Mesh& sheet, const Vector3& place, double speed, double depth,
                int ticks) {
    ClosedLoop loop({LoopBody{.name = "tool",
                              .kind = BodyKind::instrument,
                              .mesh = make_shaft(0.0015, 0.06, 6, 0.01),
                              .offset = [=](double t) -> Vector3 {
                                  return place + Vector3(0, 0, std::max(0.001 - speed * t, -depth));
                              }},
                     LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = sheet}},
                    method);
    Ending ending;
    for (int tick = 0; tick < ticks; ++tick) {
        EXPECT_TRUE(loop.step()) << loop.outcome.message;
        if (loop.effect.ruptures > 0 && ending.first_tick < 0) ending.first_tick = tick;
        if (ending.first_tick < 0) ending.strain = std::max(ending.strain, loop.tissue().max_strain());
        ending.ruptures += loop.effect.ruptures;
    }
    return ending;
}

TEST(LedgerRupture, DeeperThanDMaxAtOnce) {
    // 6 mm in 2 ticks, before the tissue can follow.
    const Mesh sheet = make_sheet(10, 0.005);
    const Ending deep =
        run_stab("thesis:profile=corrected,d_max=0.002", sheet, Vector3(0.0011, 0.0007, 0), 3.5, 0.006, 20);
    EXPECT_GT(deep.ruptures, 0);
    EXPECT_LT(deep.first_tick, 5);
    EXPECT_EQ(
        run_stab("thesis:profile=corrected,d_max=0.01", sheet, Vector3(0.0011, 0.0007, 0), 3.5, 0.006, 20).ruptures, 0);
}

TEST(LedgerRupture, WhereNothingCanGiveWayWithinTwoHundredMillisecondsOfTheLastKey) {
    // Through a cell all of whose corners are pinned: no strain, no way out, and not deeper than d_max. The tool is
    // 0.1 mm deep at 0.022 s, from where on the tear time of 5 ms counts, and stands from 0.1 s on.
    const Ending pinned =
        run_stab("thesis:profile=corrected", make_sheet(1, 0.02), Vector3(0.0031, 0.0017, 0), 0.05, 0.004, 2200);
    EXPECT_GT(pinned.ruptures, 0);
    EXPECT_GE(pinned.first_tick, 26);
    EXPECT_LT(pinned.first_tick, 300);
    EXPECT_EQ(pinned.strain, 0.0);
}

TEST(LedgerRupture, AfterTwoSecondsWhateverTheReason) {
    // Tissue that nobody advances: not deep, not stretched, not held, and never clear.
    Mesh shaft = moved(make_shaft(0.0025, 0.06, 8, 0.01), Vector3(0.0011, 0.0007, -0.002));
    ClosedLoop loop(
        {LoopBody{.name = "tool", .kind = BodyKind::instrument, .mesh = shaft},
         LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = make_sheet(10, 0.005)}},
        "thesis:profile=corrected");
    const auto detector = make_detector("brute_force");
    detector->prepare(loop.topology, loop.frame);
    ContactSet contacts;
    detector->update(loop.frame, 0.0);
    detector->detect(loop.frame, contacts);
    derive(loop.topology, loop.frame, contacts);
    std::vector<std::int64_t> ruptures;
    for (int tick = 0; tick < 2010; ++tick) {
        loop.response().respond(loop.frame, loop.dt, contacts, {}, loop.effect);
        ruptures.push_back(loop.effect.ruptures);
    }
    const auto first = std::find_if(ruptures.begin(), ruptures.end(), [](std::int64_t n) { return n > 0; });
    EXPECT_GE(first - ruptures.begin(), 2000);
    EXPECT_NE(first, ruptures.end());
}

TEST(LedgerRupture, WhereTheTissueIsAtItsStrainLimitForTheTearTime) {
    // 30 mm into a sheet of 20 mm: its springs cannot be that long; d_max lets it try.
    const auto run = [](const std::string& tear_time) {
        return run_stab("thesis:profile=corrected,d_max=1,tear_time=" + tear_time, make_sheet(4, 0.005),
                        Vector3(0.0003, 0.0002, 0), 0.2, 0.03, 1200);
    };
    const Ending torn = run("0.005");
    EXPECT_GT(torn.ruptures, 0);
    EXPECT_GE(torn.strain, 0.999);
    // A straight way of 20 mm to the rim at 10 mm is 17.3 mm deep, reached at 0.0915 s; springs beside the tip that
    // stretch more than the others reach their limit before, but not in the first half.
    EXPECT_GT(torn.first_tick, 45);
    EXPECT_LT(torn.first_tick, 150);
    const Ending later = run("0.02");
    EXPECT_GT(later.first_tick, torn.first_tick + 10);
    // Without the tear time the stall remains: 0.1 s without getting better.
    const Ending stalled = run("1000");
    EXPECT_GT(stalled.ruptures, 0);
    EXPECT_GT(stalled.first_tick, 150);
}

TEST(LedgerRupture, OfAHookThatLiftsTheSheetOrDragsItFromItsRimBeyondTheLimitAndNotWithinIt) {
    // A bar that has come from behind carries the sheet up; one that has come from the front pulls it sideways by a
    // pocket 4 mm deep. The sheet is 20 mm wide with a pinned rim.
    const auto run = [](const Vector3& way, bool behind) {
        Mesh bar = make_shaft(0.0015, 0.06, 6, 0.01);
        if (behind) {
            for (Vector3& p : bar.points) p = Vector3(p.x(), -p.y(), -p.z());
        }
        const double side = behind ? -1.0 : 1.0;
        ClosedLoop loop(
            {LoopBody{.name = "hook",
                      .kind = BodyKind::instrument,
                      .mesh = bar,
                      .offset = [=](double t) -> Vector3 {
                          const Vector3 in(0.0003, 0.0002, side * std::max(0.001 - 0.1 * t, -0.004));
                          return in + std::clamp((t - 0.06) / 0.15, 0.0, 1.0) * way;
                      }},
             LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = make_sheet(4, 0.005)}},
            "thesis:profile=corrected,d_max=1");
        std::int64_t ruptures = 0;
        for (int tick = 0; tick < 420; ++tick) {
            EXPECT_TRUE(loop.step()) << loop.outcome.message;
            ruptures += loop.effect.ruptures;
        }
        return ruptures;
    };
    EXPECT_EQ(run(Vector3(0, 0, 0.002), true), 0);
    EXPECT_GT(run(Vector3(0, 0, 0.025), true), 0);
    EXPECT_EQ(run(Vector3(0.001, 0, 0), false), 0);
    EXPECT_GT(run(Vector3(0.03, 0, -0.01), false), 0);
}

}  // namespace
}  // namespace trocar
