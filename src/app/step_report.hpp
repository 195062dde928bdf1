// Output of `trocar run --explain-step`.
#pragma once

#include <string>

#include "simulate/step_check.hpp"

namespace trocar::app {

/// Writes to stdout: text, or one JSON document. `stepper`: empty for the default one.
void print_step(const Scene& scene, const std::string& stepper, const StepCheck& check, bool json);

}  // namespace trocar::app
