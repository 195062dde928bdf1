// Counts heap allocations inside timed stages, for own and foreign methods alike. The library never replaces anybody's
// allocator: the program brings a counting one and registers it here; without it the count is -1, "not counted".
#pragma once

#include <cstdint>

namespace trocar {

/// Allocations of the calling thread so far, -1 when nobody counts.
std::int64_t allocation_count();

/// Called once by a program that counts.
void set_allocation_counter(std::int64_t (*counter)());

}  // namespace trocar
