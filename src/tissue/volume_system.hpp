// What enclosures add to an implicit step: the matrix of each is of rank one over all its vertices and is added to what
// the linear system of the springs gives, by the formula of Sherman and Morrison.
#pragma once

#include <vector>

#include "tissue/moving_tissue.hpp"
#include "tissue/spring_system.hpp"

namespace trocar {

class VolumeSystem {
public:
    explicit VolumeSystem(MovingTissue& tissue);

    /// Linearises the enclosures at the state and takes their change by the velocities, over a step of h (s), from the
    /// right side; what the forces themselves do is in the state's constant ones. Does nothing where there are none.
    void add_to(double h, SpringSystem& system);
    /// For every enclosure the answer of the rest to its gradient. After the system is complete.
    void prepare_enclosures(double h, const SpringSystem& system, double tolerance, int iterations,
                            ConjugateGradients& gradients);
    /// What enclosures take from a change of velocity that the rest gives (m/s, 4 × vertices).
    void enclose(Matrix4X& change) const;

    /// One enclosure: `answer` is A⁻¹ gradient without it.
    struct Enclosed {
        Matrix4X gradient;    ///< m², of its volume; 0 for held vertices
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
