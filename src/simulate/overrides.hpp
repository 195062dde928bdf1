// Parameters of a scene that a study may vary without another scene file: tick, contact stiffness, integrator
// sub-steps, cycles of the motion, dither.
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
/// It also keeps the length of a sub-step: their number per tick follows, at least 1. Cycles repeat the motion of the
/// one body that has one, each turned about z by the golden angle, so that no two are equal; a cycle lasts until its
/// last key plus 0.1 s for the return, and the run lasts all cycles. A dither displaces all bodies that follow a script
/// exactly by that length at every tick but the first. The direction is one of the eight diagonals of the axes, drawn
/// by the scene's seed. Throws InputError for an unknown parameter, a value that is not positive, and a fractional
/// number of sub-steps or cycles. The same for cycles of a scene without exactly one motion and a dither without a
/// script.
void apply_overrides(const std::string& overrides, Scene& scene);

/// Value of one parameter in the text; 0 when it is absent. Throws as above.
double override_value(const std::string& overrides, const std::string& knob);

}  // namespace trocar
