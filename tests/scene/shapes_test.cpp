#include "scene/shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "support/surfaces.hpp"

namespace trocar {
namespace {

using test::boundary_edges;
using test::is_closed;
using test::signed_volume;

/// Values of moderate size for every parameter that the table declares, edge as given.
ShapeValues sample_values(const Shape& shape, double edge) {
    const std::map<std::string, std::vector<double>> values{
        {"size", {3.0, 2.0, 1.0}}, {"radii", {3.0, 2.0, 1.0}}, {"radius", {1.0}},
        {"wall", {0.25}},          {"head_radius", {1.5}},     {"length", {8.0}},
        {"tip_length", {2.0}},     {"bend_radius", {2.0}},     {"bend_angle", {120.0}},
        {"angle", {150.0}},        {"lumpiness", {1.0}},       {"corners", {0, 0, 0, 1, 0, 0, 0, 1, 0}},
        {"edge", {edge}}};
    ShapeValues result;
    for (const ShapeParameter& parameter : shape.parameters) {
        if (parameter.type == ShapeParameter::Type::choice) {
            result.words[parameter.name] = parameter.choices.front();
        } else {
            result.numbers[parameter.name] = values.at(parameter.name);
        }
    }
    return result;
}

class EveryShape : public testing::TestWithParam<std::string> {
protected:
    const Shape& shape = *find_shape(GetParam());
};

TEST_P(EveryShape, IsAManifoldOfFiniteVerticesAtEveryResolution) {
    for (const double edge : {20.0, 1.0, 0.3, 0.1}) {
        const ShapeValues values = sample_values(shape, edge);
        const Surface surface = shape.make(values);
        ASSERT_GT(surface.triangles.cols(), 0);
        EXPECT_TRUE(surface.vertices.allFinite());
        EXPECT_EQ(is_closed(surface.triangles), shape.closed) << edge;
        EXPECT_TRUE(test::every_edge_at_most_twice_and_opposite(surface.triangles)) << edge;
        EXPECT_EQ(test::unused_vertices(surface), 0);
        EXPECT_GT(test::smallest_height(surface), 0.0) << edge;
        if (shape.closed) {
            EXPECT_GT(signed_volume(surface), 0.0) << edge;
        }
        EXPECT_LE(static_cast<double>(surface.triangles.cols()), shape.triangle_estimate(values)) << edge;
    }
}

TEST_P(EveryShape, EdgesAreAboutAsLongAsAsked) {
    const double edge = 0.1;
    const Surface surface = shape.make(sample_values(shape, edge));
    if (surface.triangles.cols() == 1) GTEST_SKIP() << "one triangle has the edges of its corners";
    const double median = test::median_edge(surface);
    EXPECT_GT(median, 0.5 * edge);
    EXPECT_LT(median, 1.5 * edge);
}

std::vector<std::string> names() {
    std::vector<std::string> list;
    for (const Shape& shape : shapes()) list.push_back(shape.name);
    return list;
}

INSTANTIATE_TEST_SUITE_P(Table, EveryShape, testing::ValuesIn(names()),
                         [](const auto& tested) { return tested.param; });

double volume_of(const std::string& name, double edge) {
    const Shape& shape = *find_shape(name);
    return signed_volume(shape.make(sample_values(shape, edge)));
}

TEST(Shapes, VolumesConvergeToTheClosedForms) {
    constexpr double pi = std::numbers::pi;
    const double edge = 0.05;
    EXPECT_NEAR(volume_of("box", edge), 6.0, 1e-10);
    EXPECT_NEAR(volume_of("sphere", edge), 4.0 / 3.0 * pi, 0.005 * 4.0 / 3.0 * pi);
    EXPECT_NEAR(volume_of("ellipsoid", edge), 8.0 * pi, 0.005 * 8.0 * pi);
    // Hemisphere and cylinder; cone and cylinder.
    EXPECT_NEAR(volume_of("shaft", edge), 2.0 / 3.0 * pi + 7.0 * pi, 0.01 * 8.0 * pi);
    EXPECT_NEAR(volume_of("needle", edge), 2.0 / 3.0 * pi + 6.0 * pi, 0.01 * 7.0 * pi);
    EXPECT_NEAR(volume_of("tube", edge), (1.0 - 0.75 * 0.75) * pi * 8.0, 0.01 * 11.0);
    // Half of a capsule of length 8.
    EXPECT_NEAR(volume_of("jaw", edge), 0.5 * (4.0 / 3.0 * pi + 6.0 * pi), 0.01 * 12.0);
    // Rod of length 8 and 120 degrees at radius 2 (Pappus), with two hemispheres.
    EXPECT_NEAR(volume_of("hook", edge), pi * (8.0 + 2.0 * pi * 2.0 / 3.0) + 4.0 / 3.0 * pi, 0.01 * 42.0);
}

TEST(Shapes, SphereVerticesLieOnTheSphere) {
    const Shape& shape = *find_shape("sphere");
    const Surface surface = shape.make(sample_values(shape, 0.2));
    EXPECT_LT((surface.vertices.colwise().norm().array() - 1.0).abs().maxCoeff(), 1e-15);
}

TEST(Shapes, HookVerticesAreOneRadiusFromItsAxis) {
    // Straight down from (0, 0, 8) to the origin, then 120 degrees of a circle of radius 2 about (2, 0, 0); both ends
    // are half balls.
    const Shape& shape = *find_shape("hook");
    const Surface surface = shape.make(sample_values(shape, 0.4));
    for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) {
        const Vector3 p = surface.vertices.col(v);
        const Vector3 on_rod(0.0, 0.0, std::clamp(p.z(), 0.0, 8.0));
        const double turn = std::clamp(std::atan2(-p.z(), 2.0 - p.x()), 0.0, 2.0 / 3.0 * std::numbers::pi);
        const Vector3 on_bend(2.0 - 2.0 * std::cos(turn), 0.0, -2.0 * std::sin(turn));
        EXPECT_NEAR(std::min((p - on_rod).norm(), (p - on_bend).norm()), 1.0, 1e-12) << p.transpose();
    }
}

TEST(Shapes, RingsOfARodAlternateSoThatItsTrianglesAreNearlyEquilateral) {
    // Without that they would be right-angled, their longest side 1.5 times the shortest.
    const Shape& shape = *find_shape("shaft");
    const Surface surface = shape.make(sample_values(shape, 0.1));
    int on_rod = 0;
    for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
        std::array<Vector3, 3> corner;
        for (std::size_t i = 0; i < 3; ++i) {
            corner[i] = surface.vertices.col(surface.triangles(static_cast<Eigen::Index>(i), t));
        }
        if (!std::ranges::all_of(corner, [](const Vector3& p) { return p.head<2>().norm() > 1.0 - 1e-9; })) continue;
        ++on_rod;
        const auto [shortest, longest] = std::minmax(
            {(corner[1] - corner[0]).norm(), (corner[2] - corner[1]).norm(), (corner[0] - corner[2]).norm()});
        EXPECT_LT(longest, 1.05 * shortest) << corner[0].transpose();
    }
    EXPECT_GT(on_rod, 9000) << "63 round by 81 along, twice";
}

TEST(Shapes, SheetRimIsStraightAndItsTrianglesNearlyEquilateral) {
    const Shape& shape = *find_shape("sheet");
    const Surface surface = shape.make(sample_values(shape, 0.1));
    for (const auto& [a, b] : boundary_edges(surface.triangles)) {
        const Vector3 p = surface.vertices.col(a);
        const Vector3 q = surface.vertices.col(b);
        const bool on_x_side = std::fabs(p.x()) == 1.5 && p.x() == q.x();
        const bool on_y_side = std::fabs(p.y()) == 1.0 && p.y() == q.y();
        EXPECT_TRUE(on_x_side || on_y_side) << p.transpose() << " to " << q.transpose();
    }
    EXPECT_NEAR(test::total_area(surface), 6.0, 1e-12);
    EXPECT_GT(surface.triangles.cols(), 2 * 30 * 23);
    // Normal +z.
    const auto t = surface.triangles.col(0);
    const Vector3 a = surface.vertices.col(t[0]);
    EXPECT_GT((surface.vertices.col(t[1]) - a).cross(surface.vertices.col(t[2]) - a).z(), 0.0);
}

TEST(Shapes, OrganFillsItsBoxAndIsNotConvex) {
    const Shape& shape = *find_shape("organ");
    const Surface surface = shape.make(sample_values(shape, 0.1));
    const Vector3 low = surface.vertices.rowwise().minCoeff();
    const Vector3 high = surface.vertices.rowwise().maxCoeff();
    EXPECT_LT((high - Vector3(1.5, 1.0, 0.5)).norm(), 1e-15);
    EXPECT_LT((low + Vector3(1.5, 1.0, 0.5)).norm(), 1e-15);
    EXPECT_TRUE(test::has_concave_edge(surface));
    const Shape& round = *find_shape("sphere");
    EXPECT_FALSE(test::has_concave_edge(round.make(sample_values(round, 0.1))));
}

}  // namespace
}  // namespace trocar
