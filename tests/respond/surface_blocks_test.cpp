#include "respond/surface_blocks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace trocar {
namespace {

/// Triangles whose box meets one of the boxes, by a look at each.
std::vector<Index> obviously_near(const Topology& topology, const Matrix3X& position, const std::vector<Box>& boxes) {
    std::vector<Index> near;
    for (Index t = 0; t < topology.triangle_count(); ++t) {
        Box here;
        for (int i = 0; i < 3; ++i) here.add(position.col(topology.triangles(i, t)));
        const bool meets =
            std::any_of(boxes.begin(), boxes.end(), [&here](const Box& box) { return here.overlaps(box); });
        if (meets) near.push_back(t);
    }
    return near;
}

/// A sheet of 40 x 40 squares that drifts and shivers while two boxes wander over it.
TEST(SurfaceBlocks, TrianglesNearBoxesAreTheSameAsByALookAtEach) {
    constexpr Index side = 41;
    Body sheet{.name = "sheet", .kind = BodyKind::tissue, .vertex_count = side * side, .triangles = {}};
    sheet.triangles.resize(3, 2 * (side - 1) * (side - 1));
    Matrix3X position(3, side * side);
    Index t = 0;
    for (Index v = 0; v < side * side; ++v) {
        position.col(v) = Vector3(v % side, v / side, 0.0) * 0.01;
        if (v % side == side - 1 || v / side == side - 1) continue;
        sheet.triangles.col(t++) << v, v + 1, v + side;
        sheet.triangles.col(t++) << v + 1, v + side + 1, v + side;
    }
    const Topology topology = make_topology({sheet});
    SurfaceBlocks blocks;
    blocks.prepare(topology, topology.bodies[0].triangles);
    blocks.refresh_all(position);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    std::vector<Index> near;
    std::size_t found = 0;
    for (int tick = 0; tick < 400; ++tick) {
        double furthest = 0.0;
        for (Index v = 0; v < side * side; ++v) {
            const Vector3 way = Vector3(4e-4, -2e-4, 0.0) + 1e-3 * Vector3(unit(random), unit(random), unit(random));
            position.col(v) += way;
            furthest = std::max(furthest, way.norm());
        }
        if (tick == 200) {  // thrown far away by one tick that nobody has measured
            position.colwise() += Vector3(3.0, 0.0, 0.0);
            furthest = std::numeric_limits<double>::infinity();
        }
        blocks.move(furthest);
        std::vector<Box> boxes(2);
        for (std::size_t b = 0; b < boxes.size(); ++b) {
            const Vector3 centre = position.col((tick * 7 + static_cast<int>(b) * 900) % (side * side));
            boxes[b].add(centre - Vector3(0.013, 0.02, 0.005));
            boxes[b].add(centre + Vector3(0.02, 0.01, 0.005));
        }
        blocks.collect(topology, position, boxes, near);
        ASSERT_EQ(near, obviously_near(topology, position, boxes)) << tick;
        found += near.size();
    }
    EXPECT_GT(found, 400U);
}

}  // namespace
}  // namespace trocar
