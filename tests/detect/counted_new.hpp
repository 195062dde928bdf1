// Counts heap allocations of the whole test program, the library's included: the operators that counted_new.cpp defines
// replace everyone's.
#pragma once

namespace trocar::test {

/// Calls of operator new since the program started.
long allocation_count();

}  // namespace trocar::test
