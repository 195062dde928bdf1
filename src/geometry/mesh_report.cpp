#include "geometry/mesh_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "geometry/disjoint_sets.hpp"
#include "geometry/exact.hpp"
#include "geometry/pairs_apart.hpp"
#include "geometry/triangle_sides.hpp"

namespace trocar {
namespace {

Triangles without_collapsed(const Triangles& triangles) {
    Triangles kept(3, triangles.cols());
    Eigen::Index count = 0;
    for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
        const auto c = triangles.col(t);
        if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) kept.col(count++) = c;
    }
    kept.conservativeResize(Eigen::NoChange, count);
    return kept;
}

/// Number, among all corners of the mesh, of the corner of triangle t at vertex `v`.
Index corner_number(const Triangles& triangles, Index t, Index v) {
    for (int corner = 0; corner < 3; ++corner) {
        if (triangles(corner, t) == v) return 3 * t + corner;
    }
    return -1;
}

void count_edges(const Triangles& triangles, Index vertex_count, MeshReport& report) {
    DisjointSets shells(static_cast<Index>(triangles.cols()));
    DisjointSets fans(static_cast<Index>(triangles.size()));  // corners of triangles around their vertices
    DisjointSets loops(vertex_count);
    std::vector<Index> boundary_vertices;
    for_each_edge(sorted_sides(triangles), [&](std::span<const TriangleSide> edge) {
        const TriangleSide& side = edge.front();
        for (const TriangleSide& other : edge.subspan(1)) {
            shells.merge(side.triangle, other.triangle);
            for (const Index v : {side.low, side.high}) {
                fans.merge(corner_number(triangles, side.triangle, v), corner_number(triangles, other.triangle, v));
            }
        }
        if (edge.size() == 1) {
            ++report.boundary_edges;
            loops.merge(side.low, side.high);
            boundary_vertices.push_back(side.low);
        } else if (edge.size() > 2) {
            ++report.non_manifold_edges;
        } else if (side.forward == edge[1].forward) {
            ++report.flipped_edges;
        }
    });
    for (Index t = 0; t < triangles.cols(); ++t) report.shells += shells.find(t) == t ? 1 : 0;
    for (Index& v : boundary_vertices) v = loops.find(v);
    std::sort(boundary_vertices.begin(), boundary_vertices.end());
    report.holes =
        static_cast<Index>(std::unique(boundary_vertices.begin(), boundary_vertices.end()) - boundary_vertices.begin());
    std::vector<std::uint8_t> fan_count(static_cast<std::size_t>(vertex_count), 0);
    for (Index corner = 0; corner < triangles.size(); ++corner) {
        if (fans.find(corner) != corner) continue;
        std::uint8_t& count = fan_count[static_cast<std::size_t>(triangles.data()[corner])];
        if (count < 2) ++count;
        if (count == 2) {
            ++report.bow_vertices;
            count = 3;
        }
    }
    report.watertight = report.boundary_edges == 0 && report.non_manifold_edges == 0 && report.flipped_edges == 0;
}

void measure_triangles(const Matrix3X& vertices, const Triangles& triangles, MeshReport& report) {
    std::vector<double> longest;
    longest.reserve(static_cast<std::size_t>(triangles.cols()));
    for (Index t = 0; t < triangles.cols(); ++t) {
        const Corners corners = corners_of(triangles, vertices, t);
        const auto& [a, b, c] = corners;
        const double edge = std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
        longest.push_back(edge);
        if (area_normal(corners).norm() < 1e-7 * edge * edge) ++report.degenerate_triangles;
        report.signed_volume += a.dot(b.cross(c)) / 6.0;
    }
    report.median_longest_edge = std::numeric_limits<double>::quiet_NaN();
    if (!longest.empty()) {
        const auto middle = longest.begin() + static_cast<std::ptrdiff_t>(longest.size() / 2);
        std::nth_element(longest.begin(), middle, longest.end());
        report.median_longest_edge = *middle;
    }
}

void count_duplicates(const Triangles& triangles, MeshReport& report) {
    std::vector<std::array<Index, 3>> sorted;
    sorted.reserve(static_cast<std::size_t>(triangles.cols()));
    for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
        std::array<Index, 3> corners{triangles(0, t), triangles(1, t), triangles(2, t)};
        std::sort(corners.begin(), corners.end());
        sorted.push_back(corners);
    }
    std::sort(sorted.begin(), sorted.end());
    const auto distinct = std::unique(sorted.begin(), sorted.end());
    report.duplicate_triangles = static_cast<Index>(sorted.end() - distinct);
}

/// How many corners of `other` lie in the plane of `face`; all of them when `face` has no area.
int corners_in_plane(const Corners& face, const Corners& other) {
    return static_cast<int>(std::count_if(other.begin(), other.end(), [&face](const Vector3& corner) {
        return orientation_sign(face[0], face[1], face[2], corner) == 0;
    }));
}

void count_self_intersections(const Matrix3X& vertices, const Triangles& triangles, std::int64_t most_tests,
                              MeshReport& report) {
    const auto corners = [&](Index t) { return corners_of(triangles, vertices, t); };
    const auto count = [&](Index s, Index t) {
        const Corners first = corners(std::min(s, t));
        const Corners second = corners(std::max(s, t));
        if (!triangles_intersect(first, second)) return;
        const bool off_planes = corners_in_plane(first, second) == 0 && corners_in_plane(second, first) == 0;
        if (!(off_planes && classify_pair(first, second) == PairClass::touch_edge)) ++report.self_intersections;
    };
    const PairsApart pairs(vertices, triangles);
    std::int64_t tests_left = most_tests;
    pairs.for_each([&](Index s, Index t) {
        if (tests_left-- == 0) {
            report.self_intersections_complete = false;
            return false;
        }
        count(s, t);
        return true;
    });
    // This search skips coplanar pairs; a flat face cut into many would cost a test per pair.
    tests_left = most_tests;
    const auto count_in_one_plane = [&](Index s, Index t) {
        if (tests_left-- == 0) {
            report.coplanar_overlaps_complete = false;
            return false;
        }
        const Corners first = corners(std::min(s, t));
        const Corners second = corners(std::max(s, t));
        if (corners_in_plane(first, second) == 3 && corners_in_plane(second, first) == 3 &&
            classify_pair(first, second) != PairClass::degenerate && triangles_intersect(first, second)) {
            ++report.coplanar_overlaps;
        }
        return true;
    };
    pairs.for_each(count_in_one_plane, true);
}

}  // namespace

std::int64_t self_intersections(const Matrix3X& given_vertices, const Triangles& given_triangles) {
    Matrix3X vertices = given_vertices;
    Triangles triangles = given_triangles;
    weld(vertices, triangles);
    triangles = without_collapsed(triangles);
    MeshReport report;
    count_self_intersections(vertices, triangles, std::numeric_limits<std::int64_t>::max(), report);
    return report.self_intersections + report.coplanar_overlaps;
}

Index boundary_edges(const Matrix3X& given_vertices, const Triangles& given_triangles) {
    Matrix3X vertices = given_vertices;
    Triangles triangles = given_triangles;
    weld(vertices, triangles);
    MeshReport report;
    count_edges(without_collapsed(triangles), static_cast<Index>(vertices.cols()), report);
    return report.boundary_edges;
}

LengthUnit length_unit(const Mesh& mesh, const Box& box) {
    if (!mesh.stated_unit.empty()) return {.name = mesh.stated_unit, .guessed = false};
    const double side = (box.max - box.min).maxCoeff();
    if (!(side > 0.0)) return {.name = "unknown", .guessed = true};
    if (side <= 2.0) return {.name = "m", .guessed = true};
    return {.name = side <= 25.0 ? "cm" : "mm", .guessed = true};
}

MeshReport report_mesh(const Mesh& mesh) {
    return report_mesh(mesh, most_self_intersection_tests(mesh.triangles.cols()));
}

MeshReport report_mesh(const Mesh& mesh, std::int64_t most_tests) {
    MeshReport report;
    report.vertices_stored = mesh.vertices_stored;
    report.triangles = static_cast<Index>(mesh.triangles.cols());
    Matrix3X vertices = mesh.vertices;
    Triangles triangles = mesh.triangles;
    weld(vertices, triangles);
    const auto vertex_count = static_cast<Index>(vertices.cols());
    std::vector<bool> used(static_cast<std::size_t>(vertex_count), false);
    for (Eigen::Index k = 0; k < triangles.size(); ++k) {
        const Index v = triangles.data()[k];
        if (used[static_cast<std::size_t>(v)]) continue;
        used[static_cast<std::size_t>(v)] = true;
        ++report.vertices;
        report.box.add(vertices.col(v));
    }
    report.unit = length_unit(mesh, report.box);
    triangles = without_collapsed(triangles);
    report.collapsed = report.triangles - static_cast<Index>(triangles.cols());

    count_edges(triangles, vertex_count, report);
    measure_triangles(vertices, triangles, report);
    count_duplicates(triangles, report);
    count_self_intersections(vertices, triangles, most_tests, report);
    return report;
}

}  // namespace trocar
