// Broad phases over bodies, for the sweep over the number of bodies: FCL's dynamic tree, ODE's hash space, and
// all-pairs box tests. The narrow phase is the same for all.
#pragma once

#include <vector>

#include "methods.hpp"

namespace trocar::bench {

/// All broad phases of this build; absent ones go to `missing`. box_tests = body pairs from the broad phase plus
/// compared triangle boxes; triangle_tests = exact tests.
std::vector<Method> broad_phases(std::vector<Missing>& missing);

}  // namespace trocar::bench
