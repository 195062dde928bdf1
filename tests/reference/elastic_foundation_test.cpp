// The elastic foundation of the reference solver by its energy at places set by hand: stiffness per area, samples and
// dampers of one surface, and of two that are tissue both.
#include "reference/elastic_foundation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "support/shapes.hpp"

namespace trocar {
namespace {

constexpr double side = 0.02;   // m, legs of the triangles
constexpr double depth = 4e-4;  // m
constexpr double area = 0.5 * side * side;

/// Two triangles, one 1 mm above the other and as large; the upper is tissue, the lower of the kind given.
Scene two_triangles(BodyKind lower, const ContactLaw& law) {
    const test::Shape triangle = test::triangle({0, 0, 0}, {side, 0, 0}, {0, side, 0});
    const test::World world = test::make_world(
        "two", {{.kind = BodyKind::tissue, .shape = test::Shape(triangle).move({0, 0, 0.001}), .closed = false},
                {.kind = lower, .shape = triangle, .closed = false}});
    Scene scene;
    scene.topology = world.topology;
    scene.first.position = world.frame.position;
    scene.materials.contact_laws.assign(scene.topology.body_pairs.size(), law);
    return scene;
}

/// J, with the upper triangle `depth` below the lower one.
double pressed_energy(const Scene& scene, double h) {
    ElasticFoundation foundation(scene, {{0, 1}}, 3, scene.first.position);
    Matrix3X x = scene.first.position;
    double gap = 0.0;
    EXPECT_EQ(foundation.energy(x, h, nullptr, gap), 0.0) << "apart";
    x.row(2).head(3).setConstant(-depth);
    return foundation.energy(x, h, nullptr, gap);
}

TEST(ElasticFoundation, OfTheDefaultLawIsThreeNewtonPerCubicMillimetreOverTheArea) {
    // METHODS §12: 3e6 N/m³; two tissues share it.
    const ContactLaw law{.k = std::nan(""), .mu = 0.0};
    const double expected = 0.5 * 3e6 * area * depth * depth;
    EXPECT_NEAR(pressed_energy(two_triangles(BodyKind::instrument, law), 0.0), expected, 1e-12 * expected);
    EXPECT_NEAR(pressed_energy(two_triangles(BodyKind::tissue, law), 0.0), expected, 1e-12 * expected);
}

TEST(ElasticFoundation, OfAGivenLawIsItsStiffnessForEveryVertexOnceForAPair) {
    // Three vertices that each stand for a third of the area: 3 k and 3 mu on the whole triangle, by the contact's
    // stiffness over the slave's area; with a step of h the damper adds mu / h to k.
    const double k = 400.0;
    const double mu = 0.8;
    const double h = 0.002;
    for (const BodyKind lower : {BodyKind::instrument, BodyKind::tissue}) {
        const Scene scene = two_triangles(lower, {.k = k, .mu = mu});
        const double elastic = 0.5 * 3.0 * k * depth * depth;
        EXPECT_NEAR(pressed_energy(scene, 0.0), elastic, 1e-12 * elastic);
        const double damped = 0.5 * 3.0 * (k + mu / h) * depth * depth;
        EXPECT_NEAR(pressed_energy(scene, h), damped, 1e-12 * damped);
    }
}

TEST(ElasticFoundation, DependsOnTheDepthsAloneWhateverPathTheBodiesCame) {
    // Samples clear of the other body are not examined until something has moved as far: neither many small steps of
    // both bodies nor one that takes every vertex to minus its place may hide a depth.
    const Scene scene = two_triangles(BodyKind::instrument, {.k = std::nan(""), .mu = 0.0});
    const auto energy_at = [](double deep) { return 0.5 * 3e6 * area * deep * deep; };
    double gap = 0.0;
    ElasticFoundation foundation(scene, {{0, 1}}, 3, scene.first.position);
    Matrix3X x = scene.first.position;
    for (int i = 0; i < 60; ++i) {
        const double path = i < 30 ? 1.0 : -1.0;
        if (i % 2 == 0) x.row(2).head(3).array() -= 7e-5 * path;
        if (i % 2 == 1) x.row(2).tail(3).array() += 5e-5 * path;
        const double deep = std::max(0.0, x(2, 3) - x(2, 0));
        EXPECT_NEAR(foundation.energy(x, 0.0, nullptr, gap), energy_at(deep), 1e-15) << i;
    }
    Scene halved = scene;
    halved.first.position.row(2).array() -= 5e-4;
    ElasticFoundation mirrored(halved, {{0, 1}}, 3, halved.first.position);
    EXPECT_EQ(mirrored.energy(halved.first.position, 0.0, nullptr, gap), 0.0);
    EXPECT_NEAR(mirrored.energy(-halved.first.position, 0.0, nullptr, gap), energy_at(1e-3), 1e-15);
}

TEST(ElasticFoundation, HoldsARigidBallAsItsClosedFormSays) {
    // Depth is the distance to the ball's surface. Its integral over the plane is F = kappa pi d^2 (R - d), and the
    // energy, the integral of F, kappa pi (R d^3 / 3 - d^4 / 4).
    constexpr double kappa = 3e6;  // N/m³, the default law
    constexpr double radius = 0.01;
    const test::World world = test::make_world(
        "ball", {{.kind = BodyKind::tissue, .shape = test::sheet(0.016, 16), .closed = false},
                 {.kind = BodyKind::instrument, .shape = test::sphere(radius, 48).move({0, 0, 2.0 * radius})}});
    Scene scene;
    scene.topology = world.topology;
    scene.first.position = world.frame.position;
    scene.materials.contact_laws.assign(scene.topology.body_pairs.size(), {.k = std::nan(""), .mu = 0.0});
    ElasticFoundation foundation(scene, {{0, 1}}, 2, scene.first.position);
    const Range ball = scene.topology.bodies[0].kind == BodyKind::instrument ? scene.topology.bodies[0].vertices
                                                                             : scene.topology.bodies[1].vertices;
    for (const double deep : {1e-3, 2e-3}) {
        Matrix3X x = scene.first.position;
        x.middleCols(ball.first, ball.count).row(2).array() -= radius + deep;
        double gap = 0.0;
        const double expected = kappa * std::numbers::pi * (radius * std::pow(deep, 3) / 3.0 - std::pow(deep, 4) / 4.0);
        EXPECT_NEAR(foundation.energy(x, 0.0, nullptr, gap), expected, 0.03 * expected) << deep;
    }
}

TEST(ElasticFoundation, TooDeepIsMoreThanThreeQuartersOfTheLargestDepthInside) {
    // A small triangle of tissue in a closed block that is half as high as wide: the largest depth is half its height.
    // Of a side of three times a power of two, thirds are exact, and so are middles of faces: nothing is inside there.
    constexpr double height = 3.0 / 64.0;
    constexpr double width = 2.0 * height;
    Scene scene;
    scene.topology = make_topology(
        {test::triangle_body("film", BodyKind::tissue, false), Body{.name = "block",
                                                                    .kind = BodyKind::instrument,
                                                                    .vertex_count = 8,
                                                                    .triangles = test::matrix_of(test::cube_faces)}});
    scene.materials.contact_laws.assign(scene.topology.body_pairs.size(), {.k = 100.0, .mu = 1.0});
    Matrix3X& x = scene.first.position;
    x.resize(3, 11);
    x.rightCols<8>() = test::matrix_of(test::cube_points(Vector3::Zero(), {width, width, height}));
    for (const double part : {0.05, 0.3, 0.7, 0.8, 0.95}) {
        const double z = height - part * 0.5 * height;
        x.col(0) = Vector3(0.5 * width, 0.5 * width, z);
        x.col(1) = Vector3(0.5 * width + 0.001, 0.5 * width, z);
        x.col(2) = Vector3(0.5 * width, 0.5 * width + 0.001, z);
        ElasticFoundation foundation(scene, {{0, 1}}, 2, x);
        EXPECT_EQ(foundation.remember_depths(x), part < 0.75) << part;
    }
}

}  // namespace
}  // namespace trocar
