// Enclosures against closed forms: numbers derived by hand, finite differences of the energy, conservation of momentum.
#include "tissue/volume_forces.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "measure/allocations.hpp"
#include "scene/tissue_materials.hpp"
#include "support/energy.hpp"
#include "support/scene_samples.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

using test::empty_output;
using test::make_tissue;
using test::TissueSample;

Matrix3X force_of(const Materials& materials, const Matrix3X& position) {
    Matrix3X force = Matrix3X::Zero(3, position.cols());
    add_volume_force(materials.enclosures, position, force);
    return force;
}

/// A closed body of tissue: an ellipsoid of 30, 25 and 20 mm.
Scene organ(const std::string& tissue, const std::string& radii = "[0.03,0.025,0.02]", double edge = 0.006) {
    return test::scene_from_text(fmt::format(
        R"({{"format":"trocar-scene-2","name":"organ","ticks":10,"bodies":[{{"name":"organ","kind":"tissue",
            "parts":[{{"shape":"ellipsoid","radii":{},"edge":{}}}],"tissue":{{"pinned":"none",{}}}}}]}})",
        radii, edge, tissue));
}

const char* const filled = R"("bulk_modulus":30000,"preload":0.1)";

Matrix3X shaken(const Matrix3X& position, double by, unsigned seed = 3) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> some(-by, by);
    Matrix3X result = position;
    for (Eigen::Index i = 0; i < result.size(); ++i) result.data()[i] += some(random);
    return result;
}

TEST(Enclosures, PressureOfASqueezedBlockIsTheBulkModulusTimesItsLossOfVolume) {
    const Scene scene = test::scene_from_text(
        R"({"format":"trocar-scene-2","name":"block","ticks":1,"bodies":[{"name":"block","kind":"tissue",
            "parts":[{"shape":"box","size":[0.04,0.04,0.02],"edge":0.01}],
            "tissue":{"pinned":"none","bulk_modulus":5000}}]})");
    ASSERT_EQ(scene.materials.enclosures.size(), 1U);
    const Enclosure& enclosure = scene.materials.enclosures.front();
    EXPECT_NEAR(enclosure.volume, 32e-6, 1e-17);
    EXPECT_NEAR(pressure(enclosure, scene.first.position), 0.0, 1e-10);
    // Flattened to 0.9 of its height: V falls by a tenth, 500 Pa press on the upper face's 16 cm² with 0.8 N.
    Matrix3X flat = scene.first.position;
    flat.row(2) *= 0.9;
    EXPECT_NEAR(pressure(enclosure, flat), 500.0, 1e-9);
    EXPECT_NEAR(volume_energy(scene.materials.enclosures, flat), 0.5 * 5000.0 * 0.01 * 32e-6, 1e-15);
    const Matrix3X force = force_of(scene.materials, flat);
    double up = 0.0;
    for (Index v = 0; v < flat.cols(); ++v) up += std::max(0.0, force(2, v));
    EXPECT_NEAR(up, 500.0 * 16e-4, 1e-12);
    // Grown by a tenth in each direction: 1.331 of the volume, suction of 0.331 K.
    EXPECT_NEAR(pressure(enclosure, 1.1 * scene.first.position), -0.331 * 5000.0, 1e-8);
}

TEST(Enclosures, SphereBreathesAtThreeKOverItsRadiusAndItsMassPerArea) {
    // Springs so weak that they do not count. All go out together by u: ΔV/V = 3 u/R, force K 3 u/R per area of mass ρ
    // h.
    const Scene scene =
        organ(R"("youngs_modulus":1e-6,"bulk_modulus":1000,"thickness":0.002)", "[0.03,0.03,0.03]", 0.003);
    const double omega = std::sqrt(3.0 * 1000.0 / (0.03 * 1060.0 * 0.002));
    const double found = largest_mode(scene.materials, scene.first.position).omega;
    EXPECT_NEAR(found, omega, 0.01 * omega);
    const double bound = gershgorin_bound_omega(scene.materials, scene.first.position);
    EXPECT_GE(bound, found * (1.0 - 1e-9));
    EXPECT_LT(bound, 1.01 * found) << "a sum over all vertices would be far above";
}

TEST(Enclosures, OuterPressureIsCarriedByVolumeAndSpringsSideBySide) {
    // Equilibrium under a small dead pressure P: P = (K + K_springs) |ΔV|/V, whatever the springs have. Their part
    // falls out of the difference of two K; the loss of volume tends to nothing as 1/K.
    constexpr double outer = 2.0;  // Pa
    std::vector<double> carried;
    for (const double bulk : {1e4, 3e4, 1e6}) {
        const Scene scene =
            organ(fmt::format(R"("bulk_modulus":{},"damping":0.05,"drag":150,"preload":0,"substeps":{})", bulk,
                              bulk > 1e5 ? 16 : 6),
                  "[0.03,0.03,0.03]", 0.006);
        Frame frame = scene.first;
        MassSpring tissue(scene.topology, scene.materials);
        ResponseOutput output = empty_output(scene.topology);
        const Enclosure& enclosure = scene.materials.enclosures.front();
        add_volume_gradient(enclosure.triangles, frame.position, -outer, output.held_force);
        std::vector<Wrench> reaction(1);
        for (int tick = 0; tick < 1500; ++tick) {
            ASSERT_TRUE(tissue.advance(output, 1e-3, frame, reaction).ok());
        }
        ASSERT_LT(frame.velocity.cwiseAbs().maxCoeff(), 1e-9);
        const double loss = 1.0 - enclosed_volume(enclosure.triangles, frame.position) / enclosure.volume;
        carried.push_back(outer / loss);
        EXPECT_LT(loss, outer / bulk);
    }
    EXPECT_NEAR(carried[1] - carried[0], 2e4, 0.01 * 2e4);
    EXPECT_NEAR(carried[2] - carried[0], 99e4, 0.01 * 99e4);
    EXPECT_NEAR(carried[2], 1e6, 0.05 * 1e6) << "almost incompressible";
}

TEST(VolumeForces, AreMinusTheGradientOfTheEnergyAndKeepMomentum) {
    const Scene scene = organ(filled);
    const Matrix3X position = shaken(scene.first.position, 0.0015);
    const Matrix3X force = force_of(scene.materials, position);
    const double size = force.cwiseAbs().sum();
    ASSERT_GT(size, 1.0);
    EXPECT_LT(force.rowwise().sum().norm(), 1e-13 * size);
    Vector3 moment = Vector3::Zero();
    for (Index v = 0; v < position.cols(); ++v) moment += Vector3(position.col(v)).cross(Vector3(force.col(v)));
    EXPECT_LT(moment.norm(), 1e-14 * size);
    constexpr double h = 1e-7;
    for (Index v = 0; v < position.cols(); v += 7) {
        for (int axis = 0; axis < 3; ++axis) {
            Matrix3X ahead = position;
            Matrix3X behind = position;
            ahead(axis, v) += h;
            behind(axis, v) -= h;
            const double slope =
                (volume_energy(scene.materials.enclosures, ahead) - volume_energy(scene.materials.enclosures, behind)) /
                (2.0 * h);
            EXPECT_NEAR(force(axis, v), -slope, 1e-6 * force.cwiseAbs().maxCoeff()) << v << " " << axis;
        }
    }
}

TEST(VolumeForces, StiffnessIsTheChangeOfTheForce) {
    Scene scene = organ(filled);
    for (std::size_t v = 0; v < scene.materials.pinned.size(); v += 5) scene.materials.pinned[v] = 1;
    const Matrix3X position = shaken(scene.first.position, 0.001);
    Matrix3X path = shaken(Matrix3X::Zero(3, position.cols()), 1.0, 5);
    Matrix3X product;
    apply_stiffness(scene.materials, position, path, product);
    constexpr double h = 1e-7;
    const Matrix3X rest = Matrix3X::Zero(3, position.cols());
    for (Index v = 0; v < position.cols(); ++v) {
        if (!scene.materials.is_free(v)) path.col(v).setZero();
    }
    Matrix3X ahead;
    Matrix3X behind;
    internal_force(scene.materials, position + h * path, rest, ahead);
    internal_force(scene.materials, position - h * path, rest, behind);
    const Matrix3X expected = (behind - ahead) / (2.0 * h);
    for (Index v = 0; v < position.cols(); ++v) {
        if (!scene.materials.is_free(v)) continue;
        EXPECT_LT((product.col(v) - expected.col(v)).norm(), 1e-5 * expected.cwiseAbs().maxCoeff()) << v;
    }
}

/// Adds the linearised stiffness times a path.
void add_product(const VolumeForces& volumes, const Matrix3X& path, Matrix3X& product) {
    for (const VolumeForces::LinearEnclosure& enclosure : volumes.linear()) {
        Matrix3X gradient = Matrix3X::Zero(3, path.cols());
        for (std::size_t n = 0; n < enclosure.vertex.size(); ++n) {
            gradient.col(enclosure.vertex[n]) = enclosure.gradient.col(static_cast<Eigen::Index>(n));
        }
        product += enclosure.stiffness * gradient.cwiseProduct(path).sum() * gradient;
    }
}

TEST(VolumeForces, LinearisedStiffnessIsExactAtRestAndNeverNegative) {
    const Scene scene = organ(filled);
    const Index n = scene.topology.vertex_count;
    VolumeForces volumes(scene.materials);
    volumes.linearise(scene.first.position);
    const Matrix3X path = shaken(Matrix3X::Zero(3, n), 1.0, 6);
    Matrix3X product = Matrix3X::Zero(3, n);
    Matrix3X exact = Matrix3X::Zero(3, n);
    add_product(volumes, path, product);
    add_volume_stiffness(volumes.enclosures(), scene.first.position, path, exact);
    EXPECT_LT((product - exact).norm(), 1e-9 * exact.norm());

    const Matrix3X position = shaken(scene.first.position, 0.002);
    volumes.linearise(position);
    for (unsigned seed = 10; seed < 30; ++seed) {
        const Matrix3X some = shaken(Matrix3X::Zero(3, n), 1.0, seed);
        product.setZero();
        add_product(volumes, some, product);
        EXPECT_GE(some.cwiseProduct(product).sum(), 0.0);
    }
}

TEST(VolumeForces, StepLimitCountsThemAll) {
    for (const std::string tissue : {R"("bulk_modulus":3e6)", R"("bulk_modulus":3e7)"}) {
        const Scene scene = organ(R"("damping":0,"drag":0,"preload":0,)" + tissue);
        const double omega = largest_mode(scene.materials, scene.first.position).omega;
        EXPECT_GE(gershgorin_bound_omega(scene.materials, scene.first.position), omega * (1.0 - 1e-9)) << tissue;
        const Matrix3X place = shaken(scene.first.position, 0.001);
        EXPECT_GE(gershgorin_bound_omega(scene.materials, place),
                  largest_mode(scene.materials, place).omega * (1.0 - 1e-9))
            << tissue;
    }
}

TEST(VolumeForces, SubstepsOfASceneAreEnough) {
    const auto made = [](const std::string& tissue) { return organ(R"("damping":0,"drag":0,)" + tissue); };
    const int plain = made(R"("preload":0.2)").materials.substeps;
    for (const char* const tissue : {R"("bulk_modulus":3e6)", R"("bulk_modulus":3e7)"}) {
        const Scene scene = made(tissue);
        const double omega = largest_mode(scene.materials, scene.first.position).omega;
        EXPECT_LT(scene.dt / scene.materials.substeps, critical_time_step(omega, 0.0)) << tissue;
        EXPECT_GT(scene.dt / plain, critical_time_step(omega, 0.0)) << tissue << ": or the springs' would do";
    }
}

TEST(VolumeForces, FreeOrganKeepsMomentumAndEnergyAndAsksForNoMemory) {
    Scene scene = organ(std::string(filled) + R"(,"damping":0,"drag":0,"substeps":50,"strain_limit":100)");
    Frame frame = scene.first;
    frame.velocity = shaken(Matrix3X::Zero(3, frame.position.cols()), 0.5, 9);
    const Vector3 middle = frame.position.rowwise().mean();
    for (Index v = 0; v < scene.topology.vertex_count; ++v) {
        frame.velocity.col(v) += 0.5 * (frame.position.col(v) - middle).normalized();  // breathes
    }
    MassSpring tissue(scene.topology, scene.materials);
    const ResponseOutput output = empty_output(scene.topology);
    std::vector<Wrench> reaction(1);
    const double energy = test::energy_of(scene.materials, frame);
    const Vector3 momentum = test::momentum_of(scene.materials, frame);
    const double kinetic = energy - potential_energy(scene.materials, frame.position);
    if (allocation_count() < 0) GTEST_SKIP() << "a sanitizer has replaced the allocator: nothing is counted";
    double in_volume = 0.0;
    for (int tick = 0; tick < 200; ++tick) {
        const std::int64_t allocations = allocation_count();
        ASSERT_TRUE(tissue.advance(output, 1e-3, frame, reaction).ok());
        EXPECT_EQ(allocation_count(), allocations);
        in_volume = std::max(in_volume, volume_energy(scene.materials.enclosures, frame.position));
        // The rest bias is an outer force that sums to zero; the scheme's energy ripples with w h.
        ASSERT_LT((test::momentum_of(scene.materials, frame) - momentum).norm(), 1e-12);
        ASSERT_NEAR(test::energy_of(scene.materials, frame), energy, 0.02 * kinetic) << tick;
    }
    EXPECT_GT(in_volume, 0.05 * kinetic) << "or it would not matter";
}

TEST(VolumeForces, AHeldVertexOfAnEnclosureStaysAndPassesTheForceOn) {
    // Only one vertex of an organ is free.
    const Scene scene = organ(R"("bulk_modulus":5000)");
    TissueSample s;
    s.topology = scene.topology;
    s.materials = scene.materials;
    s.frame = scene.first;
    s.materials.pinned.assign(s.materials.pinned.size(), 1);
    s.materials.pinned[5] = 0;
    s.frame.position.col(5) *= 0.95;
    Matrix3X force;
    internal_force(s.materials, s.frame.position, s.frame.velocity, force);
    MassSpring tissue(s.topology, s.materials);
    const ResponseOutput output = empty_output(s.topology);
    std::vector<Wrench> reaction(1);
    const Matrix3X before = s.frame.position;
    const double dt = 1e-6;
    s.materials.substeps = 1;
    ASSERT_TRUE(tissue.advance(output, dt, s.frame, reaction).ok());
    const Vector3 expected = dt / s.materials.mass[5] * force.col(5);
    EXPECT_LT((s.frame.velocity.col(5) - expected).norm(), 1e-10 * expected.norm());
    for (Index v = 0; v < s.topology.vertex_count; ++v) {
        if (v == 5) continue;
        EXPECT_EQ(s.frame.position.col(v), before.col(v));
    }
}

TEST(VolumeForces, ASceneThatNamesNoneBuildsNone) {
    const Scene plain = organ(R"("preload":0.1)");
    const Scene zero = organ(R"("preload":0.1,"bulk_modulus":0)");
    EXPECT_EQ(plain.hash, zero.hash);
    for (const Scene* scene : {&plain, &zero}) {
        EXPECT_EQ(scene->materials.enclosures.capacity(), 0U);
        const VolumeForces volumes(scene->materials);
        EXPECT_TRUE(volumes.none());
        EXPECT_EQ(volume_energy(volumes.enclosures(), shaken(scene->first.position, 0.001)), 0.0);
    }
    // One instrument on a rigid bone: no springs either.
    const Scene bone = test::scene_from_text(test::press_text(0.001));
    EXPECT_TRUE(bone.materials.springs.empty() && bone.materials.enclosures.empty());
    EXPECT_TRUE(bone.materials.mass.empty());
    EXPECT_TRUE(VolumeForces(bone.materials).none());
}

TEST(VolumeForces, WhatTiesNothingThatMovesIsNoPartOfTheState) {
    // Of springs and enclosures one with a free vertex and one that is held altogether; and a vertex of either kind
    // that nothing ties.
    constexpr Index count = 14;
    const std::vector<Index> free{0, 7, 13};
    std::vector<Vector3> points;
    std::vector<std::uint8_t> pinned(at(count), 1);
    for (Index v = 0; v < count; ++v) points.emplace_back(0.01 * v, 1e-3 * v * v, 0.0);
    for (const Index v : free) pinned[at(v)] = 0;
    TissueSample s = make_tissue(points, std::vector<double>(at(count), 1e-3), pinned,
                                 {{.i = 1, .j = 0, .rest = 0.01, .k = 1.0}, {.i = 2, .j = 3, .rest = 0.01, .k = 1.0}});
    for (const Index corner : {4, 8}) {
        Enclosure tetrahedron{.triangles = Triangles(3, 4), .volume = 1.0, .bulk_modulus = 1.0};
        tetrahedron.triangles << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
        tetrahedron.triangles.array() += corner;
        s.materials.enclosures.push_back(tetrahedron);
    }
    MovingTissue tissue(s.topology, s.materials);
    const TissueState& state = tissue.state();
    EXPECT_EQ(state.vertex, (std::vector<Index>{0, 1, 4, 5, 6, 7, 13}));
    EXPECT_EQ(state.ranges, (std::vector<Range>{{0, 2}, {4, 4}, {13, 1}}));
    for (Index v = 0; v < count; ++v) {
        const auto found = std::find(state.vertex.begin(), state.vertex.end(), v);
        const bool is_in = found != state.vertex.end();
        ASSERT_EQ(state.place[at(v)], is_in ? static_cast<Index>(found - state.vertex.begin()) : -1) << v;
        if (!is_in) continue;
        EXPECT_EQ(state.moves(state.place[at(v)]), std::count(free.begin(), free.end(), v) == 1) << v;
    }
    EXPECT_EQ(tissue.springs().size(), 1U);
    EXPECT_EQ(tissue.volumes().enclosures().size(), 1U);
}

}  // namespace
}  // namespace trocar
