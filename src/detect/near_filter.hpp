// SIMD float filter for near pairs: which are certainly within the query distance, and which certainly are not. Error
// bounds prove both; the search for closest points itself need not be exact.
#pragma once

#include <string_view>

#include "detect/triangle_filter.hpp"

namespace trocar {

/// The version for an instruction set, as Highway names it.
NearDecider near_decider_of(std::string_view target);

}  // namespace trocar
