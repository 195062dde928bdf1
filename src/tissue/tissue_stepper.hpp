// Base of steppers that divide a tick into equal steps: reads and writes frames and checks the tick. A derived class
// implements one step.
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
    /// Infinite stable step: any step is stable.
    [[nodiscard]] StepEstimate estimate(const Topology& topology, const Materials& materials, const Matrix3X& position,
                                        double dt, bool closely) const override;
    Outcome advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                    std::vector<Wrench>& reaction) final;
    [[nodiscard]] std::span<const ContactForce> contact_forces() const final { return contacts_->contact_forces(); }
    [[nodiscard]] double max_strain() const final { return tissue_->max_strain(); }
    [[nodiscard]] std::int64_t limited_edges() const final { return tissue_->limited_edges(); }
    [[nodiscard]] double largest_move() const final { return largest_move_; }

protected:
    explicit TissueStepper(int steps) : steps_(steps) {}

    /// Called once per run, after the tissue is built.
    virtual void prepare_steps() = 0;
    /// Called once per run, in the first tick: the tissue equals `start` with position corrections applied.
    virtual void begin_run(const Frame& /*start*/) {}
    /// Called once per tick, before the first step.
    virtual void begin_tick() {}
    /// Advances the tissue by h (s). `known`: every contact exerts its `held` force. Returns a bound on the
    /// displacement of any coordinate, m; not finite if the state is not.
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
