// Broad phases over bodies, for the sweep over the number of bodies: FCL's dynamic tree and ODE's hash space as their
// users run them, and the plain examine every two boxes. What follows the list of body pairs is the same for all, so
// that only broad phases differ.
#pragma once

#include <vector>

#include "methods.hpp"

namespace trocar::bench {

/// All that this build has; what it lacks goes to `missing`. In each, box_tests = body pairs handed over by the broad
/// phase (every two for the plain look) plus triangle boxes compared, triangle_tests = exact tests.
std::vector<Method> broad_phases(std::vector<Missing>& missing);

}  // namespace trocar::bench
