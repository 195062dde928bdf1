// Small meshes whose counts follow by hand, and the tables "Counts" of meshes/README.md beside the data.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <regex>
#include <sstream>

#include "geometry/exact.hpp"
#include "geometry/mesh_report.hpp"
#include "support/data.hpp"
#include "support/meshes.hpp"
#include "support/random_vectors.hpp"
#include "support/shapes.hpp"

namespace trocar {
namespace {

using test::Faces;

Mesh make_mesh(const std::vector<Vector3>& points, const Faces& triangles) {
    Mesh mesh;
    mesh.vertices = test::matrix_of(points);
    mesh.triangles = test::matrix_of(triangles);
    mesh.vertices_stored = static_cast<Index>(points.size());
    return mesh;
}

Mesh make_mesh(const test::Shape& shape) { return make_mesh(shape.vertices, shape.triangles); }

Mesh cube(const Vector3& low, double edge) { return make_mesh(test::box_of(low, Vector3::Constant(edge))); }

Corners corners(const Mesh& mesh, Index t) { return corners_of(mesh.triangles, mesh.vertices, t); }

Mesh two_cubes(const Vector3& second_low) {
    return make_mesh(test::box_of(Vector3::Zero(), Vector3::Ones()).add(test::box_of(second_low, Vector3::Ones())));
}

TEST(MeshReport, CubeIsOneWatertightShellOfItsVolume) {
    const MeshReport report = report_mesh(cube({1, 2, 3}, 2.0));
    EXPECT_EQ(report.vertices, 8);
    EXPECT_EQ(report.triangles, 12);
    EXPECT_EQ(report.shells, 1);
    EXPECT_TRUE(report.watertight);
    EXPECT_EQ(report.boundary_edges + report.holes + report.non_manifold_edges + report.flipped_edges, 0);
    EXPECT_EQ(report.bow_vertices + report.degenerate_triangles + report.duplicate_triangles, 0);
    EXPECT_EQ(report.self_intersections, 0);
    EXPECT_DOUBLE_EQ(report.signed_volume, 8.0);
    EXPECT_DOUBLE_EQ(report.median_longest_edge, 2.0 * std::numbers::sqrt2);
    EXPECT_EQ(report.box.min, Vector3(1, 2, 3));
    EXPECT_EQ(report.box.max, Vector3(3, 4, 5));
}

TEST(MeshReport, TetrahedronTurnedInsideOutHasNegativeVolume) {
    const std::vector<Vector3> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    EXPECT_DOUBLE_EQ(report_mesh(make_mesh(points, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}})).signed_volume,
                     1.0 / 6.0);
    const MeshReport turned = report_mesh(make_mesh(points, {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {0, 2, 3}}));
    EXPECT_DOUBLE_EQ(turned.signed_volume, -1.0 / 6.0);
    EXPECT_TRUE(turned.watertight);
}

TEST(MeshReport, OneTurnedTriangleFlipsItsThreeEdges) {
    Mesh mesh = cube(Vector3::Zero(), 1.0);
    std::swap(mesh.triangles(1, 4), mesh.triangles(2, 4));
    const MeshReport report = report_mesh(mesh);
    EXPECT_EQ(report.flipped_edges, 3);
    EXPECT_FALSE(report.watertight);
}

TEST(MeshReport, MoebiusStripHasOneEdgeLoopAndOneFlippedEdge) {
    constexpr int n = 20;
    std::vector<Vector3> points;
    Faces triangles;
    for (int i = 0; i < n; ++i) {
        const double turn = 2.0 * std::numbers::pi * i / n;
        for (const double side : {-0.3, 0.3}) {
            const double radius = 1.0 + side * std::cos(turn / 2);
            points.emplace_back(radius * std::cos(turn), radius * std::sin(turn), side * std::sin(turn / 2));
        }
        const bool last = i == n - 1;  // the strip closes with a half turn: sides change places
        const Index a = 2 * i;
        const Index c = last ? 1 : a + 2;
        const Index d = last ? 0 : a + 3;
        triangles.push_back({a, c, a + 1});
        triangles.push_back({a + 1, c, d});
    }
    const MeshReport report = report_mesh(make_mesh(points, triangles));
    EXPECT_EQ(report.shells, 1);
    EXPECT_EQ(report.boundary_edges, 2 * n);
    EXPECT_EQ(report.holes, 1);
    EXPECT_EQ(report.flipped_edges, 1);
    EXPECT_EQ(report.non_manifold_edges, 0);
    EXPECT_EQ(report.bow_vertices, 0);
}

TEST(MeshReport, CubesThatShareACornerAreTwoShellsAndABow) {
    const MeshReport report = report_mesh(two_cubes(Vector3(1, 1, 1)));
    EXPECT_EQ(report.vertices_stored, 16);
    EXPECT_EQ(report.vertices, 15);
    EXPECT_EQ(report.shells, 2);
    EXPECT_EQ(report.bow_vertices, 1);
    EXPECT_TRUE(report.watertight);
    EXPECT_EQ(report.self_intersections, 0);
    EXPECT_DOUBLE_EQ(report.signed_volume, 2.0);
}

TEST(MeshReport, CubesThatShareAnEdgeHaveOneNonManifoldEdge) {
    const MeshReport report = report_mesh(two_cubes(Vector3(1, 1, 0)));
    EXPECT_EQ(report.vertices, 14);
    EXPECT_EQ(report.shells, 1);
    EXPECT_EQ(report.non_manifold_edges, 1);
    EXPECT_EQ(report.bow_vertices, 0);  // the edge joins both fans at its ends
    EXPECT_FALSE(report.watertight);
}

TEST(MeshReport, TwoTrianglesOnOneEdgeOfABookAreCountedByTriangles) {
    // Four pages on one spine: one non-manifold edge, eight boundary edges that meet at the spine's ends: one loop.
    const MeshReport report =
        report_mesh(make_mesh({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}},
                              {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 1, 5}}));
    EXPECT_EQ(report.non_manifold_edges, 1);
    EXPECT_EQ(report.boundary_edges, 8);
    EXPECT_EQ(report.holes, 1);
    EXPECT_EQ(report.flipped_edges, 0);
}

TEST(MeshReport, RepeatedThinAndCollapsedTrianglesAreDistinguished) {
    const MeshReport report =
        report_mesh(make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0.9e-7, 0}, {0.5, -1.1e-7, 0}, {1, 0, 0}},
                              {{0, 1, 2}, {2, 0, 1}, {2, 1, 0}, {0, 1, 3}, {0, 4, 1}, {1, 5, 2}, {0, 0, 0}}));
    EXPECT_EQ(report.triangles, 7);
    EXPECT_EQ(report.collapsed, 2);
    EXPECT_EQ(report.duplicate_triangles, 2);
    EXPECT_EQ(report.degenerate_triangles, 1);
    EXPECT_EQ(report.vertices, 5);
}

/// Two triangles as a mesh; they share no vertex.
std::int64_t self_intersections(const std::array<Vector3, 3>& a, const std::array<Vector3, 3>& b) {
    return report_mesh(make_mesh({a[0], a[1], a[2], b[0], b[1], b[2]}, {{0, 1, 2}, {3, 4, 5}})).self_intersections;
}

TEST(MeshReport, CoincidentLayersAreCountedApart) {
    for (const double height : {0.0, 0.25}) {
        const Mesh mesh = make_mesh(test::sheet(4.0, 4).add(test::sheet(4.0, 4).move({0.375, 0.375, height})));
        // Triangles of one sheet meet in vertices that they share, or not at all.
        const auto layer = static_cast<Index>(mesh.triangles.cols() / 2);
        std::int64_t expected = 0;
        for (Index s = 0; s < layer; ++s) {
            for (Index t = layer; t < 2 * layer; ++t) {
                expected += oracle_intersect(corners(mesh, s), corners(mesh, t)) ? 1 : 0;
            }
        }
        EXPECT_EQ(expected > 100, height == 0.0);
        const MeshReport report = report_mesh(mesh);
        EXPECT_EQ(report.coplanar_overlaps, expected);
        EXPECT_EQ(report.self_intersections, 0);
    }
}

TEST(MeshReport, SelfIntersectionsTakeTouchingButNotOverlapInOnePlane) {
    const std::array<Vector3, 3> face{Vector3(0, 0, 0), Vector3(4, 0, 0), Vector3(0, 4, 0)};
    EXPECT_EQ(self_intersections(face, {Vector3(1, 1, -1), Vector3(1, 1, 1), Vector3(2, 2, 1)}), 1);  // through
    EXPECT_EQ(self_intersections(face, {Vector3(1, 1, 0), Vector3(1, 1, 1), Vector3(2, 2, 1)}), 1);   // corner on face
    EXPECT_EQ(self_intersections(face, {Vector3(1, 1, 0), Vector3(2, 1, 0), Vector3(2, 2, 1)}), 1);   // edge on face
    EXPECT_EQ(self_intersections(face, {Vector3(2, 0, 0), Vector3(2, 0, 1), Vector3(2, -1, 1)}), 1);  // corner on edge
    EXPECT_EQ(self_intersections(face, {Vector3(1, 1, 0), Vector3(2, 1, 0), Vector3(1, 2, 0)}), 0);   // one plane
    EXPECT_EQ(self_intersections(face, {Vector3(2, 0, 1), Vector3(2, 0, -1), Vector3(2, -2, 0.5)}), 0);  // edges cross
    EXPECT_EQ(self_intersections(face, {Vector3(1, 1, 1), Vector3(1, 1, 2), Vector3(2, 2, 1)}), 0);      // apart
    EXPECT_EQ(self_intersections(face, {Vector3(1, 1, -1), Vector3(1, 1, 0), Vector3(1, 1, 1)}), 1);  // needle through
}

/// `count` triangles over few shared vertices in a unit cube: crossing, touching, sharing and repeated ones.
Mesh heap(Index count, Index vertex_count, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(0.0, 1.0);
    std::uniform_int_distribution<Index> number(0, vertex_count - 1);
    std::vector<Vector3> vertices;
    for (Index v = 0; v < vertex_count; ++v) vertices.push_back(test::random_vector(place, random));
    Faces triangles;
    while (static_cast<Index>(triangles.size()) < count) {
        const std::array<Index, 3> corners{number(random), number(random), number(random)};
        if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]) {
            triangles.push_back(corners);
        }
    }
    return make_mesh(vertices, triangles);
}

TEST(MeshReport, SelfIntersectionsOfAHeapAreThoseOfADoubleLoop) {
    for (const unsigned seed : {1U, 2U, 3U}) {
        const Mesh mesh = heap(300, 60, seed);
        // General position: no pair is coplanar and edges never meet, so that every meeting pair counts.
        std::int64_t expected = 0;
        for (Index s = 0; s < 300; ++s) {
            for (Index t = s + 1; t < 300; ++t) {
                bool shared = false;
                for (int i = 0; i < 9; ++i) shared = shared || mesh.triangles(i / 3, s) == mesh.triangles(i % 3, t);
                expected += !shared && oracle_intersect(corners(mesh, s), corners(mesh, t)) ? 1 : 0;
            }
        }
        EXPECT_GT(expected, 100);
        const MeshReport report = report_mesh(mesh);
        EXPECT_EQ(report.self_intersections, expected);
        EXPECT_TRUE(report.self_intersections_complete);
        const MeshReport cut = report_mesh(mesh, 500);
        EXPECT_FALSE(cut.self_intersections_complete);
        EXPECT_LE(cut.self_intersections, 500);
        EXPECT_LT(cut.self_intersections, expected);
    }
}

TEST(MeshReport, FansAndHeapsOfDuplicatesNeedNoTests) {
    // All boxes of a fan hold the centre, all duplicates lie on each other: 4.5e8 pairs each, and not one to test.
    constexpr Index count = 30000;
    std::vector<Vector3> vertices{Vector3::Zero()};
    Faces fan;
    for (Index i = 0; i < count; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / count;
        vertices.emplace_back(std::cos(angle), std::sin(angle), 0.1 * std::sin(50.0 * angle));
        fan.push_back({0, i + 1, (i + 1) % count + 1});
    }
    const MeshReport of_fan = report_mesh(make_mesh(vertices, fan), 0);
    EXPECT_TRUE(of_fan.self_intersections_complete);
    EXPECT_EQ(of_fan.self_intersections, 0);
    EXPECT_EQ(of_fan.boundary_edges, count);
    const Faces same(count, {0, 1, 2});
    const MeshReport of_duplicates = report_mesh(make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, same), 0);
    EXPECT_TRUE(of_duplicates.self_intersections_complete);
    EXPECT_EQ(of_duplicates.duplicate_triangles, count - 1);
}

TEST(MeshReport, MeshWithoutTrianglesIsEmptyAndNotAnError) {
    const MeshReport report = report_mesh(make_mesh({{1, 2, 3}}, {}));
    EXPECT_EQ(report.vertices_stored, 1);
    EXPECT_EQ(report.vertices + report.triangles + report.shells, 0);
    EXPECT_EQ(report.signed_volume, 0.0);
    EXPECT_TRUE(std::isnan(report.median_longest_edge));
    EXPECT_EQ(report.unit.name, "unknown");
}

TEST(MeshReport, UnitIsGuessedFromTheBoxUnlessStated) {
    Mesh mesh = cube(Vector3::Zero(), 0.3);
    EXPECT_EQ(report_mesh(mesh).unit.name, "m");
    EXPECT_TRUE(report_mesh(mesh).unit.guessed);
    mesh.vertices *= 1000.0;
    EXPECT_EQ(report_mesh(mesh).unit.name, "mm");
    mesh.stated_unit = "in";
    EXPECT_EQ(report_mesh(mesh).unit.name, "in");
    EXPECT_FALSE(report_mesh(mesh).unit.guessed);
}

using Cells = std::vector<std::string>;

/// Rows of the tables of a Markdown file, by their first cell, in which code stands, and their number of cells.
std::map<std::string, std::map<std::size_t, Cells>> table_rows(const std::filesystem::path& file) {
    std::map<std::string, std::map<std::size_t, Cells>> rows;
    std::ifstream stream(file);
    for (std::string line; std::getline(stream, line);) {
        if (!line.starts_with("| `")) continue;
        std::istringstream text(line.substr(2));
        Cells cells;
        for (std::string cell; std::getline(text, cell, '|') && cell != " ";) cells.push_back(cell);
        const std::string name = cells[0].substr(1, cells[0].find('`', 1) - 1);
        rows[name][cells.size()] = cells;
    }
    return rows;
}

/// A blank between two digits separates thousands.
std::vector<double> numbers_in(const std::string& cell) {
    const std::string text = std::regex_replace(cell, std::regex("([0-9]) (?=[0-9])"), "$1");
    const std::regex number("-?[0-9.]+(e-[0-9]+)?");
    std::vector<double> numbers;
    for (std::sregex_iterator match(text.begin(), text.end(), number); match != std::sregex_iterator(); ++match) {
        numbers.push_back(std::stod(match->str()));
    }
    return numbers;
}

// Box and volume stand there with five digits, the box after rounding to 1e-6.
TEST(MeshReport, GivesTheNumbersOfTheDataOnEveryFile) {
    TROCAR_DATA_OR_SKIP(readme, "meshes/README.md");
    const auto rows = table_rows(readme);
    EXPECT_EQ(rows.size(), 17U);
    for (const auto& [file, tables] : rows) {
        SCOPED_TRACE(file);
        const MeshReport r = report_mesh(read_mesh(readme.parent_path() / file));
        const Cells& counts = tables.at(14);
        EXPECT_EQ(numbers_in(counts[3]), (std::vector<double>{1.0 * r.vertices_stored, 1.0 * r.vertices}));
        EXPECT_EQ(r.watertight, counts[5] == " yes ");
        EXPECT_EQ(numbers_in(counts[7]), (std::vector<double>{1.0 * r.boundary_edges, 1.0 * r.holes}));
        const std::map<std::size_t, std::int64_t> others{{4, r.triangles},
                                                         {6, r.shells},
                                                         {8, r.non_manifold_edges},
                                                         {9, r.flipped_edges},
                                                         {10, r.bow_vertices},
                                                         {11, r.degenerate_triangles},
                                                         {12, r.duplicate_triangles},
                                                         {13, r.self_intersections}};
        for (const auto& [column, count] : others) {
            EXPECT_EQ(numbers_in(counts[column]), std::vector<double>{static_cast<double>(count)}) << column;
        }
        const Cells& sizes = tables.at(6);
        for (int axis = 0; axis < 3; ++axis) {
            const double low = numbers_in(sizes[1]).at(static_cast<std::size_t>(axis));
            const double high = numbers_in(sizes[2]).at(static_cast<std::size_t>(axis));
            const double slack = 1e-6 + 5e-5 * std::max(std::abs(low), std::abs(high));
            EXPECT_NEAR(r.box.min[axis], low, slack);
            EXPECT_NEAR(r.box.max[axis], high, slack);
        }
        const double edge = numbers_in(sizes[3]).at(0);
        const double volume = numbers_in(sizes[4]).at(0);
        EXPECT_NEAR(r.median_longest_edge, edge, 0.005 * edge);
        EXPECT_NEAR(r.signed_volume, volume, 5e-5 * std::abs(volume));
        EXPECT_TRUE(tables.at(3)[2].starts_with(" " + r.unit.name + " ")) << tables.at(3)[2];
    }
}

}  // namespace
}  // namespace trocar
