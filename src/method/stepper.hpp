// The interface of a stepper: from a frame and an effect to the tissue of the next frame and what every contact
// carried. It does not ask who made the effect, so that every response is integrated in the same way.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contact/effect.hpp"
#include "contact/outcome.hpp"
#include "scene/world.hpp"

namespace trocar {

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
    /// Once per tick: moves the tissue from one frame to the other over dt (s): position and velocity; previous becomes
    /// the place from which the tick started, placements done. What the tissue cannot move is not written. Adds to
    /// `reaction` (one per body) the mean over the tick of what each linear contact gave to its reaction body; moments
    /// are about the world origin. When the outcome is not ok, `to` is left as it was.
    virtual Outcome advance(const Effect& effect, double dt, const Frame& from, Frame& to,
                            std::vector<Wrench>& reaction) = 0;

    // Of the last advance.
    /// One per contact of its effect; zero for contacts that no tissue takes part in.
    [[nodiscard]] virtual std::span<const ContactLoad> loads() const = 0;
    [[nodiscard]] virtual double max_strain() const = 0;           ///< largest of an edge, 1 = doubled length
    [[nodiscard]] virtual std::int64_t limited_edges() const = 0;  ///< edges that the strain limit acted on
    /// m, no vertex has gone further, placements included; 0 before the first.
    [[nodiscard]] virtual double largest_move() const = 0;
};

}  // namespace trocar
