// Preloaded mass-spring tissue of thesis eq. 3.1, integrated by sub-stepped semi-implicit Euler (METHODS §4). Every
// contact of the ResponseOutput is re-evaluated in every sub-step. Constructed only when a scene has tissue.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contact/outcome.hpp"
#include "contact/response_output.hpp"
#include "scene/world.hpp"
#include "tissue/contact_solver.hpp"
#include "tissue/moving_tissue.hpp"
#include "tissue/stability.hpp"
#include "tissue/volume_forces.hpp"

namespace trocar {

/// Force on each vertex (3×N, N) from springs, preload, enclosures, rest bias, damping and drag; contacts excluded.
/// `force` is resized only when its size is wrong.
void internal_force(const Materials& materials, const Matrix3X& position, const Matrix3X& velocity, Matrix3X& force);

/// Energy (J) of one spring with its preload at `length` (m).
double spring_energy(const Spring& spring, double length);

/// Energy (J) of springs, preload, enclosures and rest bias, up to a constant. Its negative gradient at a vertex that
/// is not pinned is the force without damping and drag.
double potential_energy(const Materials& materials, const Matrix3X& position);

/// Power (W) dissipated by spring damping and drag at vertices with `moves` set (one entry per vertex). Negative where
/// other vertices drive them.
double dissipated_power(const Materials& materials, const Matrix3X& position, const Matrix3X& velocity,
                        std::span<const std::uint8_t> moves);

/// Elastic, preload and damping force (N) of one spring on vertex i; vertex j gets the opposite. Zero for a spring of
/// zero length, which has no direction.
Vector3 spring_force(const Spring& spring, const Matrix3X& position, const Matrix3X& velocity);

class MassSpring {
public:
    /// Materials outlive the object.
    MassSpring(const Topology& topology, const Materials& materials);

    /// Integrates the tissue vertices of `frame` over dt (s): applies the position corrections, then
    /// Materials::substeps sub-steps. Writes position and velocity; `previous` becomes the position at the start of the
    /// sub-steps. Adds to `reaction` (one per body) each contact force law's mean force over the tick on its reaction
    /// body; moments are about the world origin. Returns unstable or not_finite when the scheme blows up, even if the
    /// strain limiter hides it; `frame` is then unchanged.
    ///
    /// Damping of springs and drag are explicit, as in eq. 3.1. Contacts are implicit (backward Euler on velocity and
    /// gap). All contacts of a sub-step are solved together, so their order does not matter. A contact that is not
    /// adhesive never pulls; an adhesive one acts while it penetrates; a damper or grasp acts always. No force exceeds
    /// its limit. A negative mu (eq. 3.6 as printed) is explicit, because backward Euler with a large step turns
    /// negative damping into positive. ContactTiming::at_tick_start applies the force at the start of the tick
    /// throughout; at_substep_start evaluates it at the start of each sub-step. Friction (ContactForceLaw::friction) is
    /// a tangential spring with a critical damper, implicit in its own vertices. It slides at friction × normal force
    /// of the same sub-step. Its stretch is kept under slip_key while every tick's effect has a contact of that key.
    Outcome advance(const ResponseOutput& output, double dt, Frame& frame, std::vector<Wrench>& reaction);
    /// As above, from one frame to another. Vertices outside the tissue state are not written.
    Outcome advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                    std::vector<Wrench>& reaction);

    /// Largest edge strain after the last advance (1 = doubled length), and number of edges shortened by the limiter.
    [[nodiscard]] double max_strain() const { return tissue_.max_strain(); }
    [[nodiscard]] std::int64_t limited_edges() const { return tissue_.limited_edges(); }
    /// Result of each contact of the last advance's effect; zero for contacts without tissue.
    [[nodiscard]] std::span<const ContactForce> contact_forces() const { return solver_.contacts().contact_forces(); }
    /// m, bound on the displacement of any vertex in the last advance, position corrections included.
    [[nodiscard]] double largest_move() const { return largest_move_; }
    /// Passes over all contacts in the last advance. Their bound per sub-step does not depend on the number of
    /// contacts.
    [[nodiscard]] std::int64_t contact_passes() const { return solver_.passes(); }

private:
    Outcome integrate(const ResponseOutput& output, double dt, const Frame& frame);
    bool blows_up(double dt, const ResponseOutput& output, const Frame& frame);

    MovingTissue tissue_;
    ContactSolver solver_;
    std::vector<Vector3> position_before_;  ///< m, of the vertices in contact, before a sub-step
    double largest_move_ = 0.0;
    std::int64_t limited_ticks_ = 0;
};

}  // namespace trocar
