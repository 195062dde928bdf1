#include "measure/tip_stiffness.hpp"

#include <cstddef>

#include "measure/statistics.hpp"

namespace trocar {
namespace {

constexpr double least_displacement = 1e-6;  // m

/// m, tip of the shown instrument on its script.
Vector3 scripted_tip(const Scene& scene, std::size_t body, double time) {
    const Pose pose = scene.bodies[body].motion->pose_at(time);
    return pose.rotation * scene.materials.tip[body] + pose.translation;
}

}  // namespace

TipStiffness tip_stiffness(const Scene& scene, const std::vector<StepRow>& rows) {
    const Index shown = shown_body(scene);
    const auto body = static_cast<std::size_t>(shown);
    const bool scripted = shown >= 0 && body < scene.bodies.size() && body < scene.materials.tip.size() &&
                          scene.bodies[body].motion && scene.bodies[body].motion->drive == Drive::prescribed;
    std::vector<double> steps;
    std::vector<double> stiffnesses;
    for (std::size_t i = 1; i < rows.size(); ++i) {
        const Vector3& before = rows[i - 1].tip_force;
        const Vector3& after = rows[i].tip_force;
        const double step = (after - before).norm();
        // A run that failed has no force in its last row.
        const bool in_contact = before.squaredNorm() > 0.0 || after.squaredNorm() > 0.0;
        if (!in_contact || !(step >= 0.0)) continue;
        steps.push_back(step);
        if (!scripted) continue;
        const double moved =
            (scripted_tip(scene, body, rows[i].time) - scripted_tip(scene, body, rows[i - 1].time)).norm();
        if (moved >= least_displacement) stiffnesses.push_back(step / moved);
    }
    return {.force_step_p999_n = quantile_with_ten_above(steps, 0.999),
            .stiffness_p999_n_per_m = quantile_with_ten_above(stiffnesses, 0.999)};
}

double passivity_damping(double stiffness, double period) { return 0.5 * stiffness * period; }

}  // namespace trocar
