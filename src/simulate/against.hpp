// A second stepper that runs the scene of a closed loop in step with the first, each with its own contacts. The
// differences are the error of a stepper that does not update the whole tissue at every tick, against one that does.
// Steppers of different code show what they make of one scene.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "measure/metric.hpp"
#include "simulate/simulation.hpp"

namespace trocar {

class Against {
public:
    static constexpr double near_limit = 0.015;  ///< m, rest distance from the first contact: near below
    static constexpr double far_limit = 0.05;    ///< m, far from here on

    /// `other`: the second simulation of the scene, which outlives the object.
    Against(const Scene& scene, std::unique_ptr<Simulation> other);
    /// Does a tick of the second simulation after a tick of `tested`, whose row is `row`.
    void follow(const Simulation& tested, const StepRow& row);
    /// Failure of the second simulation.
    [[nodiscard]] const Outcome& outcome() const { return other_->outcome(); }
    [[nodiscard]] Summary figures() const;

private:
    void find_contact(const ContactSet& contacts);

    const Scene* scene_;
    std::unique_ptr<Simulation> other_;
    std::optional<Vector3> contact_;  ///< m, at rest, where tissue first meets another body
    std::vector<double> difference_;  ///< m, per vertex, largest over the ticks
    std::vector<double> path_;        ///< m, per vertex, largest displacement from rest in the second simulation
    std::vector<double> advance_ns_;  ///< of the second simulation
    double force_square_sum_ = 0.0;   ///< N²
    double force_max_ = 0.0;          ///< N
    std::int64_t ticks_ = 0;
};

}  // namespace trocar
