// Stepper `implicit`: linearly implicit Euler on all vertices (Baraff and Witkin 1998), with one linearisation of the
// springs per step. Contacts are solved with the tissue. The step size has no stability limit. Numerical damping
// suppresses motion that is faster than the step.
#include <memory>
#include <optional>
#include <vector>

#include "method/entry.hpp"
#include "tissue/implicit_system.hpp"
#include "tissue/node_level.hpp"
#include "tissue/tissue_stepper.hpp"

namespace trocar {
namespace {

class ImplicitStepper final : public TissueStepper {
public:
    ImplicitStepper(int steps, const ImplicitSystem::Accuracy& accuracy) : TissueStepper(steps), accuracy_(accuracy) {}

private:
    void prepare_steps() override {
        levels_.assign(1, level_of_vertices(tissue()));
        levels_.front().set_active(true);
        system_.emplace(tissue(), levels_);
    }

    double step(double h, bool known) override {
        if (system_->listed_for() != h) system_->list(h);
        tissue().add_volume_force();
        system_->linearise();
        system_->solve(known, steps(), accuracy_, contacts());
        const double furthest = system_->move() + contacts().shift(tissue());
        if (!contacts().all().empty()) contacts().finish_substep(h, steps(), tissue().state());
        return furthest;
    }

    ImplicitSystem::Accuracy accuracy_;
    std::vector<NodeLevel> levels_;  ///< the vertices alone, all active
    std::optional<ImplicitSystem> system_;
};

}  // namespace

StepperEntry implicit_stepper() {
    StepperEntry entry;
    entry.name = "implicit";
    entry.version = "2";
    entry.meaning = "linearly implicit Euler, one linearisation a step, contacts with the tissue's whole compliance";
    entry.takes_contact_force_laws = true;
    entry.takes_solved_contacts = true;
    entry.takes_position_corrections = true;
    entry.takes_held_forces = true;
    entry.parameters = {
        integer_parameter("steps", "1", 1, 1000, "steps a tick, each with a linearisation of its own"),
        number_parameter("tolerance", "1", "1e-5", 1e-14, 0.1,
                         "what a step leaves open of its momentum, as a part of what contacts give in it, or a tenth "
                         "of that, of all that acts"),
        integer_parameter("iterations", "1000", 1, 100000, "most iterations of conjugate gradients for one system")};
    entry.make = [](const ParameterValues& values) {
        return std::make_unique<ImplicitStepper>(
            static_cast<int>(values.integer("steps")),
            ImplicitSystem::Accuracy{.tolerance = values.number("tolerance"),
                                     .iterations = static_cast<int>(values.integer("iterations"))});
    };
    return entry;
}

}  // namespace trocar
