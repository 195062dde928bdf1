// Knobs of a scene that a study may turn without writing another scene file: the tick, the stiffness of contact, the
// integrator's sub-steps.
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

/// Applies "dt=0.0005,k=200" to the scene; its hash stays that of the file. A new dt keeps the length of the run and of
/// the integrator's sub-step (their number per tick follows, at least 1). Throws InputError for an unknown knob, a
/// value that is not positive, or sub-steps that are not a whole number.
void apply_overrides(const std::string& overrides, Scene& scene);

/// Value of one knob in the text; 0 when it is not turned. Throws as above.
double override_value(const std::string& overrides, const std::string& knob);

}  // namespace trocar
