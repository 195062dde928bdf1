// CPU time of the whole process with all its threads: other programs do not count, a helper thread does.
#pragma once

#include <cstdint>
#include <ctime>

namespace trocar {

/// ns.
inline std::int64_t process_cpu_ns() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1'000'000'000 * static_cast<std::int64_t>(now.tv_sec) + now.tv_nsec;
}

}  // namespace trocar
