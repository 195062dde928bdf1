// Counts heap allocations inside timed stages, for own and foreign methods alike. The library never replaces the
// caller's allocator: a program registers its own counter here. Without one the count is -1, "not counted".
#pragma once

#include <cstdint>

namespace trocar {

/// Allocations of the calling thread so far; -1 without a counter.
std::int64_t allocation_count();

void set_allocation_counter(std::int64_t (*counter)());

}  // namespace trocar
