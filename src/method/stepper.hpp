// The interface of a stepper: from a frame and a response output to the tissue of the next frame and what every contact
// carried. It does not ask who made the output, so that every response is integrated in the same way.
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

/// How large a sub-step a stepper bears on tissue in one place, and what a tick costs it. A step up to `stable_step` is
/// stable for certain, one of `unstable_step` or more unstable for certain; what lies between is not known. Contacts
/// are in neither: steppers take them implicitly, or report so.
struct StepEstimate {
    double stable_step = std::numeric_limits<double>::infinity();           ///< s; infinite: any step is stable
    double stable_step_undamped = std::numeric_limits<double>::infinity();  ///< s, if nothing were damped
    double unstable_step = std::numeric_limits<double>::infinity();         ///< s; infinite: none is known
    int substeps = 1;                                                       ///< that the stepper takes in a tick
    int substeps_stable = 1;                                                ///< fewest of stable_step or less
    bool damping_decides = false;  ///< explicit damping takes more of stable_step than stiffness does
    /// Vertex that decides on stable_step and its edge that weighs most; -1: none.
    Index vertex = -1;
    std::array<Index, 2> edge{-1, -1};
    double vertex_mass = 0.0;     ///< kg
    double edge_stiffness = 0.0;  ///< N/m
    double edge_damping = 0.0;    ///< N s/m
    std::int64_t springs = 0;     ///< evaluated in a sub-step

    /// Of a tick of dt (s): what the stepper takes is unstable for certain.
    [[nodiscard]] bool surely_unstable(double dt) const { return dt / substeps >= unstable_step; }
    [[nodiscard]] std::int64_t spring_evaluations() const { return springs * substeps; }  ///< in a tick
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
    /// After prepare and outside the clock: where the tissue will be when the first advance begins. A stepper that is
    /// not reported sees it then.
    virtual void start(const Frame& /*first*/) {}
    /// What step this stepper bears on tissue at `position` (3×N, m) in ticks of dt (s); asked outside the loop, of a
    /// stepper that need not be prepared. unstable_step is searched for where its sub-step exceeds stable_step, and
    /// `closely` in any case. By default there is no bound.
    [[nodiscard]] virtual StepEstimate estimate(const Topology& /*topology*/, const Materials& /*materials*/,
                                                const Matrix3X& /*position*/, double /*dt*/, bool /*closely*/) const {
        return {};
    }
    /// Once per tick: moves the tissue from one frame to the other over dt (s): position and velocity; previous becomes
    /// the place from which the tick started, position corrections done. What the tissue cannot move is not written.
    /// Adds to `reaction` (one per body) the mean over the tick of what each contact force law gave to its reaction
    /// body; moments are about the world origin. When the outcome is not ok, `to` is left as it was.
    virtual Outcome advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                            std::vector<Wrench>& reaction) = 0;

    /// Before an advance whose frames the stepper need not look through. True: `from` has the tissue that the last
    /// advance has written, `to` the same or that of one of the two before. False, as at the start: it has to look.
    virtual void trust_frames(bool /*trusted*/) {}

    // Of the last advance.
    /// Whether it has left some of the tissue in `to` behind, to be followed in later ticks.
    [[nodiscard]] virtual bool leaves_behind() const { return false; }
    /// Puts what it has left behind into that frame, place and velocity, as if nothing were late; asked outside the
    /// clock, for the energy and the momentum of the whole. Changes nothing in what the stepper does.
    virtual void complete(Frame& /*frame*/) const {}
    /// Ranges of vertices that it may have given another place in `to` than in `from`, ascending; null: any of the
    /// tissue's.
    [[nodiscard]] virtual const std::vector<Range>* moved() const { return nullptr; }
    /// One per contact of its effect; zero for contacts that no tissue takes part in.
    [[nodiscard]] virtual std::span<const ContactForce> contact_forces() const = 0;
    [[nodiscard]] virtual double max_strain() const = 0;           ///< largest of an edge, 1 = doubled length
    [[nodiscard]] virtual std::int64_t limited_edges() const = 0;  ///< edges that the strain limit acted on
    /// m, no vertex that may have met another body on the way has gone further, position corrections included; 0 before
    /// the first. What a stepper has left behind and puts far from all others is no reason to look further around the
    /// tools.
    [[nodiscard]] virtual double largest_move() const = 0;
};

}  // namespace trocar
