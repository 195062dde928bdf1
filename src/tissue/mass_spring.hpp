// The preloaded mass-spring tissue of thesis eq. 3.1 and its integrator: sub-stepped semi-implicit Euler in which every
// contact of the Effect is re-evaluated in every sub-step (METHODS §4). Constructed only when a scene has tissue.
#pragma once

#include <vector>

#include "contact/effect.hpp"
#include "contact/outcome.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Force of the tissue on each vertex: springs, preload, rest bias, damping, drag; 3×N, N. Contacts not included.
void internal_force(const Materials& materials, const Matrix3X& position, const Matrix3X& velocity, Matrix3X& force);

/// Largest angular frequency of the undamped system by Gershgorin rows of K/m (METHODS §4), rad/s; contact stiffness
/// per vertex may be added. The undamped step limit is 2/omega; with damping gamma: w² dt² + 2 gamma dt < 4.
double gershgorin_bound_omega(const Materials& materials, const Matrix3X& position);

class MassSpring {
public:
    MassSpring(const Topology& topology, const Materials& materials);
    /// Integrates the tissue vertices of `frame` over dt: reads effect, writes position and velocity (previous is left
    /// as the position at entry). Adds the mean force over the tick that each linear contact gave to its reaction body
    /// to `reaction` (one per body). Outcome unstable/not_finite when it blows up; the frame is then left as it was.
    Outcome advance(const Effect& effect, double dt, Frame& frame, std::vector<Wrench>& reaction);
    /// Largest edge strain after the last advance (1 = doubled length), and edges the limiter acted on.
    [[nodiscard]] double max_strain() const { return max_strain_; }
    [[nodiscard]] std::int64_t limited_edges() const { return limited_edges_; }

private:
    const Topology* topology_;
    const Materials* materials_;
    Matrix3X force_;
    double max_strain_ = 0.0;
    std::int64_t limited_edges_ = 0;
};

}  // namespace trocar
