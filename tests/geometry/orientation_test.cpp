// Cubes and sheets whose defects are made by hand.
#include "geometry/orientation.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "geometry/mesh_file.hpp"
#include "support/data.hpp"
#include "support/meshes.hpp"

namespace trocar {
namespace {

using test::cube_faces;
using test::Faces;

struct Surface {
    Matrix3X vertices = Matrix3X(3, 0);
    Faces triangles;

    /// Adds a cube, its triangles turned round where asked.
    Surface& cube(const Vector3& low, double edge, bool turned = false) {
        const auto first = static_cast<Index>(vertices.cols());
        vertices.conservativeResize(Eigen::NoChange, first + 8);
        vertices.rightCols<8>() = test::matrix_of(test::cube_points(low, Vector3::Constant(edge)));
        for (auto t : cube_faces) {
            for (Index& v : t) v += first;
            if (turned) std::swap(t[1], t[2]);
            triangles.push_back(t);
        }
        return *this;
    }
    Surface& turn(std::size_t t) {
        std::swap(triangles[t][1], triangles[t][2]);
        return *this;
    }
    [[nodiscard]] Triangles matrix() const { return test::matrix_of(triangles); }
    [[nodiscard]] OrientationReport report() const { return orientation_of(vertices, matrix()); }
};

TEST(MeshOrientation, OneTurnedTriangleIsNamedWithItsThreeEdges) {
    for (std::size_t t = 0; t < cube_faces.size(); ++t) {
        const OrientationReport report = Surface().cube({1, 2, 3}, 2.0).turn(t).report();
        EXPECT_EQ(report.disagreeing_edges, 3);
        EXPECT_EQ(report.to_turn, std::vector<Index>{static_cast<Index>(t)});
        EXPECT_TRUE(report.first_disagreeing[0] == static_cast<Index>(t) ||
                    report.first_disagreeing[1] == static_cast<Index>(t));
        EXPECT_TRUE(report.inside_out.empty());
    }
}

TEST(MeshOrientation, EveryShellThatIsInsideOutIsNamedWithItsVolume) {
    const OrientationReport report =
        Surface().cube({0, 0, 0}, 1.0).cube({5, 0, 0}, 2.0, true).cube({9, 0, 0}, 0.5, true).report();
    EXPECT_EQ(report.disagreeing_edges, 0);
    ASSERT_EQ(report.inside_out.size(), 2U);
    EXPECT_DOUBLE_EQ(report.inside_out[0].volume, -8.0);
    EXPECT_EQ(report.inside_out[0].triangles.size(), 12U);
    EXPECT_EQ(report.inside_out[0].triangles.front(), 12);
    EXPECT_DOUBLE_EQ(report.inside_out[1].volume, -0.125);
}

TEST(MeshOrientation, ASheetOnItsOwnBackEnclosesNothing) {
    Surface surface;
    surface.cube({0.1, 0.2, 0.3}, 1.0).cube({0.1, 0.2, 0.3}, 1.0, true);
    const OrientationReport report = surface.report();
    EXPECT_EQ(report.disagreeing_edges, 0);
    ASSERT_EQ(report.inside_out.size(), 1U);
    EXPECT_EQ(report.inside_out[0].volume, 0.0);
}

TEST(MeshOrientation, CubesGluedAtFacesAndEdgesAgree) {
    for (const Vector3& second : {Vector3(1, 0, 0), Vector3(1, 1, 0), Vector3(1, 1, 1)}) {
        const OrientationReport report = Surface().cube({0, 0, 0}, 1.0).cube(second, 1.0).report();
        EXPECT_TRUE(report.closed);
        EXPECT_EQ(report.disagreeing_edges, 0);
        EXPECT_TRUE(report.to_turn.empty());
        EXPECT_TRUE(report.inside_out.empty());
    }
}

TEST(MeshOrientation, AnOpenSheetHasAPathRoundAndNoVolume) {
    Surface open;
    open.cube({0, 0, 0}, 1.0).triangles.resize(10);
    EXPECT_FALSE(open.report().closed);
    EXPECT_EQ(open.report().disagreeing_edges, 0);
    open.turn(3);
    EXPECT_GT(open.report().disagreeing_edges, 0);
    EXPECT_EQ(open.report().to_turn, std::vector<Index>{3});
    EXPECT_TRUE(open.report().inside_out.empty());
}

TEST(MeshOrientation, AOneSidedSurfaceCannotBeMended) {
    // A band of five triangles with a half-turn (Möbius).
    Surface band;
    band.vertices.resize(3, 5);
    band.vertices << 0, 1, 2, 3, 4, 0, 1, 0, 1, 0, 0, 0, 1, 0, 0;
    band.triangles = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 0}, {4, 0, 1}};
    EXPECT_GT(band.report().disagreeing_edges, 0);
    EXPECT_TRUE(band.report().to_turn.empty());
}

TEST(Mended, HasEveryTriangleOnceAndTurnedRightAndLeavesWhatIsRight) {
    // Outer and inner wall of a hollow cube, all inside out, one triangle turned on top, one there twice; a cube
    // beside.
    Surface broken = Surface().cube({1, 1, 1}, 2.0, true).cube({0, 0, 0}, 4.0, true).cube({9, 0, 0}, 1.0, true).turn(7);
    broken.triangles.insert(broken.triangles.begin() + 3, broken.triangles[2]);
    const Triangles mend = mended(broken.vertices, broken.matrix());
    const Surface whole = Surface().cube({1, 1, 1}, 2.0, true).cube({0, 0, 0}, 4.0).cube({9, 0, 0}, 1.0);
    ASSERT_EQ(mend.cols(), 36);
    const Triangles right = whole.matrix();
    for (Index t = 0; t < 36; ++t) {
        // The same corners in the same order up to rotation.
        bool same = false;
        for (int turn = 0; turn < 3; ++turn) {
            same = same || (mend(0, t) == right(turn, t) && mend(1, t) == right((turn + 1) % 3, t) &&
                            mend(2, t) == right((turn + 2) % 3, t));
        }
        EXPECT_TRUE(same) << t;
    }
    EXPECT_EQ(mended(whole.vertices, right), right);
}

TEST(WindingNumber, IsOneInsideNoughtOutsideAndHalfOfACornerlessFace) {
    const Surface cube = Surface().cube({0, 0, 0}, 1.0);
    EXPECT_NEAR(winding_number(cube.vertices, cube.matrix(), {0.3, 0.4, 0.6}), 1.0, 1e-12);
    EXPECT_NEAR(winding_number(cube.vertices, cube.matrix(), {0.3, 0.4, 1.6}), 0.0, 1e-12);
    EXPECT_NEAR(winding_number(cube.vertices, cube.matrix(), {0.3, 0.4, 1.0}, {2, 3}), 0.5, 1e-12);
}

TEST(RepeatedTriangles, CountInTheSameOrderUpToRotationOnly) {
    Surface twice = Surface().cube({0, 0, 0}, 1.0);
    twice.triangles.push_back({3, 0, 2});  // 0, turned about its middle
    twice.triangles.push_back({0, 1, 3});  // 1, from behind
    EXPECT_EQ(repeated_triangles(twice.vertices, twice.matrix(), false), (std::vector<std::array<Index, 2>>{{12, 0}}));
    const Surface apart = Surface().cube({0, 0, 0}, 1.0).cube({0, 0, 0}, 1.0);
    EXPECT_TRUE(repeated_triangles(apart.vertices, apart.matrix(), false).empty());
    EXPECT_EQ(repeated_triangles(apart.vertices, apart.matrix(), true).size(), 12U);
}

TEST(MeshOrientationData, MeshesOfTheDataAreRightButForTheTwoWithTurnedTriangles) {
    TROCAR_DATA_OR_SKIP(folder, "meshes");
    // Edges by the README beside the meshes.
    for (const auto& [name, edges] : std::vector<std::pair<const char*, Index>>{{"liver_collision.stl", 0},
                                                                                {"gallbladder_visual.stl", 0},
                                                                                {"duodenum.stl", 0},
                                                                                {"r_femur.stl", 0},
                                                                                {"wound_deformable.ply", 0},
                                                                                {"maryland/instrument_shaft.stl", 0},
                                                                                {"hat_lumbar.stl", 37},
                                                                                {"vase.wrl", 108}}) {
        const Mesh mesh = read_mesh(folder / name);
        const OrientationReport report = orientation_of(mesh.vertices, mesh.triangles);
        if (edges == 0) {
            EXPECT_EQ(report.disagreeing_edges, 0) << name;
            EXPECT_TRUE(report.inside_out.empty()) << name;
        } else {
            EXPECT_GE(report.disagreeing_edges, edges) << name;
            const Triangles mend = mended(mesh.vertices, mesh.triangles);
            EXPECT_EQ(orientation_of(mesh.vertices, mend).disagreeing_edges, 0) << name;
        }
    }
}

}  // namespace
}  // namespace trocar
