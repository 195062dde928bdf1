// Stability limit of the explicit tissue integrator from linearised stiffness, damping and masses. Gershgorin bounds,
// the exact largest frequency, and the proof that a step is unstable.
#pragma once

#include <span>

#include "method/stepper.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Bound on the angular frequency (rad/s) of the undamped system by Gershgorin rows of K/m over the free vertices
/// (METHODS §4). `contact_stiffness` (N entries or empty, N/m) is added to the diagonal of its vertex. The undamped
/// step limit is 2/omega; critical_time_step includes damping.
double gershgorin_bound_omega(const Materials& materials, const Matrix3X& position,
                              std::span<const double> contact_stiffness = {});

/// K·displacement of the linearised tissue over the free vertices, 3×N, N. Pinned and massless vertices are fixed. K
/// holds each spring's stiffness along it and tension/length across it, and the tangents of enclosures.
void apply_stiffness(const Materials& materials, const Matrix3X& position, const Matrix3X& displacement,
                     Matrix3X& force);

/// Largest natural frequency of the linearised tissue, with its mode.
struct LargestMode {
    double omega = 0.0;  ///< rad/s
    Matrix3X shape;      ///< 3×N, displacement of each vertex, largest entry 1
};
/// Exact counterpart of gershgorin_bound_omega: Lanczos iteration on M^-1/2 K M^-1/2 with full re-orthogonalisation, to
/// about 1e-12 relative.
LargestMode largest_mode(const Materials& materials, const Matrix3X& position);

/// Largest stable step dt (s) of semi-implicit Euler with explicit damping: omega² dt² + 2 damping_rate dt = 4.
/// Solved: dt = (-c/m + sqrt((c/m)² + 4 omega²)) / omega² with damping_rate = c/m in 1/s (the data's stab cases).
/// Infinite for omega = 0 without damping.
double critical_time_step(double omega, double damping_rate);

/// Fewest sub-steps of a tick of dt (s) below the step limit by Gershgorin bounds on stiffness and damping, with 5 %
/// margin. Contacts are implicit and need none.
int stable_substeps(const Materials& materials, const Matrix3X& position, double dt);

/// True if semi-implicit Euler with explicit damping and step h (s) is certainly unstable at `position`. Power
/// iteration searches a displacement x with h² xᵀKx + 2 h xᵀCx > 4 xᵀMx. False close to the limit or below it.
bool surely_unstable(const Materials& materials, const Matrix3X& position, double h);

/// Smallest step (s) that power iteration with h > 0 (s) proves unstable at `position`. For the worst x met it is the
/// root of h² xᵀKx + 2 h xᵀCx = 4 xᵀMx. An upper bound on the exact limit, and close to it for h near it. Infinite
/// where no displacement meets a force.
double unstable_step(const Materials& materials, const Matrix3X& position, double h);

/// Stable step of semi-implicit Euler with explicit damping, from h² K + 2 h C < 4 M by Gershgorin row sums. The result
/// is the smallest root over all rows. `closely` as in Stepper::estimate.
StepEstimate explicit_step(const Materials& materials, const Matrix3X& position, double dt, bool closely);

}  // namespace trocar
