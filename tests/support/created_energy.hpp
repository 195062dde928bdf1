// Lower bound of numerically created energy, from trajectories, masses and tool forces. It is the gain of kinetic and
// spring energy of tissue plus the contact work on tools. Damping only dissipates, so a positive sum is created energy.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "scene/scene.hpp"
#include "simulate/simulation.hpp"
#include "support/energy.hpp"

namespace trocar::test {

/// Follows a run of non-rotating tools, from the first tick with a force on one of them.
class CreatedEnergy {
public:
    explicit CreatedEnergy(const Scene& scene) : scene_(&scene) {}

    void observe(const Simulation& simulation) {
        double work = 0.0;
        for (Index body = 0; body < scene_->topology.body_count(); ++body) {
            if (scene_->topology.bodies[at(body)].kind != BodyKind::instrument) continue;
            const Vector3& force = simulation.body_loads()[at(body)].force;
            constexpr double no_force = 1e-9;  // N, above the rounding error of an operator's free motion
            if (!before_ && force.norm() > no_force) before_ = energy_of(scene_->materials, simulation.seen());
            work += force.dot(step(body, simulation));
        }
        if (!before_) return;
        const double now = energy_of(scene_->materials, simulation.frame());
        sum_ += now - *before_ + work;
        before_ = now;
        largest_ = std::max(largest_, sum_);
        worked_ += std::abs(work);
    }
    [[nodiscard]] double largest() const { return largest_; }  ///< J
    /// largest() relative to the summed absolute work on the tools.
    [[nodiscard]] double share() const { return worked_ > 0.0 ? largest_ / worked_ : 0.0; }

private:
    /// Displacement of a tool in the tick, m: before the seen frame for a script, after it for an operator.
    [[nodiscard]] Vector3 step(Index body, const Simulation& simulation) const {
        const Index v = scene_->topology.bodies[at(body)].vertices.first;
        const std::optional<Motion>& motion = scene_->bodies[at(body)].motion;
        const Frame& seen = simulation.seen();
        if (motion && motion->drive == Drive::simulated_operator) {
            return simulation.frame().position.col(v) - seen.position.col(v);
        }
        return seen.position.col(v) - seen.previous.col(v);
    }
    const Scene* scene_;
    std::optional<double> before_;  ///< J, at the end of the last tick
    double sum_ = 0.0;
    double largest_ = 0.0;
    double worked_ = 0.0;
};

}  // namespace trocar::test
