// Interface of a stepper: integrates the tissue from a frame and a response output, and reports the contact forces. It
// does not depend on the response.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "contact/outcome.hpp"
#include "contact/response_output.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Bounds of a stepper's sub-step, and the cost of a tick. A step up to `stable_step` is certainly stable, one from
/// `unstable_step` on certainly unstable; between them nothing is proven. Contacts are excluded: steppers integrate
/// them implicitly, or report otherwise.
struct StepEstimate {
    double stable_step = std::numeric_limits<double>::infinity();           ///< s; infinite: any step is stable
    double stable_step_undamped = std::numeric_limits<double>::infinity();  ///< s, without damping
    double unstable_step = std::numeric_limits<double>::infinity();         ///< s; infinite: none is known
    int substeps = 1;                                                       ///< per tick, that the stepper takes
    int substeps_stable = 1;       ///< fewest with a step of at most stable_step
    bool damping_decides = false;  ///< explicit damping reduces stable_step more than stiffness does
    /// Vertex that determines stable_step, and its dominant edge; -1: none.
    Index vertex = -1;
    std::array<Index, 2> edge{-1, -1};
    double vertex_mass = 0.0;     ///< kg
    double edge_stiffness = 0.0;  ///< N/m
    double edge_damping = 0.0;    ///< N s/m
    std::int64_t springs = 0;     ///< evaluated per sub-step

    /// True if the sub-step of a tick of dt (s) is certainly unstable.
    [[nodiscard]] bool surely_unstable(double dt) const { return dt / substeps >= unstable_step; }
    [[nodiscard]] std::int64_t spring_evaluations() const { return springs * substeps; }  ///< per tick
};

class Stepper {
public:
    Stepper() = default;
    Stepper(const Stepper&) = delete;
    Stepper& operator=(const Stepper&) = delete;
    Stepper(Stepper&&) = delete;
    Stepper& operator=(Stepper&&) = delete;
    virtual ~Stepper() = default;

    /// Once per run, for scenes with tissue. Topology and materials outlive the stepper's use of them.
    virtual void prepare(const Topology& topology, const Materials& materials) = 0;
    /// After prepare, untimed: the tissue's state at the first advance. Without this call the stepper reads it in that
    /// advance.
    virtual void start(const Frame& /*first*/) {}
    /// Step bounds on tissue at `position` (3×N, m) in ticks of dt (s). Untimed; needs no prepare. unstable_step is
    /// computed if the sub-step exceeds stable_step, or if `closely`. The default is no bound.
    [[nodiscard]] virtual StepEstimate estimate(const Topology& /*topology*/, const Materials& /*materials*/,
                                                const Matrix3X& /*position*/, double /*dt*/, bool /*closely*/) const {
        return {};
    }
    /// Once per tick: integrates position and velocity of the tissue over dt (s) into `to`. `to.previous` becomes the
    /// start of the tick, position corrections included. Immovable vertices are not written. Adds to `reaction` (one
    /// per body) the mean over the tick of each contact's force on its reaction body; moments are about the world
    /// origin. When the outcome is not ok, `to` is unchanged.
    virtual Outcome advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                            std::vector<Wrench>& reaction) = 0;

    /// Before an advance. True: the stepper may skip the validation of its frames. `from` then has the tissue of the
    /// last advance, `to` that of one of the last three. False, as at the start: it validates.
    virtual void trust_frames(bool /*trusted*/) {}

    // Results of the last advance.
    /// True if part of the tissue in `to` is out of date; later ticks update it.
    [[nodiscard]] virtual bool leaves_behind() const { return false; }
    /// Updates that part in the frame, position and velocity, for the energy and momentum audit. Untimed; does not
    /// change the stepper.
    virtual void complete(Frame& /*frame*/) const {}
    /// Ranges of vertices whose position in `to` may differ from `from`, ascending; null: all tissue vertices.
    [[nodiscard]] virtual const std::vector<Range>* moved() const { return nullptr; }
    /// One per contact of the output; zero for contacts without tissue.
    [[nodiscard]] virtual std::span<const ContactForce> contact_forces() const = 0;
    [[nodiscard]] virtual double max_strain() const = 0;           ///< largest edge strain, 1 = doubled length
    [[nodiscard]] virtual std::int64_t limited_edges() const = 0;  ///< edges that the strain limit acted on
    /// m, bound on the displacement of vertices that may have met another body, position corrections included; 0 before
    /// the first advance. Out-of-date tissue far from all other bodies is excluded.
    [[nodiscard]] virtual double largest_move() const = 0;
};

}  // namespace trocar
