// Check before a run: stable step of tissue and operators, cost of a tick, and whether the steps are certainly
// unstable.
#pragma once

#include <string>
#include <vector>

#include "method/stepper.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// A simulated operator without contact: semi-implicit Euler of one mass, so that the limit is exact.
struct OperatorStep {
    Index body = -1;              ///< first of its bodies
    double stable_step = 0.0;     ///< s
    double most_stiffness = 0.0;  ///< N/m, stability limit at the step taken; 0: damping alone exceeds the limit
    bool unstable = false;        ///< at the step taken
};

struct StepCheck {
    StepEstimate tissue;  ///< no bound without tissue
    std::vector<OperatorStep> operators;
    int substeps = 1;  ///< per tick, for tissue and operators
    /// Tissue or an operator is certainly unstable.
    [[nodiscard]] bool unstable(double dt) const;
};

/// Checks the scene's first frame with this stepper (empty name: the default one). `closely` as in Stepper::estimate.
/// Throws InputError for an unknown or absent stepper or setting.
StepCheck check_step(const Scene& scene, const std::string& stepper, bool closely = false);

/// "vertex 12 of liver": its number in the body's files.
std::string vertex_name(const Scene& scene, Index vertex);

/// E.g. "vertex 12 of liver (x y z mm, 1.2 mg), edge 12-31 of 0.4 mm (95 N/m, 0.1 N s/m)". Numbers are those of the
/// body's files. Empty without a vertex.
std::string deciding_place(const Scene& scene, const StepEstimate& estimate, const Matrix3X& position);

/// One line with the unstable part, its place and a remedy; empty where nothing is certainly unstable.
std::string why_unstable(const Scene& scene, const StepCheck& check);

/// Sub-steps per tick that remove every certain instability; for unstable tissue, the smallest number proven stable. 0
/// where no allowed number suffices.
int stable_substeps(const Scene& scene, const StepCheck& check);

/// One line for scenes with more than four sub-steps per tick, or fewer than are certainly stable; else empty.
std::string cost_note(const Scene& scene, const StepCheck& check);

/// Remedy for a step that is too long. It names a number of sub-steps only where a scene may have as many.
std::string step_remedy(const Scene& scene, const StepEstimate& estimate);

}  // namespace trocar
