// Force and stiffness that a device meets at the tip of the instrument, from tick to tick.
#pragma once

#include <vector>

#include "geometry/types.hpp"
#include "measure/step_row.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// Quantiles at 99.9 % over ticks with contact at their start or end. NaN: fewer than 10 000 of them.
struct TipStiffness {
    double force_step_p999_n = not_known;
    /// |change of force| / |displacement| of the tip, where its script moves it by at least 1 µm. A spring K with a
    /// damper B has K + 2 B / T when the tip moves to and fro from tick to tick. NaN as well where an operator holds
    /// the instrument.
    double stiffness_p999_n_per_m = not_known;
};

/// `rows`: consecutive ticks. The force is that at the tip before the device's limiters (StepRow::tip_force).
TipStiffness tip_stiffness(const Scene& scene, const std::vector<StepRow>& rows);

/// N s/m, damping that a device needs to be passive against a wall of `stiffness` (N/m) whose force changes every
/// `period` s: K T / 2. Colgate and Schenkel, "Passivity of a class of sampled-data systems", J. Robotic Systems 14(1),
/// 1997.
double passivity_damping(double stiffness, double period);

}  // namespace trocar
