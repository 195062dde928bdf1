// Curves of intersection and the regions they cut off, against what is known of the bodies' sides; the attraction's
// direction by finite differences; what it clears over time and the gaps that are the method's own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "geometry/orientation.hpp"
#include "respond/intersection_regions.hpp"
#include "support/closed_loop.hpp"

namespace trocar {
namespace {

using test::ClosedLoop;
using test::LoopBody;
using test::make_shaft;
using test::make_sheet;

/// A pointed shaft whose tip is at `tip`, and a sheet in the plane z = 0.
ClosedLoop pierced(const Vector3& tip, int cells, double edge, double radius = 0.0025,
                   const std::string& method = "global_intersection") {
    return test::tool_on_tissue(make_shaft(radius, 0.06, 8, 0.01).move(tip), {}, make_sheet(cells, edge), method);
}

struct Traced {
    SurfaceNeighbours surface;
    IntersectionRegions regions;
    std::vector<TrianglePair> pairs;

    explicit Traced(const ClosedLoop& world, std::size_t leave_out = SIZE_MAX) {
        surface.prepare(world.topology);
        surface.measure(world.topology, world.frame.position);
        const auto detector = make_detector("brute_force");
        detector->prepare(world.topology, world.frame);
        ContactSet contacts;
        detector->update(world.frame, 0.0);
        detector->detect(world.frame, contacts);
        pairs = contacts.pairs;
        if (leave_out < pairs.size()) pairs.erase(pairs.begin() + static_cast<std::ptrdiff_t>(leave_out));
        regions.prepare(world.topology);
        regions.find(world.topology, surface, world.frame, pairs);
    }
};

std::set<Index> as_set(const std::vector<Index>& list) { return {list.begin(), list.end()}; }

/// Vertices of the tool (body 0) below the sheet's plane.
std::set<Index> below(const ClosedLoop& world) {
    std::set<Index> result;
    const Range range = world.topology.bodies[0].vertices;
    for (Index v = range.first; v < range.end(); ++v) {
        if (world.frame.position(2, v) < 0.0) result.insert(v);
    }
    return result;
}

/// Vertices of the sheet (body 1) inside the tool, by the tool's winding number.
std::set<Index> swallowed(const ClosedLoop& world) {
    std::set<Index> result;
    const Triangles tool = world.topology.triangles.leftCols(world.topology.bodies[0].triangles.count);
    const Range range = world.topology.bodies[1].vertices;
    for (Index v = range.first; v < range.end(); ++v) {
        const Vector3 x = world.frame.position.col(v);
        if (winding_number(world.frame.position, tool, x) > 0.5) result.insert(v);
    }
    return result;
}

TEST(IntersectionRegions, AreTheToolsTipBelowTheSheetAndTheSheetInsideTheTool) {
    std::mt19937_64 generator(17);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    std::size_t largest = 0;
    for (int trial = 0; trial < 12; ++trial) {
        // From within the cone to some rings deep; sheets from much finer than the tool to one face around it.
        const double edge = trial % 3 == 0 ? 0.012 : 0.001;
        const ClosedLoop world =
            pierced(Vector3{0.003 * unit(generator), 0.003 * unit(generator), -0.011 - 0.009 * unit(generator)},
                    static_cast<int>(0.03 / edge) + 2, edge);
        const Traced traced(world);
        ASSERT_EQ(traced.regions.contours().size(), 1U) << trial;
        const IntersectionContour& contour = traced.regions.contours()[0];
        EXPECT_TRUE(contour.closed && contour.separates_a && contour.separates_b);
        EXPECT_EQ(as_set(contour.inside_a), below(world)) << trial;
        EXPECT_EQ(as_set(contour.inside_b), swallowed(world)) << trial;
        EXPECT_EQ(traced.regions.pairs_of(contour).size(), traced.pairs.size());
        largest = std::max(largest, contour.inside_b.size());
    }
    EXPECT_GT(largest, 8U);
}

TEST(IntersectionRegions, ClosesWhereEdgesMeetEdgesExactly) {
    // The tip right under a vertex of the sheet, the cone's edges in the planes of the sheet's edges.
    const ClosedLoop world = pierced(Vector3(0.0, 0.0, -0.004), 8, 0.005);
    const Traced traced(world);
    ASSERT_EQ(traced.regions.contours().size(), 1U);
    EXPECT_TRUE(traced.regions.contours()[0].closed);
    EXPECT_EQ(as_set(traced.regions.contours()[0].inside_a), below(world));
    EXPECT_EQ(as_set(traced.regions.contours()[0].inside_b), swallowed(world));
}

TEST(IntersectionRegions, EachLayerHasACurveOfItsOwn) {
    const test::Shape shaft = make_shaft(0.0025, 0.06, 8, 0.01).move({0.0011, 0.0007, -0.02});
    const test::Shape lower = make_sheet(6, 0.005).move({0.0, 0.0, -0.012});
    const ClosedLoop world(
        {LoopBody{.name = "tool", .kind = BodyKind::instrument, .mesh = shaft},
         LoopBody{.name = "sheet", .kind = BodyKind::tissue, .closed = false, .mesh = make_sheet(6, 0.005)},
         LoopBody{.name = "lower", .kind = BodyKind::tissue, .closed = false, .mesh = lower}},
        "penalty");
    const Traced traced(world);
    ASSERT_EQ(traced.regions.contours().size(), 2U);
    std::set<Index> tissues;
    for (const IntersectionContour& contour : traced.regions.contours()) {
        tissues.insert(contour.body_b);
        EXPECT_TRUE(contour.closed);
        const double plane = contour.body_b == 1 ? 0.0 : -0.012;
        for (const Index v : contour.inside_a) EXPECT_LT(world.frame.position(2, v), plane);
    }
    EXPECT_EQ(tissues, (std::set<Index>{1, 2}));
}

TEST(IntersectionRegions, GapACurveThatEndsAtTheRimHasNoRegion) {
    const ClosedLoop world = pierced(Vector3(0.02 + 0.0003, 0.0007, -0.015), 8, 0.005);
    const Traced traced(world);
    ASSERT_FALSE(traced.pairs.empty());
    ASSERT_EQ(traced.regions.contours().size(), 1U);
    EXPECT_FALSE(traced.regions.contours()[0].closed);
    EXPECT_TRUE(traced.regions.contours()[0].inside_a.empty());
}

TEST(IntersectionRegions, GapAToolFurtherThroughThanNotHasTheWrongRegion) {
    const ClosedLoop world = pierced(Vector3(0.0011, 0.0007, -0.05), 8, 0.005);
    const Traced traced(world);
    ASSERT_EQ(traced.regions.contours().size(), 1U);
    ASSERT_FALSE(traced.regions.contours()[0].inside_a.empty());
    for (const Index v : traced.regions.contours()[0].inside_a) EXPECT_GT(world.frame.position(2, v), 0.0);
}

TEST(IntersectionRegions, AMissedPairLeavesTheCurveOpenAndNothingElseBreaks) {
    const ClosedLoop world = pierced(Vector3(0.0011, 0.0007, -0.012), 30, 0.001);
    const std::size_t pairs = Traced(world).pairs.size();
    for (std::size_t leave_out = 0; leave_out < pairs; leave_out += 3) {
        const Traced traced(world, leave_out);
        for (const IntersectionContour& contour : traced.regions.contours()) {
            EXPECT_FALSE(contour.closed);
            EXPECT_TRUE(contour.inside_a.empty() && contour.inside_b.empty());
        }
    }
}

TEST(IntersectionRegions, CentreIsThatOfTheHole) {
    // A regular octagon around the shaft's axis.
    for (const double depth : {0.004, 0.0131, 0.021}) {
        const ClosedLoop world = pierced(Vector3(0.0011, 0.0007, -depth), 14, 0.0025);
        const Traced traced(world);
        ASSERT_EQ(traced.regions.contours().size(), 1U);
        EXPECT_LT((traced.regions.contours()[0].centre - Vector3(0.0011, 0.0007, 0.0)).norm(), 1e-9) << depth;
    }
}

TEST(GlobalIntersection, MovingTheTissueAlongItsForceShortensTheDistances) {
    // By finite differences, regions found anew each time: one metre along the common direction takes one metre off
    // every distance, so E = Σ k d²/2 falls by Σ k d.
    ClosedLoop world = pierced(Vector3(0.0011, 0.0007, -0.0131), 14, 0.0025);
    const auto energy = [&] {
        const Traced traced(world);
        ContactSet contacts;
        contacts.pairs = traced.pairs;
        world.response().respond(world.frame, world.dt, contacts, {}, world.output);
        double sum = 0.0;
        for (const ContactForceLaw& c : world.output.contacts) sum += 0.5 * c.k * c.gap * c.gap;
        return sum;
    };
    energy();
    ASSERT_GT(world.output.contacts.size(), 2U);
    double slope = 0.0;
    const Vector3 direction = world.output.contacts[0].normal;
    EXPECT_LT((direction + Vector3::UnitZ()).norm(), 1e-6);
    for (const ContactForceLaw& c : world.output.contacts) {
        if (c.bilateral()) {  // drag across the pull
            EXPECT_LT(std::abs(c.normal.dot(direction)), 1e-12);
            EXPECT_EQ(c.k, 0.0);
            continue;
        }
        EXPECT_LT((c.normal - direction).norm(), 1e-12);
        slope += c.k * c.gap;
    }
    const Range sheet = world.topology.bodies[1].vertices;
    const Matrix3X rest = world.frame.position;
    constexpr double h = 1e-6;
    world.frame.position.middleCols(sheet.first, sheet.count).colwise() += h * direction;
    const double after = energy();
    world.frame.position = rest;
    world.frame.position.middleCols(sheet.first, sheet.count).colwise() -= h * direction;
    const double before = energy();
    EXPECT_NEAR((after - before) / (2.0 * h), slope, 1e-4 * std::abs(slope));
}

/// Tool that comes down to `depth`, waits, then stays, is dragged or withdrawn; how far its tip is below the sheet
/// 200 ms after its last move, m.
double left_after_stab(const std::string& method, double speed, double depth, const Vector3& then) {
    const double arrival = (0.002 + depth) / speed;
    const double later = then.norm() / speed;
    const auto offset = [=](double t) -> Vector3 {
        const double share = later > 0.0 ? std::clamp((t - arrival - 0.02) / later, 0.0, 1.0) : 0.0;
        return Vector3(0.0011, 0.0007, std::max(0.002 - speed * t, -depth)) + share * then;
    };
    ClosedLoop loop = test::tool_on_tissue(make_shaft(0.0025, 0.06, 8, 0.01), offset, make_sheet(10, 0.005), method);
    const int ticks = static_cast<int>(1000.0 * (arrival + (later > 0.0 ? 0.02 + later : 0.0) + 0.2)) + 1;
    for (int tick = 0; tick < ticks; ++tick) {
        EXPECT_TRUE(loop.step()) << method << ": " << loop.outcome.message;
        if (!loop.outcome.ok()) return -1.0;
    }
    return test::depth_at_tip(loop);
}

TEST(GlobalIntersection, ClearsAToolThatStoppedWithdrawsOrIsDraggedWherePenaltyDoesNot) {
    for (const double speed : {0.1, 0.6}) {
        EXPECT_LE(left_after_stab("global_intersection", speed, 0.006, Vector3::Zero()), 1e-4) << speed;
        EXPECT_LE(left_after_stab("global_intersection", speed, 0.006, Vector3(0, 0, 0.012)), 1e-4) << speed;
        EXPECT_LE(left_after_stab("global_intersection", speed, 0.006, Vector3(0.012, 0, 0)), 1e-4) << speed;
    }
    EXPECT_GT(left_after_stab("penalty", 0.6, 0.006, Vector3::Zero()), 5e-4);
    // Without drag the light vertex under the tip swings sideways faster than it is pulled.
    EXPECT_GT(left_after_stab("global_intersection:drag=0", 0.1, 0.006, Vector3(0.012, 0, 0)), 4e-4);
}

}  // namespace
}  // namespace trocar
