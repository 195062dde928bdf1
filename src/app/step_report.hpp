// What `trocar run --explain-step` prints.
#pragma once

#include <string>

#include "simulate/step_check.hpp"

namespace trocar::app {

/// To stdout: text, or one JSON document. `stepper` may be empty: the default one.
void print_step(const Scene& scene, const std::string& stepper, const StepCheck& check, bool json);

}  // namespace trocar::app
