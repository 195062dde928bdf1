// Makes the reference of a scene: five or more runs of the implicit solver for each law of contact, in which the step
// and the stiffness of contact are refined one at a time, and what they report about how far the finest one can be
// trusted.
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
    double rest_gap = 1e-5;     ///< m, hard
    int foundation_points = 4;  ///< along a triangle's edge, equal k
    // How often each may be halved further where no order shows yet.
    int more_steps = 2;
    int more_gaps = 1;
    int more_points = 1;
};

/// Reported before every run: what it is.
using ReferenceProgress = std::function<void(const std::string&)>;

/// Runs: with the step h and stiffness (rest gap g, or n points along a triangle's edge) of the plan: rest gaps 4g, 2g
/// and g at step 2h, steps 4h, 2h and h at the finest gap; each is halved further, as often as the plan allows, until
/// the force shows an order. The solution stored is the one of the finest step and stiffness, up to the moment until
/// which both refinements converge. Where an order is below 0.5 and the plan names no step, all this is done once more
/// with h / 4: the stored solution is that one if its orders are not, else the first with a bound that covers both.
/// Of a scene of turned k only equal k is solved. Origin holds the settings; the caller adds commit and command.
Reference build_reference(const Scene& scene, const ReferencePlan& plan, const ReferenceProgress& progress = {});

/// A law's observed order from three refinements and the bound on what is left: `coarse` and `fine` are the
/// differences between the first two and the last two. Converges with an order of at least 0.3, or where both are below
/// `floor`; the bound is then the larger one. Order NaN where fine >= coarse.
struct Observed {
    double order = ReferenceSolution::unset;
    double bound = ReferenceSolution::unset;  ///< Richardson: fine / (2^order - 1), order at most 2
    bool converges = false;
};
Observed observe_order(double coarse, double fine, double floor);

/// The most that a solution may be off where no order can be trusted: the largest difference between neighbouring
/// steps plus the largest between neighbouring stiffnesses.
double largest_changes(const std::array<double, 2>& by_time_step, const std::array<double, 2>& by_stiffness);

/// Widens the three bounds of a solution where the largest changes of `finer`, which has shorter steps, are more and
/// are known.
void widen_bounds(const ReferenceSolution& finer, ReferenceSolution& solution);

}  // namespace trocar
