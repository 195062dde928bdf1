// What tissue resists beyond the stretch of linear springs, where its scene names it: stiffening of its springs,
// bending at hinges and a change of the volume that it encloses (METHODS §4). A scene that names none has no elements,
// and all here is empty and costs nothing.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "geometry/dihedral.hpp"
#include "geometry/enclosed_volume.hpp"
#include "scene/world.hpp"
#include "tissue/hinge_kernels.hpp"

namespace trocar {

/// Elements between the columns of one array of positions.
struct ShapeElements {
    std::span<const Spring> stiffening;  ///< of each only what it pulls beyond a linear spring
    std::span<const Hinge> hinges;
    std::span<const Enclosure> enclosures;
};

/// How far a hinge is bent from its rest angle, rad: the shorter way round, so that a hinge that rests near ±π has no
/// jump there.
double bend_of(const Hinge& hinge, const Dihedral& dihedral);

/// Adds the elements' forces (3×N, N): minus the gradient of shape_energy. Each element's forces sum to zero and have
/// no moment. Positions 3×N, m. An element without a direction (a spring of no length, a hinge at a triangle of no
/// area) gives none.
void add_shape_force(const ShapeElements& elements, const Points& position, PointsOut force);

/// J, 0 where springs are not stretched, hinges at their rest angle and volumes at their rest volume.
double shape_energy(const ShapeElements& elements, const Points& position);

/// Over-pressure inside, Pa: -bulk_modulus (V - volume)/volume.
double pressure(const Enclosure& enclosure, const Points& position);

/// Adds the exact tangent of hinges and enclosures applied to a displacement (3×N): minus the change of their forces to
/// first order, N. Not positive semi-definite away from rest. For springs see stability.hpp, which has them whole.
void add_shape_stiffness(const ShapeElements& elements, const Points& position, const Points& displacement,
                         PointsOut force);

/// Adds per vertex and axis (3×N, N/m) what bounds the rows of that tangent: of hinges the sum of absolute entries
/// (Gershgorin), of an enclosure λ m with the frequency λ = K/V0 Σ|g|²/m of its rank-one part, which a sum of entries
/// would overestimate by the number of vertices, and the absolute entries of the rest. inverse_mass: 1/kg per vertex, 0
/// = does not move: it has no row and no column.
void add_shape_row_sums(const ShapeElements& elements, const Points& position, std::span<const double> inverse_mass,
                        PointsOut rows);

/// The elements of a stepper, between the vertices of its state, and their stiffness linearised at one place: a
/// positive semi-definite approximation of the tangent for implicit steppers. Springs: slope of the stiffening tension
/// along, tension over length across; hinges: c g gᵀ with the gradient g of the angle (Gauss-Newton: exact at the rest
/// angle); enclosures: K/V0 g gᵀ with the gradient g of the volume (exact at the rest volume).
class ShapeForces {
public:
    /// A hinge as linearised: its matrix is stiffness · slope slopeᵀ over its four vertices.
    struct LinearHinge {
        std::array<Index, 4> vertex{};
        std::array<Vector3, 4> slope{};  ///< rad/m
        double stiffness = 0.0;          ///< N m
    };
    /// An enclosure as linearised: its matrix is stiffness · gradient gradientᵀ, of rank one.
    struct LinearEnclosure {
        std::vector<Index> vertex;  ///< those of its triangles, ascending
        Matrix3X gradient;          ///< 3×n, m², of the volume, per entry of `vertex`
        double stiffness = 0.0;     ///< Pa/m³, K/V0
    };
    /// A stiffening spring as linearised: its matrix is [B -B; -B B] over i and j.
    struct LinearSpring {
        Index i = -1;
        Index j = -1;
        Matrix3 block;  ///< N/m, what it has beyond a linear spring
    };

    /// None.
    ShapeForces() = default;
    /// Those of the materials. `place`: column of each vertex of the frame in the state's arrays; every vertex of an
    /// element has one, or the element is left out (of an enclosure: all have one). Empty: the frame's own numbers.
    explicit ShapeForces(const Materials& materials, std::span<const Index> place = {});

    [[nodiscard]] bool none() const { return springs_.empty() && hinges_.empty() && enclosures_.empty(); }
    [[nodiscard]] ShapeElements elements() const { return {springs_, hinges_, enclosures_}; }
    /// add_shape_force of these elements on a state (4×N), the hinges by vectors.
    void add_force(const Matrix4X& position, Matrix4X& force) const;

    /// Linearises at a place (3×N, m). Allocates nothing.
    void linearise(const Points& position);
    [[nodiscard]] std::span<const LinearSpring> linear_springs() const { return linear_springs_; }
    [[nodiscard]] std::span<const LinearHinge> linear_hinges() const { return linear_hinges_; }
    [[nodiscard]] std::span<const LinearEnclosure> linear_enclosures() const { return linear_enclosures_; }
    /// Adds the linearised stiffness applied to a displacement (3×N, m; its columns of held vertices are 0), N.
    void add_product(const Points& displacement, PointsOut force) const;

private:
    std::vector<Spring> springs_;
    std::vector<Hinge> hinges_;
    HingeArrays hinge_arrays_;                     ///< the same
    const HingeKernels* hinge_kernels_ = nullptr;  ///< only with hinges
    std::vector<Enclosure> enclosures_;
    std::vector<LinearSpring> linear_springs_;
    std::vector<LinearHinge> linear_hinges_;
    std::vector<LinearEnclosure> linear_enclosures_;
    Matrix3X volume_gradient_;  ///< 3×N, only with enclosures
};

}  // namespace trocar
