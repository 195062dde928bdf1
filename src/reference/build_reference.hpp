// Makes the reference of a scene: five runs of the implicit solver for each law of contact, in which the step and the
// stiffness of contact are refined one at a time, and what they tell about how far the finest one can be trusted.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "reference/implicit_solver.hpp"
#include "reference/reference.hpp"

namespace trocar {

struct ReferencePlan {
    /// Finest step, s; absent: 2 ms, or 1 ms where a scripted vertex moves more than 0.25 mm in 2 ms.
    std::optional<double> time_step;
    double rest_gap = 1e-5;     ///< m, finest, hard
    int foundation_points = 4;  ///< finest, equal k
};

/// Told before every run: what it is.
using ReferenceProgress = std::function<void(const std::string&)>;

/// Runs: steps h, 2h, 4h with the finest stiffness (rest gap g; n points along a triangle's edge), and step 2h with
/// rest gaps 2g and 4g (n/2 and n/4 points). The solution stored is the one of step h with the finest stiffness. Origin
/// holds the settings; the caller adds commit and command.
Reference build_reference(const Scene& scene, const ReferencePlan& plan, const ReferenceProgress& progress = {});

/// A law's observed order from three refinements and the bound on what is left: `coarse` and `fine` are the
/// differences between the first two and the last two. Converges with an order of at least 0.3, or where both are below
/// `floor`; the bound is then the larger one. Order NaN where fine >= coarse.
struct Observed {
    double order = ReferenceSolution::unset;
    double bound = ReferenceSolution::unset;  ///< Richardson: fine / (2^order - 1), order at most 2 and at least 0.5
    bool converges = false;
};
Observed observe_order(double coarse, double fine, double floor);

}  // namespace trocar
