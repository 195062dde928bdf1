// Normals and areas of a surface at its vertices, on roofs whose two sides are alike.
#include "respond/surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geometry/exact.hpp"

namespace trocar {
namespace {

/// A ridge of 1 m along x with two triangles, whose outer normals lean `lean` to either side of +z.
struct Roof {
    Topology topology;
    Matrix3X position{3, 4};
    SurfaceNeighbours surface;
    Vector3 face;  ///< outer normal of triangle 0

    Roof(BodyKind kind, double lean_degrees) {
        const double lean = lean_degrees * std::numbers::pi / 180.0;
        Triangles triangles(3, 2);
        triangles.col(0) << 0, 1, 2;
        triangles.col(1) << 1, 0, 3;
        topology =
            make_topology({Body{.name = "roof", .kind = kind, .vertex_count = 4, .triangles = std::move(triangles)}});
        position.col(0) = Vector3::Zero();
        position.col(1) = Vector3::UnitX();
        position.col(2) = Vector3(0.5, std::cos(lean), -std::sin(lean));
        position.col(3) = Vector3(0.5, -std::cos(lean), -std::sin(lean));
        face = Vector3(0.0, std::sin(lean), std::cos(lean));
        surface.prepare(topology);
    }
    [[nodiscard]] Vector3 on_ridge() const {
        return surface.blended_normal(topology, position, 0, Vector3(0.3, 0.7, 0.0));
    }
};

TEST(SurfaceNeighbours, AVertexHasTheMeanNormalAndAThirdOfTheAreas) {
    Roof roof(BodyKind::tissue, 20.0);
    const Corners corners = corners_of(roof.topology.triangles, roof.position, 0);
    EXPECT_LT((area_normal(corners) - roof.face).norm(), 1e-15) << "twice an area of 1/2";
    EXPECT_LT((roof.surface.vertex_normal(roof.topology, roof.position, 0) - Vector3::UnitZ()).norm(), 1e-15);
    EXPECT_LT((roof.surface.vertex_normal(roof.topology, roof.position, 2) - roof.face).norm(), 1e-15);
    roof.surface.measure(roof.topology, roof.position);
    EXPECT_NEAR(roof.surface.area(0), 1.0 / 3.0, 1e-15);
    EXPECT_NEAR(roof.surface.area(2), 1.0 / 6.0, 1e-15);
    EXPECT_EQ(roof.surface.triangles_at(1).size(), 2U);
}

TEST(SurfaceNeighbours, AToolsFacesStayFlatUpToACreaseOfSixtyDegrees) {
    for (const BodyKind kind : {BodyKind::instrument, BodyKind::rigid}) {
        const Roof gentle(kind, 29.0);
        EXPECT_LT((gentle.on_ridge() - Vector3::UnitZ()).norm(), 1e-15);
        const Roof creased(kind, 31.0);
        EXPECT_LT((creased.on_ridge() - creased.face).norm(), 1e-15);
    }
}

TEST(SurfaceNeighbours, TissueBendsWhereTheBlendStaysWithinSeventyFiveDegrees) {
    for (const double lean : {31.0, 60.0, 74.0}) {
        EXPECT_LT((Roof(BodyKind::tissue, lean).on_ridge() - Vector3::UnitZ()).norm(), 1e-14) << lean;
    }
    const Roof sharp(BodyKind::tissue, 76.0);
    EXPECT_LT((sharp.on_ridge() - sharp.face).norm(), 1e-15);
}

}  // namespace
}  // namespace trocar
