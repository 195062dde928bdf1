// The part of the triangle filter that reports near pairs: which surely come within the query distance and which surely
// do not, many at once in float. Neither is taken from how closest points were found, but proved by what was found.
#pragma once

#include <string_view>

#include "detect/triangle_filter.hpp"

namespace trocar {

/// The version for an instruction set, as Highway names it.
NearDecider near_decider_of(std::string_view target);

}  // namespace trocar
