// Adds enclosures to an implicit step. Each one's matrix has rank one over all its vertices and enters the solution of
// the spring system by the Sherman–Morrison formula.
#pragma once

#include <vector>

#include "tissue/moving_tissue.hpp"
#include "tissue/spring_system.hpp"

namespace trocar {

class VolumeSystem {
public:
    explicit VolumeSystem(MovingTissue& tissue);

    /// Linearises the enclosures at the state and subtracts h² K v from the right side, for a step of h (s). Their
    /// forces are already in the state's constant forces. Does nothing without enclosures.
    void add_to(double h, SpringSystem& system);
    /// Solves the spring system for the gradient of every enclosure. The system must be complete.
    void prepare_enclosures(double h, const SpringSystem& system, double tolerance, int iterations,
                            ConjugateGradients& gradients);
    /// Applies the enclosures' correction to a velocity change of the spring system (m/s, 4 × vertices).
    void enclose(Matrix4X& change) const;

    /// `answer` is A⁻¹ gradient, with A of the springs alone.
    struct Enclosed {
        Matrix4X gradient;    ///< m², volume gradient; 0 for fixed vertices
        Matrix4X answer;      ///< m²/kg
        double factor = 0.0;  ///< c / (1 + c gradient · answer) with c = h² K/V0, kg/m⁴
    };
    [[nodiscard]] const std::vector<Enclosed>& enclosures() const { return enclosures_; }

private:
    MovingTissue* tissue_;
    std::vector<Enclosed> enclosures_;
    Matrix3X moved_, product_;  ///< 3 × vertices; only with enclosures
};

}  // namespace trocar
