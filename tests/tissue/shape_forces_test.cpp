// Stiffening springs, hinges and enclosures against closed forms: numbers derived by hand or from plate and membrane
// theory, finite differences of the energy, conservation of momentum.
#include "tissue/shape_forces.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "measure/allocations.hpp"
#include "scene/tissue_materials.hpp"
#include "support/scene_samples.hpp"
#include "support/tissue_samples.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar {
namespace {

using test::empty_effect;
using test::make_tissue;
using test::TissueSample;

constexpr double pi = std::numbers::pi;

ShapeElements all_of(const Materials& materials) {
    return {.stiffening = materials.springs, .hinges = materials.hinges, .enclosures = materials.enclosures};
}

Matrix3X force_of(const ShapeElements& elements, const Matrix3X& position) {
    Matrix3X force = Matrix3X::Zero(3, position.cols());
    add_shape_force(elements, position, force);
    return force;
}

/// Everything about one tissue body made by the scene's own rules.
struct MadeTissue {
    Topology topology;
    Materials materials;
    Frame frame;
    MadeTissue(const Matrix3X& position, const Triangles& triangles, const TissueSettings& settings) {
        topology = make_topology({Body{.name = "tissue",
                                       .kind = BodyKind::tissue,
                                       .vertex_count = static_cast<Index>(position.cols()),
                                       .triangles = triangles}});
        frame.position = position;
        frame.previous = position;
        frame.velocity = Matrix3X::Zero(3, position.cols());
        prepare_tissue_arrays(topology, materials);
        add_tissue_body(settings, topology, topology.bodies[0], position, 1e-3, materials);
    }
};

/// Rows of an equilateral lattice in the plane z = 0, row after row along y.
struct Lattice {
    Index columns, rows;
    double edge;
    Matrix3X position;
    Triangles triangles;
    Lattice(Index columns_, Index rows_, double edge_) : columns(columns_), rows(rows_), edge(edge_) {
        position.resize(3, columns * rows);
        triangles.resize(3, 2 * (columns - 1) * (rows - 1));
        Index t = 0;
        for (Index row = 0; row < rows; ++row) {
            for (Index column = 0; column < columns; ++column) {
                position.col(at(column, row)) = Vector3(edge * (column + 0.5 * row), height() * row, 0.0);
                if (row + 1 == rows || column + 1 == columns) continue;
                triangles.col(t++) << at(column, row), at(column + 1, row), at(column, row + 1);
                triangles.col(t++) << at(column + 1, row), at(column + 1, row + 1), at(column, row + 1);
            }
        }
    }
    [[nodiscard]] Index at(Index column, Index row) const { return row * columns + column; }
    [[nodiscard]] double height() const { return std::sqrt(0.75) * edge; }
};

TissueSettings free_of(double bending) {
    TissueSettings settings;
    settings.bending = bending;
    settings.rim_pinned = false;
    return settings;
}

/// A closed body of tissue: an ellipsoid of 30, 25 and 20 mm.
Scene organ(const std::string& tissue, const std::string& radii = "[0.03,0.025,0.02]", double edge = 0.006) {
    return test::scene_from_text(fmt::format(
        R"({{"format":"trocar-scene-1","name":"organ","ticks":10,"bodies":[{{"name":"organ","kind":"tissue",
            "parts":[{{"shape":"ellipsoid","radii":{},"edge":{}}}],"tissue":{{"pinned":"none",{}}}}}]}})",
        radii, edge, tissue));
}

const char* const everything = R"("stiffening":5,"bending":1e-3,"bulk_modulus":20000,"preload":0.1)";

Matrix3X shaken(const Matrix3X& position, double by, unsigned seed = 3) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> some(-by, by);
    Matrix3X result = position;
    for (Eigen::Index i = 0; i < result.size(); ++i) result.data()[i] += some(random);
    return result;
}

// ---- stiffening springs

TEST(Stiffening, TensionAndEnergyAreThoseOfTheThirdPower) {
    // k = 100 N/m, L = 10 mm, s = 4. Stretched by 5 mm: 0.5 N (1 + 4/4) = 1 N; energy k x²/2 = 1.25 mJ and
    // k s x⁴/(4 L²) = 0.625 mJ. Pressed by 2 mm: -0.2 N, linear.
    const Spring spring{.i = 0, .j = 1, .rest = 0.01, .k = 100.0, .preload = 0.3, .stiffening = 4.0};
    TissueSample s = make_tissue({Vector3(0, 0, 0), Vector3(0, 0.015, 0)}, {1e-3, 1e-3}, {0, 0}, {spring});
    Matrix3X force;
    internal_force(s.materials, s.frame.position, s.frame.velocity, force);
    EXPECT_NEAR(force(1, 0), 1.0 + 0.3, 1e-14);
    EXPECT_NEAR(force(1, 1), -1.3, 1e-14);
    EXPECT_NEAR(force_of(all_of(s.materials), s.frame.position)(1, 0), 0.5, 1e-14) << "beyond the linear spring";
    EXPECT_NEAR(shape_energy(all_of(s.materials), s.frame.position), 0.625e-3, 1e-16);
    s.frame.position(1, 1) = 0.008;
    internal_force(s.materials, s.frame.position, s.frame.velocity, force);
    EXPECT_NEAR(force(1, 0), -0.2 + 0.3, 1e-14);
    EXPECT_EQ(shape_energy(all_of(s.materials), s.frame.position), 0.0);
    s.frame.position.col(1).setZero();
    EXPECT_EQ(force_of(all_of(s.materials), s.frame.position), Matrix3X::Zero(3, 2)) << "no length, no direction";
}

TEST(Stiffening, AWeightHangsWhereTheTensionCarriesIt) {
    // The spring above, without preload: 1 N stretches it by 5 mm (10 mm were it linear).
    const Spring spring{.i = 0, .j = 1, .rest = 0.01, .k = 100.0, .damping = 0.5, .stiffening = 4.0};
    TissueSample s = make_tissue({Vector3(0, 0, 0), Vector3(0, 0, -0.01)}, {1e-3, 1e-3}, {1, 0}, {spring});
    s.materials.substeps = 4;
    MassSpring tissue(s.topology, s.materials);
    Effect effect = empty_effect(s.topology);
    effect.held_force(2, 1) = -1.0;
    std::vector<Wrench> reaction(1);
    for (int tick = 0; tick < 500; ++tick) ASSERT_TRUE(tissue.advance(effect, 1e-3, s.frame, reaction).ok());
    EXPECT_NEAR(s.frame.position(2, 1), -0.015, 1e-12);
    EXPECT_EQ(s.frame.position(2, 0), 0.0);
}

TEST(Stiffening, LetGoItPassesItsRestLengthWithAllItsEnergy) {
    // 1.875 mJ on 1 g, half of it at either end: v = sqrt(2 · 1.875e-3 / 1e-3) = 1.9365 m/s at the free end.
    const Spring spring{.i = 0, .j = 1, .rest = 0.01, .k = 100.0, .stiffening = 4.0};
    TissueSample s = make_tissue({Vector3(0, 0, 0), Vector3(0.015, 0, 0)}, {1e-3, 1e-3}, {1, 0}, {spring});
    MassSpring tissue(s.topology, s.materials);
    const Effect effect = empty_effect(s.topology);
    std::vector<Wrench> reaction(1);
    int tick = 0;
    while (s.frame.position(0, 1) > 0.01 && tick++ < 100000) {
        ASSERT_TRUE(tissue.advance(effect, 1e-6, s.frame, reaction).ok());
    }
    EXPECT_NEAR(s.frame.velocity(0, 1), -1.9365, 1e-3);
}

TEST(Stiffening, StepLimitCountsTheSlopeOfTheTension) {
    // Slope at a strain of 1/2 with s = 4: k (1 + 3 · 4/4) = 4 k, so that one mass on it has sqrt(4 k/m).
    const Spring spring{.i = 0, .j = 1, .rest = 0.01, .k = 100.0, .stiffening = 4.0};
    TissueSample s = make_tissue({Vector3(0, 0, 0), Vector3(0.015, 0, 0)}, {1e-3, 1e-3}, {1, 0}, {spring});
    EXPECT_NEAR(largest_mode(s.materials, s.frame.position).omega, std::sqrt(4.0 * 100.0 / 1e-3), 1e-9);
    EXPECT_NEAR(gershgorin_bound_omega(s.materials, s.frame.position), std::sqrt(4.0 * 100.0 / 1e-3), 1e-9);
}

// ---- hinges

TEST(Hinges, MomentOfOneIsItsStiffnessTimesTheBend) {
    // Two equilateral triangles of 10 mm, D = 1 mN m: c = D L²/ΣA = 2 D/sqrt(3). Wings bent by 0.2 rad each.
    const Lattice lattice(2, 2, 0.01);
    const MadeTissue made(lattice.position, lattice.triangles, free_of(1e-3));
    ASSERT_EQ(made.materials.hinges.size(), 1U);
    const Hinge& hinge = made.materials.hinges.front();
    const double c = 2e-3 / std::sqrt(3.0);
    EXPECT_NEAR(hinge.stiffness, c, 1e-15);
    EXPECT_NEAR(hinge.rest, 0.0, 1e-15);
    const double height = lattice.height();
    Matrix3X bent = lattice.position;
    const Vector3 start = bent.col(hinge.vertex[0]);
    const Vector3 along = (bent.col(hinge.vertex[1]) - start).normalized();
    for (const std::size_t corner : {2U, 3U}) {
        const Vector3 far = bent.col(hinge.vertex[corner]) - start;
        const Vector3 foot = far.dot(along) * along;
        const Vector3 out = (far - foot).normalized();
        bent.col(hinge.vertex[corner]) =
            start + foot + height * (std::cos(0.2) * out - std::sin(0.2) * Vector3::UnitZ());
    }
    const Matrix3X force = force_of(all_of(made.materials), bent);
    EXPECT_NEAR(shape_energy(all_of(made.materials), bent), 0.5 * c * 0.4 * 0.4, 1e-15);
    for (const std::size_t corner : {2U, 3U}) {
        const Vector3 f = force.col(hinge.vertex[corner]);
        EXPECT_NEAR(f.norm(), c * 0.4 / height, 1e-12);
        EXPECT_GT(f.z(), 0.0) << "back to where it was flat";
        EXPECT_NEAR(f.dot(bent.col(hinge.vertex[corner]) - bent.col(hinge.vertex[0])), 0.0, 1e-15);
    }
}

TEST(Hinges, BendIsTheShortWayRound) {
    const auto bend = [](double rest, double angle) {
        return bend_of(Hinge{.rest = rest}, Dihedral{.angle = angle, .gradient = {}, .has_angle = true});
    };
    EXPECT_NEAR(bend(1.0, 1.25), 0.25, 1e-15);
    EXPECT_NEAR(bend(3.0, -3.0), 2.0 * pi - 6.0, 1e-15);
    EXPECT_NEAR(bend(-3.0, 3.0), 6.0 - 2.0 * pi, 1e-15);
}

TEST(Hinges, RestShapeIsFreeOfMomentsHoweverItIsCurved) {
    const Scene scene = organ(R"("bending":0.01)");
    EXPECT_EQ(scene.materials.hinges.size(), scene.materials.springs.size()) << "a closed surface has inner edges only";
    EXPECT_EQ(force_of(all_of(scene.materials), scene.first.position), Matrix3X::Zero(3, scene.topology.vertex_count));
    // Counter-clockwise seen from outside: edges of a convex body stand out.
    for (const Hinge& hinge : scene.materials.hinges) EXPECT_GT(hinge.rest, 0.0);
}

/// Hinges of triangles that point up and have inner edges only: each direction as often as the others.
std::vector<Hinge> balanced(const Lattice& lattice, const std::vector<Hinge>& hinges) {
    std::vector<Hinge> result;
    for (Index row = 1; row + 2 < lattice.rows; ++row) {
        for (Index column = 1; column + 2 < lattice.columns; ++column) {
            const std::array<Index, 3> corner{lattice.at(column, row), lattice.at(column + 1, row),
                                              lattice.at(column, row + 1)};
            for (const Hinge& hinge : hinges) {
                const auto has = [&](Index v) { return std::count(corner.begin(), corner.end(), v) > 0; };
                if (has(hinge.vertex[0]) && has(hinge.vertex[1])) result.push_back(hinge);
            }
        }
    }
    return result;
}

TEST(Hinges, StripRolledToACylinderHoldsTheEnergyOfAPlateInEveryDirection) {
    constexpr double rigidity = 2e-3;
    constexpr double radius = 0.1;
    const Lattice lattice(16, 16, 0.005);
    const MadeTissue made(lattice.position, lattice.triangles, free_of(rigidity));
    const std::vector<Hinge> hinges = balanced(lattice, made.materials.hinges);
    ASSERT_EQ(hinges.size(), 3U * 13U * 13U);
    const double area = 13.0 * 13.0 * lattice.edge * lattice.height();
    for (const double degrees : {0.0, 17.0, 30.0, 45.0, 90.0}) {
        const Vector3 across(std::cos(degrees * pi / 180.0), std::sin(degrees * pi / 180.0), 0.0);
        const Vector3 axis = Vector3::UnitZ().cross(across);
        Matrix3X rolled = lattice.position;
        for (Index v = 0; v < rolled.cols(); ++v) {
            const Vector3 p = lattice.position.col(v);
            const double turn = across.dot(p) / radius;
            rolled.col(v) = axis.dot(p) * axis + radius * (std::sin(turn) * across + std::cos(turn) * Vector3::UnitZ());
        }
        const double plate = 0.5 * rigidity / (radius * radius) * area;
        EXPECT_NEAR(shape_energy({.stiffening = {}, .hinges = hinges, .enclosures = {}}, rolled), plate, 2e-3 * plate)
            << degrees;
    }
}

TEST(Hinges, BowlsAndSaddlesHoldWhatSeungAndNelsonFound) {
    // Phys. Rev. A 38 (1988) 1005: hinges of an equilateral lattice are a plate with a Gaussian rigidity of -4/3 D
    // (Poisson's ratio -1/3): D/2 (a² + b² - 2/3 a b) for principal curvatures a and b.
    constexpr double rigidity = 2e-3;
    constexpr double curvature = 1.0;  // 1/m: flat against the edges of 5 mm
    const Lattice lattice(16, 16, 0.005);
    const MadeTissue made(lattice.position, lattice.triangles, free_of(rigidity));
    const std::vector<Hinge> hinges = balanced(lattice, made.materials.hinges);
    const double area = 13.0 * 13.0 * lattice.edge * lattice.height();
    const Vector3 middle = lattice.position.rowwise().mean();
    for (const double other : {1.0, -1.0, 0.0}) {
        Matrix3X bent = lattice.position;
        for (Index v = 0; v < bent.cols(); ++v) {
            const Vector3 p = lattice.position.col(v) - middle;
            bent(2, v) = 0.5 * curvature * (p.x() * p.x() + other * p.y() * p.y());
        }
        const double plate = 0.5 * rigidity * (1.0 + other * other - 2.0 / 3.0 * other) * area;
        EXPECT_NEAR(shape_energy({.stiffening = {}, .hinges = hinges, .enclosures = {}}, bent), plate, 0.01 * plate)
            << other;
    }
}

TEST(Hinges, OfSquaresWithOneDiagonalDependOnTheDirection) {
    // By hand, from the gradients' jumps at the edges: D/2 ((yy + xy)² + (xx + xy)² + 4 xy²) for the second derivatives
    // xx, xy, yy of the deflection: D along the sides and across the diagonals, 3 D along the diagonals.
    constexpr double rigidity = 2e-3;
    constexpr double side = 0.005;
    constexpr Index n = 9;
    Matrix3X position(3, n * n);
    Triangles triangles(3, 2 * (n - 1) * (n - 1));
    Index t = 0;
    const auto at = [](Index x, Index y) { return y * n + x; };
    for (Index y = 0; y < n; ++y) {
        for (Index x = 0; x < n; ++x) {
            position.col(at(x, y)) = side * Vector3(x - 0.5 * n, y - 0.5 * n, 0.0);
            if (x + 1 == n || y + 1 == n) continue;
            triangles.col(t++) << at(x, y), at(x + 1, y), at(x + 1, y + 1);
            triangles.col(t++) << at(x, y), at(x + 1, y + 1), at(x, y + 1);
        }
    }
    const MadeTissue made(position, triangles, free_of(rigidity));
    std::vector<Hinge> hinges;  // of every inner cell its lower and left side and its diagonal
    double area = 0.0;
    for (Index y = 1; y + 1 < n; ++y) {
        for (Index x = 1; x + 1 < n; ++x) {
            area += side * side;
            for (const Hinge& hinge : made.materials.hinges) {
                if (hinge.vertex[0] != at(x, y)) continue;
                const Index end = hinge.vertex[1];
                if (end == at(x + 1, y) || end == at(x, y + 1) || end == at(x + 1, y + 1)) hinges.push_back(hinge);
            }
        }
    }
    ASSERT_EQ(hinges.size(), 3U * (n - 2) * (n - 2));
    for (const auto& [degrees, share] : std::vector<std::pair<double, double>>{{0, 1}, {90, 1}, {-45, 1}, {45, 3}}) {
        const Vector3 across(std::cos(degrees * pi / 180.0), std::sin(degrees * pi / 180.0), 0.0);
        Matrix3X bent = position;
        for (Index v = 0; v < bent.cols(); ++v) bent(2, v) = 0.5 * std::pow(across.dot(position.col(v)), 2);
        const double plate = 0.5 * rigidity * area;
        EXPECT_NEAR(shape_energy({.stiffening = {}, .hinges = hinges, .enclosures = {}}, bent), share * plate,
                    0.01 * plate)
            << degrees;
    }
}

TEST(Hinges, CantileverBendsAsTheBeamEquationSays) {
    // Rows of equilateral triangles bent along y, a line load F (N/m) on the last row: the moment F (n - i) h at row i
    // is D times the second difference of the deflection, so that w_n = F h³/D Σ m² = F h³/D (n-1) n (2n-1)/6: the
    // beam's F H³/(3 D) for a clamp between the two rows that are held, H = (n - 1/2) h, but for 1/(2n - 1)² of it.
    constexpr double rigidity = 1e-3;
    constexpr double load = 1e-7;
    constexpr Index n = 20;
    const Lattice lattice(5, n + 1, 0.004);
    const MadeTissue made(lattice.position, lattice.triangles, free_of(rigidity));
    const double h = lattice.height();
    std::vector<double> w(n + 1, 0.0);
    for (Index row = 2; row <= n; ++row) {
        w[row] = 2.0 * w[row - 1] - w[row - 2] + load * h * h * h / rigidity * (n - row + 1);
    }
    const double by_hand = load * h * h * h / rigidity * (n - 1) * n * (2 * n - 1) / 6.0;
    EXPECT_NEAR(w[n], by_hand, 1e-12 * by_hand);
    const double beam = load * std::pow((n - 0.5) * h, 3) / (3.0 * rigidity);
    EXPECT_NEAR(1.0 - w[n] / beam, 1.0 / (4.0 * (n - 0.5) * (n - 0.5)), 1e-9);
    Matrix3X bent = lattice.position;
    for (Index row = 0; row <= n; ++row) {
        for (Index column = 0; column < lattice.columns; ++column) bent(2, lattice.at(column, row)) = w[row];
    }
    // The hinges carry that load and nothing else: per vertex of a row F × edge, upwards on the tip alone.
    const Matrix3X force = force_of(all_of(made.materials), bent);
    for (Index row = 2; row <= n; ++row) {
        double sum = 0.0;
        for (Index column = 0; column < lattice.columns; ++column) sum += force(2, lattice.at(column, row));
        // The last row's edges are a rim and have no hinge, and the one next to it folds all its 4 edges.
        const double carried = row == n ? -load * lattice.edge * (lattice.columns - 1) : 0.0;
        EXPECT_NEAR(sum, carried, 1e-5 * load * lattice.edge) << row;
    }
}

TEST(Hinges, AWingSwingsAtItsOwnFrequency) {
    // One corner is free on a hinge of stiffness c = D L²/ΣA: w² = c/(m h²).
    constexpr double rigidity = 1e-3;
    const Lattice lattice(2, 2, 0.01);
    TissueSettings settings = free_of(rigidity);
    settings.preload = 0.0;
    settings.damping = 0.0;
    settings.drag = 0.0;
    settings.pinned = {lattice.at(0, 0), lattice.at(1, 0), lattice.at(0, 1)};
    MadeTissue made(lattice.position, lattice.triangles, settings);
    const Index wing = lattice.at(1, 1);
    const double mass = made.materials.mass[static_cast<std::size_t>(wing)];
    const double omega = std::sqrt(2.0 * rigidity / std::sqrt(3.0) / mass) / lattice.height();
    MassSpring tissue(made.topology, made.materials);
    const Effect effect = empty_effect(made.topology);
    std::vector<Wrench> reaction(1);
    made.frame.velocity(2, wing) = 1e-4;
    const double quarter = 0.5 * pi / omega;
    const int ticks = 2000;
    for (int tick = 0; tick < ticks; ++tick) {
        ASSERT_TRUE(tissue.advance(effect, quarter / ticks, made.frame, reaction).ok());
    }
    EXPECT_NEAR(made.frame.position(2, wing), 1e-4 / omega, 1e-3 * 1e-4 / omega);
    EXPECT_NEAR(made.frame.velocity(2, wing), 0.0, 1e-3 * 1e-4);
}

// ---- enclosures

TEST(Enclosures, PressureOfASqueezedBlockIsTheBulkModulusTimesItsLossOfVolume) {
    const Scene scene = test::scene_from_text(
        R"({"format":"trocar-scene-1","name":"block","ticks":1,"bodies":[{"name":"block","kind":"tissue",
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
    EXPECT_NEAR(shape_energy(all_of(scene.materials), flat), 0.5 * 5000.0 * 0.01 * 32e-6, 1e-15);
    const Matrix3X force = force_of(all_of(scene.materials), flat);
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
        Effect effect = empty_effect(scene.topology);
        const Enclosure& enclosure = scene.materials.enclosures.front();
        add_volume_gradient(enclosure.triangles, frame.position, -outer, effect.held_force);
        std::vector<Wrench> reaction(1);
        for (int tick = 0; tick < 1500; ++tick) {
            ASSERT_TRUE(tissue.advance(effect, 1e-3, frame, reaction).ok());
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

// ---- all of them

TEST(ShapeForces, AreMinusTheGradientOfTheEnergyAndKeepMomentum) {
    const Scene scene = organ(everything);
    const ShapeElements elements = all_of(scene.materials);
    const Matrix3X position = shaken(scene.first.position, 0.0015);
    const Matrix3X force = force_of(elements, position);
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
            const double slope = (shape_energy(elements, ahead) - shape_energy(elements, behind)) / (2.0 * h);
            EXPECT_NEAR(force(axis, v), -slope, 1e-6 * force.cwiseAbs().maxCoeff()) << v << " " << axis;
        }
    }
}

TEST(ShapeForces, StiffnessIsTheChangeOfTheForce) {
    Scene scene = organ(everything);
    for (std::size_t v = 0; v < scene.materials.pinned.size(); v += 5) scene.materials.pinned[v] = 1;
    const Matrix3X position = shaken(scene.first.position, 0.001);
    Matrix3X way = shaken(Matrix3X::Zero(3, position.cols()), 1.0, 5);
    Matrix3X product;
    apply_stiffness(scene.materials, position, way, product);
    constexpr double h = 1e-7;
    const Matrix3X rest = Matrix3X::Zero(3, position.cols());
    for (Index v = 0; v < position.cols(); ++v) {
        if (!is_free(scene.materials, v)) way.col(v).setZero();
    }
    Matrix3X ahead;
    Matrix3X behind;
    internal_force(scene.materials, position + h * way, rest, ahead);
    internal_force(scene.materials, position - h * way, rest, behind);
    const Matrix3X expected = (behind - ahead) / (2.0 * h);
    for (Index v = 0; v < position.cols(); ++v) {
        if (!is_free(scene.materials, v)) continue;
        EXPECT_LT((product.col(v) - expected.col(v)).norm(), 1e-5 * expected.cwiseAbs().maxCoeff()) << v;
    }
}

TEST(ShapeForces, LinearisedStiffnessIsExactAtRestAndNeverNegative) {
    const Scene scene = organ(everything);
    const Index n = scene.topology.vertex_count;
    ShapeForces shape(scene.materials);
    shape.linearise(scene.first.position);
    const Matrix3X way = shaken(Matrix3X::Zero(3, n), 1.0, 6);
    Matrix3X product = Matrix3X::Zero(3, n);
    Matrix3X exact = Matrix3X::Zero(3, n);
    shape.add_product(way, product);
    add_shape_stiffness(shape.elements(), scene.first.position, way, exact);
    EXPECT_LT((product - exact).norm(), 1e-9 * exact.norm());

    const Matrix3X position = shaken(scene.first.position, 0.002);
    shape.linearise(position);
    for (unsigned seed = 10; seed < 30; ++seed) {
        const Matrix3X some = shaken(Matrix3X::Zero(3, n), 1.0, seed);
        product.setZero();
        shape.add_product(some, product);
        EXPECT_GE(some.cwiseProduct(product).sum(), 0.0);
    }
}

TEST(ShapeForces, LinearisedSpringIsItsTangent) {
    // The spring of 100 N/m at a strain of 1/2 with s = 4: beyond the linear one 3 · 100 N/m along, 0.5 N / 15 mm
    // across.
    const Spring spring{.i = 0, .j = 1, .rest = 0.01, .k = 100.0, .stiffening = 4.0};
    const TissueSample s = make_tissue({Vector3(0, 0, 0), Vector3(0.015, 0, 0)}, {1e-3, 1e-3}, {0, 0}, {spring});
    ShapeForces shape(s.materials);
    shape.linearise(s.frame.position);
    ASSERT_EQ(shape.linear_springs().size(), 1U);
    const Matrix3 expected = Vector3(300.0, 0.5 / 0.015, 0.5 / 0.015).asDiagonal();
    EXPECT_LT((shape.linear_springs().front().block - expected).norm(), 1e-10);
}

TEST(ShapeForces, StepLimitCountsThemAll) {
    const std::vector<std::string> named{R"("bending":0.05)", R"("bulk_modulus":3e6)",
                                         R"("bending":0.01,"bulk_modulus":3e5,"stiffening":20)"};
    for (const std::string& tissue : named) {
        Scene scene = organ(R"("damping":0,"drag":0,"preload":0,"strain_limit":1000,)" + tissue);
        const double omega = largest_mode(scene.materials, scene.first.position).omega;
        EXPECT_GE(gershgorin_bound_omega(scene.materials, scene.first.position), omega * (1.0 - 1e-9)) << tissue;
        const Matrix3X place = shaken(scene.first.position, 0.001);
        EXPECT_GE(gershgorin_bound_omega(scene.materials, place),
                  largest_mode(scene.materials, place).omega * (1.0 - 1e-9))
            << tissue;
        // Just below the exact limit it rings on, just above it blows up.
        const LargestMode mode = largest_mode(scene.materials, scene.first.position);
        for (const double share : {0.97, 1.05}) {
            Frame frame = scene.first;
            frame.velocity = 1e-5 * mode.shape;
            scene.materials.substeps = 1;
            MassSpring tissue_now(scene.topology, scene.materials);
            const Effect effect = empty_effect(scene.topology);
            std::vector<Wrench> reaction(1);
            const double start = frame.velocity.cwiseAbs().maxCoeff();
            double growth = 1.0;
            bool failed = false;
            for (int tick = 0; tick < 4000 && !failed; ++tick) {
                const double h = share * critical_time_step(omega, 0.0);
                failed = !tissue_now.advance(effect, h, frame, reaction).ok();
                growth = std::max(growth, frame.velocity.cwiseAbs().maxCoeff() / start);
            }
            // Hinges cannot be bent further than by π: what they blow up into is large and no infinity.
            EXPECT_EQ(failed || growth > 100.0, share > 1.0) << tissue << " at " << share << " by " << growth;
        }
    }
}

TEST(ShapeForces, SubstepsOfASceneAreEnough) {
    const auto made = [](const std::string& tissue) { return organ(R"("damping":0,"drag":0,)" + tissue); };
    const int plain = made(R"("preload":0.2)").materials.substeps;
    for (const char* const tissue :
         {R"("bending":0.05)", R"("bulk_modulus":3e6)", R"("bending":0.02,"bulk_modulus":1e6)"}) {
        const Scene scene = made(tissue);
        const double omega = largest_mode(scene.materials, scene.first.position).omega;
        EXPECT_LT(scene.dt / scene.materials.substeps, critical_time_step(omega, 0.0)) << tissue;
        EXPECT_GT(scene.dt / plain, critical_time_step(omega, 0.0)) << tissue << ": or the springs' would do";
    }
    // A stiffening spring is stiffest at the strain limit: here all are stretched that far.
    const Scene scene = made(R"("stiffening":50,"strain_limit":0.5)");
    const double omega = largest_mode(scene.materials, 1.5 * scene.first.position).omega;
    EXPECT_LT(scene.dt / scene.materials.substeps, critical_time_step(omega, 0.0));
    EXPECT_GT(scene.dt / plain, critical_time_step(omega, 0.0));
}

TEST(ShapeForces, FreeOrganKeepsMomentumAndEnergyAndAsksForNoMemory) {
    Scene scene = organ(std::string(everything) + R"(,"damping":0,"drag":0,"substeps":50,"strain_limit":100)");
    Frame frame = scene.first;
    frame.velocity = shaken(Matrix3X::Zero(3, frame.position.cols()), 0.5, 9);
    MassSpring tissue(scene.topology, scene.materials);
    const Effect effect = empty_effect(scene.topology);
    std::vector<Wrench> reaction(1);
    const auto books = [&] {
        Eigen::Vector4d sum = Eigen::Vector4d::Zero();
        for (Index v = 0; v < scene.topology.vertex_count; ++v) {
            const double mass = scene.materials.mass[static_cast<std::size_t>(v)];
            sum.head<3>() += mass * frame.velocity.col(v);
            sum[3] += 0.5 * mass * frame.velocity.col(v).squaredNorm() -
                      scene.materials.rest_bias.col(v).dot(frame.position.col(v));
        }
        for (const Spring& spring : scene.materials.springs) {
            const double stretch = (frame.position.col(spring.j) - frame.position.col(spring.i)).norm() - spring.rest;
            sum[3] += 0.5 * spring.k * stretch * stretch + spring.preload * stretch;
        }
        sum[3] += shape_energy(all_of(scene.materials), frame.position);
        return sum;
    };
    const Eigen::Vector4d before = books();
    double kinetic = 0.0;
    for (Index v = 0; v < scene.topology.vertex_count; ++v) {
        kinetic += 0.5 * scene.materials.mass[static_cast<std::size_t>(v)] * frame.velocity.col(v).squaredNorm();
    }
    if (allocation_count() < 0) GTEST_SKIP() << "a sanitizer has replaced the allocator: nothing is counted";
    double in_shape = 0.0;
    for (int tick = 0; tick < 200; ++tick) {
        const std::int64_t allocations = allocation_count();
        ASSERT_TRUE(tissue.advance(effect, 1e-3, frame, reaction).ok());
        EXPECT_EQ(allocation_count(), allocations);
        in_shape = std::max(in_shape, shape_energy(all_of(scene.materials), frame.position));
        const Eigen::Vector4d now = books();
        // The rest bias is an outer force that sums to zero; the scheme's energy ripples with w h.
        ASSERT_LT((now - before).head<3>().norm(), 1e-12);
        ASSERT_NEAR(now[3], before[3], 0.02 * kinetic) << tick;
    }
    EXPECT_GT(in_shape, 0.05 * kinetic) << "or it would not matter";
}

TEST(ShapeForces, AHeldVertexOfAHingeAndOfAnEnclosureStaysAndPassesTheForceOn) {
    // Only one vertex of a block is free: its neighbours along hinges and the whole surface are held.
    const Scene scene = organ(R"("bending":1e-3,"bulk_modulus":5000)");
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
    const Effect effect = empty_effect(s.topology);
    std::vector<Wrench> reaction(1);
    const Matrix3X before = s.frame.position;
    const double dt = 1e-6;
    s.materials.substeps = 1;
    ASSERT_TRUE(tissue.advance(effect, dt, s.frame, reaction).ok());
    const Vector3 expected = dt / s.materials.mass[5] * force.col(5);
    EXPECT_LT((s.frame.velocity.col(5) - expected).norm(), 1e-10 * expected.norm());
    for (Index v = 0; v < s.topology.vertex_count; ++v) {
        if (v == 5) continue;
        EXPECT_EQ(s.frame.position.col(v), before.col(v));
    }
}

TEST(ShapeForces, ASceneThatNamesNoneBuildsNone) {
    const Scene plain = organ(R"("preload":0.1)");
    const Scene zero = organ(R"("preload":0.1,"stiffening":0,"bending":0,"bulk_modulus":0)");
    EXPECT_EQ(plain.hash, zero.hash);
    for (const Scene* scene : {&plain, &zero}) {
        EXPECT_EQ(scene->materials.hinges.capacity(), 0U);
        EXPECT_EQ(scene->materials.enclosures.capacity(), 0U);
        for (const Spring& spring : scene->materials.springs) EXPECT_EQ(spring.stiffening, 0.0);
        const ShapeForces shape(scene->materials);
        EXPECT_TRUE(shape.none());
        EXPECT_TRUE(shape.linear_springs().empty() && shape.linear_hinges().empty());
        EXPECT_EQ(shape_energy(shape.elements(), shaken(scene->first.position, 0.001)), 0.0);
    }
    // One instrument on a rigid bone: no springs either.
    const Scene bone = test::scene_from_text(test::press_text(0.001));
    EXPECT_TRUE(bone.materials.springs.empty() && bone.materials.hinges.empty() && bone.materials.enclosures.empty());
    EXPECT_TRUE(bone.materials.mass.empty());
    EXPECT_TRUE(ShapeForces(bone.materials).none());
}

TEST(ShapeForces, WhatTiesNothingThatMovesIsNoPartOfTheState) {
    // Of springs, hinges and enclosures one with a free vertex and one that is held altogether; and a vertex of either
    // kind that nothing ties.
    constexpr Index count = 22;
    const std::vector<Index> free{0, 7, 15, 21};
    std::vector<Vector3> points;
    std::vector<std::uint8_t> pinned(at(count), 1);
    for (Index v = 0; v < count; ++v) points.emplace_back(0.01 * v, 1e-3 * v * v, 0.0);
    for (const Index v : free) pinned[at(v)] = 0;
    TissueSample s = make_tissue(points, std::vector<double>(at(count), 1e-3), pinned,
                                 {{.i = 1, .j = 0, .rest = 0.01, .k = 1.0}, {.i = 2, .j = 3, .rest = 0.01, .k = 1.0}});
    for (const Index corner : {4, 8}) {
        s.materials.hinges.push_back({.vertex = {corner, corner + 1, corner + 2, corner + 3}, .stiffness = 1.0});
    }
    for (const Index corner : {12, 16}) {
        Enclosure tetrahedron{.triangles = Triangles(3, 4), .volume = 1.0, .bulk_modulus = 1.0};
        tetrahedron.triangles << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
        tetrahedron.triangles.array() += corner;
        s.materials.enclosures.push_back(tetrahedron);
    }
    MovingTissue tissue(s.topology, s.materials);
    const TissueState& state = tissue.state();
    EXPECT_EQ(state.vertex, (std::vector<Index>{0, 1, 4, 5, 6, 7, 12, 13, 14, 15, 21}));
    EXPECT_EQ(state.ranges, (std::vector<Range>{{0, 2}, {4, 4}, {12, 4}, {21, 1}}));
    for (Index v = 0; v < count; ++v) {
        const auto found = std::find(state.vertex.begin(), state.vertex.end(), v);
        const bool is_in = found != state.vertex.end();
        ASSERT_EQ(state.place[at(v)], is_in ? static_cast<Index>(found - state.vertex.begin()) : -1) << v;
        if (!is_in) continue;
        EXPECT_EQ(state.moves(state.place[at(v)]), std::count(free.begin(), free.end(), v) == 1) << v;
    }
    EXPECT_EQ(tissue.springs().size(), 1U);
    EXPECT_EQ(tissue.shape().elements().hinges.size(), 1U);
    EXPECT_EQ(tissue.shape().elements().enclosures.size(), 1U);
}

}  // namespace
}  // namespace trocar
