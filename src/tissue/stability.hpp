// How large a step the explicit integrator of the tissue bears: stiffness and damping of the linearised springs against
// the masses, by bounds, exactly, and by a proof that a step is too large.
#pragma once

#include <span>

#include "method/stepper.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Whether the integrator moves this vertex: it has mass and is not pinned.
bool is_free(const Materials& materials, Index vertex);

/// Largest angular frequency of the undamped system by Gershgorin rows of K/m over the free vertices (METHODS §4),
/// rad/s. `contact_stiffness` (N entries or empty, N/m) is added to the diagonal of its vertex.
/// The undamped step limit is 2/omega; with damping gamma: w² dt² + gamma dt · 2 < 4, see critical_time_step.
double gershgorin_bound_omega(const Materials& materials, const Matrix3X& position,
                              std::span<const double> contact_stiffness = {});

/// Stiffness of the linearised tissue applied to a displacement of the free vertices: K·displacement, 3×N, N. Pinned
/// and massless vertices count as fixed. K holds per spring its stiffness along it and tension/length across it, and
/// the tangents of enclosures.
void apply_stiffness(const Materials& materials, const Matrix3X& position, const Matrix3X& displacement,
                     Matrix3X& force);

/// Largest natural frequency of the linearised tissue and its mode.
struct LargestMode {
    double omega = 0.0;  ///< rad/s
    Matrix3X shape;      ///< 3×N, displacement of each vertex, largest entry 1
};
/// The exact counterpart of gershgorin_bound_omega: Lanczos iteration on M^-1/2 K M^-1/2 with full
/// re-orthogonalisation, to about 1e-12 relative.
LargestMode largest_mode(const Materials& materials, const Matrix3X& position);

/// Largest stable step of semi-implicit Euler with explicit damping, s: the root of omega² dt² + 2 rate dt = 4 with
/// 2 rate = `damping_rate` doubled, that is dt = (-c/m + sqrt((c/m)² + 4 omega²)) / omega² with damping_rate = c/m in
/// 1/s (the data's stab cases). Infinite for omega = 0 without damping.
double critical_time_step(double omega, double damping_rate);

/// Fewest sub-steps of a tick of dt that stay below the step limit by Gershgorin's bounds on stiffness and damping,
/// with 5 % to spare. Contacts need none: they are implicit.
int stable_substeps(const Materials& materials, const Matrix3X& position, double dt);

/// Whether semi-implicit Euler with explicit damping and the step h (s) is unstable for certain at this place: power
/// iteration finds a displacement x with h² xᵀKx + 2 h xᵀCx > 4 xᵀMx. False close to the limit or below it.
bool surely_unstable(const Materials& materials, const Matrix3X& position, double h);

/// The smallest step (s) that power iteration with the step h > 0 (s) proves unstable for semi-implicit Euler with
/// explicit damping at this place: the root of h² xᵀKx + 2 h xᵀCx = 4 xᵀMx for the worst displacement x met. Infinite
/// where nothing moves against a force. The exact limit is at most this, and for h near it close to this.
double unstable_step(const Materials& materials, const Matrix3X& position, double h);

/// What semi-implicit Euler with explicit damping bears: h² K + 2 h C < 4 M holds where it holds for every row's sum of
/// absolute values (Gershgorin), so that the smallest root over all rows is a stable step. `closely` as in
/// Stepper::estimate.
StepEstimate explicit_step(const Materials& materials, const Matrix3X& position, double dt, bool closely);

}  // namespace trocar
