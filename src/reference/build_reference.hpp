// Computes the reference of a scene: at least five runs of the implicit solver per contact law. Time step and contact
// stiffness are refined one at a time, and the differences bound the error of the finest run.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>

#include "reference/implicit_solver.hpp"
#include "reference/reference.hpp"

namespace trocar {

struct ReferencePlan {
    /// Step, s; absent: 2 ms, or 1 ms where a scripted vertex moves more than 0.25 mm in 2 ms.
    std::optional<double> time_step;
    double rest_gap = 1e-5;     ///< m, hard contact
    int foundation_points = 4;  ///< along a triangle's edge, equal k
    // Limits on further halvings while no order is observed.
    int more_steps = 2;
    int more_gaps = 1;
    int more_points = 1;
};

/// Called before every run with its description.
using ReferenceProgress = std::function<void(const std::string&)>;

/// Runs with the plan's step h and stiffness (rest gap g, or n points along a triangle's edge). Rest gaps are 4g, 2g
/// and g at step 2h; steps are 4h, 2h and h at the finest gap. Each is halved further, as the plan allows, until the
/// force shows an order. The stored solution has the finest step and stiffness, and ends where a refinement stops
/// converging. If an order is below 0.5 and the plan names no step, all runs repeat with h / 4. That solution is stored
/// if its orders suffice, else the first one with a bound that covers both. A scene with turned_k is solved for equal k
/// only. Origin holds the settings; the caller adds commit and command.
Reference build_reference(const Scene& scene, const ReferencePlan& plan, const ReferenceProgress& progress = {});

/// Observed order from three refinements and the bound on the remaining error. `coarse` and `fine` are the differences
/// of the first two and of the last two. Converges with an order of at least 0.3, or if both are below `floor`; the
/// bound is then the larger one. Order NaN where fine >= coarse.
struct Observed {
    double order = not_known;
    double bound = not_known;  ///< Richardson: fine / (2^order - 1), order at most 2
    bool converges = false;
};
Observed observe_order(double coarse, double fine, double floor);

/// Error bound where no order can be trusted: the largest difference of neighbouring steps plus the largest of
/// neighbouring stiffnesses.
double largest_changes(const std::array<double, 2>& by_time_step, const std::array<double, 2>& by_stiffness);

/// Widens the three bounds of a solution to the largest changes of `finer`, which has shorter steps, where these are
/// known and larger.
void widen_bounds(const ReferenceSolution& finer, ReferenceSolution& solution);

}  // namespace trocar
