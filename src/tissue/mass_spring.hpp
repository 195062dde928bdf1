// The preloaded mass-spring tissue of thesis eq. 3.1 and its integrator: sub-stepped semi-implicit Euler in which every
// contact of the ResponseOutput is re-evaluated in every sub-step (METHODS §4). Constructed only when a scene has
// tissue.
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

/// Force of the tissue on each vertex: springs, preload, enclosures, rest bias, damping, drag; 3×N, N. Contacts not
/// included. `force` is resized only when its size is wrong.
void internal_force(const Materials& materials, const Matrix3X& position, const Matrix3X& velocity, Matrix3X& force);

/// Energy of one spring with its preload at a length (m), J.
double spring_energy(const Spring& spring, double length);

/// Energy of the forces of internal_force that have one (springs, preload, rest bias), J, up to a constant; 0 at no
/// particular place. Its slope at a vertex that is not pinned is the force without damping and drag.
double potential_energy(const Materials& materials, const Matrix3X& position);

/// Power that damping of springs and drag take from the vertices with `moves` set (one per vertex), W; negative where
/// what does not move by itself drives them.
double dissipated_power(const Materials& materials, const Matrix3X& position, const Matrix3X& velocity,
                        std::span<const std::uint8_t> moves);

/// Spring, preload and damping force of one spring on its vertex i (its vertex j gets the opposite), N. A spring of
/// zero length has no direction and gives none.
Vector3 spring_force(const Spring& spring, const Matrix3X& position, const Matrix3X& velocity);

class MassSpring {
public:
    /// Materials outlive the object.
    MassSpring(const Topology& topology, const Materials& materials);

    /// Integrates the tissue vertices of `frame` over dt: applies the position corrections, then Materials::substeps
    /// sub-steps. Writes position and velocity; previous becomes the position the sub-steps started from. Adds to
    /// `reaction` (one per body) the mean over the tick of what each contact force law gave to its reaction body;
    /// moments are about the world origin. Outcome unstable or not_finite when it blows up, also when it is only the
    /// strain limiter that keeps it from doing so; the frame is then left as it was.
    ///
    /// Damping of springs and drag are explicit, as in eq. 3.1; contacts are implicit (backward Euler on velocity and
    /// gap): all contacts of a sub-step are solved together, so that many contacts on one vertex share the load and
    /// their order does not matter. A contact that is not adhesive drops out where it would pull; an adhesive one acts
    /// while it penetrates; a damper or a grasp always. None gives more than its limit. A negative mu (eq. 3.6 as
    /// printed) is taken explicitly, because backward Euler with a large step would turn negative damping into
    /// positive. With ContactTiming::at_tick_start the force at the start of the tick acts throughout; with
    /// at_substep_start it is re-evaluated in every sub-step but from the state at its start. Friction
    /// (ContactForceLaw::friction) follows the normal force of the same sub-step: a tangential spring with a critical
    /// damper, implicit in its own vertices, that slides at friction × normal force. Its stretch is kept under slip_key
    /// for as long as a contact of that key is in every tick's effect.
    Outcome advance(const ResponseOutput& output, double dt, Frame& frame, std::vector<Wrench>& reaction);
    /// The same from one frame to another. What the tissue cannot move is not written.
    Outcome advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                    std::vector<Wrench>& reaction);

    /// Largest edge strain after the last advance (1 = doubled length), and edges the limiter acted on.
    [[nodiscard]] double max_strain() const { return tissue_.max_strain(); }
    [[nodiscard]] std::int64_t limited_edges() const { return tissue_.limited_edges(); }
    /// What contact i of the last advance's effect gave; zero for contacts without tissue.
    [[nodiscard]] std::span<const ContactForce> loads() const { return solver_.contacts().loads(); }
    /// m, no vertex has gone further in the last advance, position corrections included.
    [[nodiscard]] double largest_move() const { return largest_move_; }
    /// How often the last advance went through all its contacts: the contacts' share of its work, whose bound per
    /// sub-step does not depend on how many there are.
    [[nodiscard]] std::int64_t contact_passes() const { return solver_.passes(); }

private:
    Outcome integrate(const ResponseOutput& output, double dt, const Frame& frame);
    bool blows_up(double dt, const ResponseOutput& output, const Frame& frame);

    MovingTissue tissue_;
    ContactSolver solver_;
    std::vector<Vector3> position_before_;  ///< m, of the vertices in contact before a sub-step
    double largest_move_ = 0.0;
    std::int64_t limited_ticks_ = 0;
};

}  // namespace trocar
