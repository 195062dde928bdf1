// Forces of tissue that resists a change of the volume it encloses, where its scene names a bulk modulus (METHODS §4).
// A scene that names none has no enclosures, and all here is empty and costs nothing.
#pragma once

#include <span>
#include <vector>

#include "geometry/enclosed_volume.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Adds the enclosures' forces (3×N, N): minus the gradient of volume_energy. Each one's forces sum to zero and have no
/// moment. Positions 3×N, m.
void add_volume_force(std::span<const Enclosure> enclosures, const Points& position, PointsOut force);

/// J, 0 at the rest volumes.
double volume_energy(std::span<const Enclosure> enclosures, const Points& position);

/// Over-pressure inside, Pa: -bulk_modulus (V - volume)/volume.
double pressure(const Enclosure& enclosure, const Points& position);

/// Adds the exact tangent applied to a displacement (3×N): minus the change of the forces to first order, N. It is not
/// positive semi-definite away from rest.
void add_volume_stiffness(std::span<const Enclosure> enclosures, const Points& position, const Points& displacement,
                          PointsOut force);

/// Adds per vertex and axis (3×N, N/m) what bounds the rows of that tangent: λ m with the frequency λ = K/V0 Σ|g|²/m of
/// its rank-one part, which a sum of entries would overestimate by the number of vertices, and the absolute entries of
/// the rest. inverse_mass: 1/kg per vertex, 0 = does not move: it has no row and no column.
void add_volume_row_sums(std::span<const Enclosure> enclosures, const Points& position,
                         std::span<const double> inverse_mass, PointsOut rows);

/// The enclosures of a stepper, between the vertices of its state, and their stiffness linearised at one place:
/// K/V0 g gᵀ with the gradient g of the volume, positive semi-definite and exact at the rest volume.
class VolumeForces {
public:
    /// An enclosure as linearised: its matrix is stiffness · gradient gradientᵀ, of rank one.
    struct LinearEnclosure {
        std::vector<Index> vertex;  ///< those of its triangles, ascending
        Matrix3X gradient;          ///< 3×n, m², of the volume, per entry of `vertex`
        double stiffness = 0.0;     ///< Pa/m³, K/V0
    };

    /// None.
    VolumeForces() = default;
    /// Those of the materials. `place`: column of each vertex of the frame in the state's arrays; an enclosure with a
    /// vertex that has none is left out. Empty: the frame's own numbers.
    explicit VolumeForces(const Materials& materials, std::span<const Index> place = {});

    [[nodiscard]] bool none() const { return enclosures_.empty(); }
    [[nodiscard]] std::span<const Enclosure> enclosures() const { return enclosures_; }

    /// Linearises at a place (3×N, m). Allocates nothing.
    void linearise(const Points& position);
    [[nodiscard]] std::span<const LinearEnclosure> linear() const { return linear_; }
    /// Adds the linearised stiffness applied to a displacement (3×N, m; its columns of held vertices are 0), N.
    void add_product(const Points& displacement, PointsOut force) const;

private:
    std::vector<Enclosure> enclosures_;
    std::vector<LinearEnclosure> linear_;
    Matrix3X gradient_;  ///< 3×N, only with enclosures
};

}  // namespace trocar
