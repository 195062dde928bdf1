// Parameters of a scene that a study may vary without another scene file: tick, contact stiffness, integrator
// sub-steps.
#pragma once

#include <string>
#include <vector>

#include "scene/scene.hpp"

namespace trocar {

struct SceneKnob {
    std::string name;
    std::string unit;
    std::string meaning;
};
const std::vector<SceneKnob>& scene_knobs();

/// Applies e.g. "dt=0.0005,k=200" to the scene; its hash stays that of the file. A new dt keeps the length of the run.
/// It also keeps the length of a sub-step: their number per tick follows, at least 1. Throws InputError for an unknown
/// parameter, a value that is not positive, or a fractional number of sub-steps.
void apply_overrides(const std::string& overrides, Scene& scene);

/// Value of one parameter in the text; 0 when it is absent. Throws as above.
double override_value(const std::string& overrides, const std::string& knob);

}  // namespace trocar
