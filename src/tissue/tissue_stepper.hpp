// What steppers share that take their tick in equal steps: the way of a tick from frame to frame, and the checks on it.
// A stepper of this kind says how one step goes.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "method/stepper.hpp"
#include "tissue/moving_tissue.hpp"
#include "tissue/tick_contacts.hpp"

namespace trocar {

class TissueStepper : public Stepper {
public:
    void prepare(const Topology& topology, const Materials& materials) final;
    /// No bound: a step of any length is borne.
    [[nodiscard]] StepEstimate estimate(const Topology& topology, const Materials& materials, const Matrix3X& position,
                                        double dt, bool closely) const override;
    Outcome advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                    std::vector<Wrench>& reaction) final;
    [[nodiscard]] std::span<const ContactForce> loads() const final { return contacts_->loads(); }
    [[nodiscard]] double max_strain() const final { return tissue_->max_strain(); }
    [[nodiscard]] std::int64_t limited_edges() const final { return tissue_->limited_edges(); }
    [[nodiscard]] double largest_move() const final { return largest_move_; }

protected:
    explicit TissueStepper(int steps) : steps_(steps) {}

    /// Once per run, when the tissue is there.
    virtual void prepare_steps() = 0;
    /// Once per run, in the first tick: the tissue stands where `start` has it, position corrections done.
    virtual void begin_run(const Frame& /*start*/) {}
    /// Once per tick, before its first step.
    virtual void begin_tick() {}
    /// Takes the tissue over h (s). `known`: every contact gives what it holds; nothing has to be found. Gives the
    /// furthest that a coordinate has gone, m; not finite where the numbers are not.
    virtual double step(double h, bool known) = 0;

    [[nodiscard]] int steps() const { return steps_; }
    [[nodiscard]] MovingTissue& tissue() { return *tissue_; }
    [[nodiscard]] const MovingTissue& tissue() const { return *tissue_; }
    [[nodiscard]] TickContacts& contacts() { return *contacts_; }

private:
    Outcome take_steps(const ResponseOutput& output, double dt, const Frame& from);

    int steps_;
    std::optional<MovingTissue> tissue_;
    std::optional<TickContacts> contacts_;
    bool is_first_ = true;
    double largest_move_ = 0.0;
};

}  // namespace trocar
