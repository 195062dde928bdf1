// Before a run: what step the scene's tissue and hands bear, what a tick costs, and whether the steps that are taken
// are unstable for certain.
#pragma once

#include <string>
#include <vector>

#include "method/stepper.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// A simulated operator without contact: semi-implicit Euler of one mass, so that the limit is exact.
struct OperatorStep {
    Index body = -1;              ///< first of the bodies it holds
    double stable_step = 0.0;     ///< s
    double most_stiffness = 0.0;  ///< N/m, of the hand at the step that is taken; 0: its damping alone is too much
    bool unstable = false;        ///< at the step that is taken
};

struct StepCheck {
    StepEstimate tissue;  ///< no bound where no tissue moves
    std::vector<OperatorStep> operators;
    int substeps = 1;  ///< taken by tissue and hands
    /// Any of them is unstable for certain.
    [[nodiscard]] bool unstable(double dt) const;
};

/// The scene in its first frame with this stepper (empty name: the default one). `closely` as in Stepper::estimate.
/// Throws InputError for an unknown or absent stepper or setting.
StepCheck check_step(const Scene& scene, const std::string& stepper, bool closely = false);

/// "vertex 12 of liver": its number in the body's files.
std::string vertex_name(const Scene& scene, Index vertex);

/// "vertex 12 of liver (x y z mm, 1.2 mg), edge 12-31 of 0.4 mm (k 95 N/m)": numbers of the body's files. Empty without
/// a vertex.
std::string deciding_place(const Scene& scene, const StepEstimate& estimate, const Matrix3X& position);

/// One line that says what is unstable, where, and what helps; empty where nothing is for certain.
std::string why_unstable(const Scene& scene, const StepCheck& check);

/// Fewest sub-steps a tick with which nothing of the check is unstable, tissue stable for certain; 0 where no number
/// that a scene may ask for is enough.
int stable_substeps(const Scene& scene, const StepCheck& check);

/// One line for scenes that take more than four sub-steps a tick, or fewer than are stable for certain; else empty.
std::string cost_note(const Scene& scene, const StepCheck& check);

/// What helps against a step that is too long; sub-steps only where the scene may ask for as many.
std::string step_remedy(const Scene& scene, const StepEstimate& estimate);

}  // namespace trocar
