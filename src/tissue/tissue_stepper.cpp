#include "tissue/tissue_stepper.hpp"

#include <cmath>

namespace trocar {

void TissueStepper::prepare(const Topology& topology, const Materials& materials) {
    tissue_.emplace(topology, materials);
    contacts_.emplace(topology.vertex_count, tissue_->state().size());
    is_first_ = true;
    largest_move_ = 0.0;
    prepare_steps();
}

StepEstimate TissueStepper::estimate(const Topology& /*topology*/, const Materials& materials,
                                     const Matrix3X& /*position*/, double /*dt*/, bool /*closely*/) const {
    StepEstimate estimate;
    estimate.substeps = steps_;
    estimate.springs = static_cast<std::int64_t>(materials.springs.size());
    return estimate;
}

Outcome TissueStepper::advance(const ResponseOutput& output, double dt, const Frame& from, Frame& to,
                               std::vector<Wrench>& reaction) {
    tissue_->take_over(output, from);
    if (is_first_) begin_run(from);
    is_first_ = false;
    contacts_->collect(output, from, tissue_->state());
    Outcome outcome = take_steps(output, dt, from);
    tissue_->release(output);
    if (!outcome.ok()) return outcome;
    tissue_->give_back(output, from, to);
    contacts_->react(reaction);
    return outcome;
}

Outcome TissueStepper::take_steps(const ResponseOutput& output, double dt, const Frame& from) {
    begin_tick();
    const double h = dt / steps_;
    const bool known = output.contact_timing != ContactTiming::implicit;
    double bound = 0.0;  // m, bound on the displacement of any coordinate in this tick
    for (int number = 0; number < steps_; ++number) {
        contacts_->begin_substep(tissue_->state());
        const double furthest = step(h, known);
        bound += furthest;
        Outcome outcome = tissue_->check(std::isfinite(furthest), bound, output, from);
        if (!outcome.ok()) return outcome;
    }
    tissue_->limit_strain();
    largest_move_ = tissue_->longest_path(from.position);
    return {};
}

}  // namespace trocar
