// Forces of tissue that resists a change of its enclosed volume, where the scene gives a bulk modulus (METHODS §4).
// Without one there are no enclosures and no cost.
#pragma once

#include <span>
#include <vector>

#include "geometry/enclosed_volume.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Adds the enclosures' forces (3×N, N): minus the gradient of volume_energy at `position` (3×N, m). Net force and net
/// moment of each enclosure are zero.
void add_volume_force(std::span<const Enclosure> enclosures, const Points& position, PointsOut force);

/// Energy (J), 0 at the rest volumes.
double volume_energy(std::span<const Enclosure> enclosures, const Points& position);

/// Over-pressure inside (Pa): -bulk_modulus (V - volume)/volume.
double pressure(const Enclosure& enclosure, const Points& position);

/// Adds the exact tangent applied to a displacement (3×N, m): minus the first-order change of the forces (N). It is not
/// positive semi-definite away from rest.
void add_volume_stiffness(std::span<const Enclosure> enclosures, const Points& position, const Points& displacement,
                          PointsOut force);

/// Adds bounds on the row sums of that tangent per vertex and axis (3×N, N/m). The rank-one part adds λ m with its
/// frequency λ = K/V0 Σ|g|²/m, because absolute entries would overestimate it by the number of vertices. The rest adds
/// absolute entries. inverse_mass: 1/kg per vertex; 0 = fixed, without row and column.
void add_volume_row_sums(std::span<const Enclosure> enclosures, const Points& position,
                         std::span<const double> inverse_mass, PointsOut rows);

/// Enclosures over the vertices of a stepper's state, with their stiffness linearised at one configuration. It is K/V0
/// g gᵀ with the volume gradient g: positive semi-definite, and exact at the rest volume.
class VolumeForces {
public:
    /// Linearised enclosure of rank one: stiffness · gradient gradientᵀ.
    struct LinearEnclosure {
        std::vector<Index> vertex;  ///< vertices of its triangles, ascending
        Matrix3X gradient;          ///< 3×n, m², volume gradient per entry of `vertex`
        double stiffness = 0.0;     ///< Pa/m³, K/V0
    };

    /// No enclosures.
    VolumeForces() = default;
    /// Enclosures of the materials. `place`: index of each frame vertex in the state; empty: the frame's own numbers.
    /// An enclosure with a vertex outside the state is left out.
    explicit VolumeForces(const Materials& materials, std::span<const Index> place = {});

    [[nodiscard]] bool none() const { return enclosures_.empty(); }
    [[nodiscard]] std::span<const Enclosure> enclosures() const { return enclosures_; }

    /// Linearises at `position` (3×N, m). Does not allocate.
    void linearise(const Points& position);
    [[nodiscard]] std::span<const LinearEnclosure> linear() const { return linear_; }

private:
    std::vector<Enclosure> enclosures_;
    std::vector<LinearEnclosure> linear_;
    Matrix3X gradient_;  ///< 3×N, only with enclosures
};

}  // namespace trocar
