// libFuzzer's door to the target that this program was built for.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>

#include "fuzz_target.hpp"

namespace {

/// Where the fuzzer writes to: it closes stderr for what it tests.
int fuzzers_stderr = -1;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments);
extern "C" int LLVMFuzzerInitialize(int* /*count*/, char*** /*arguments*/) {
    fuzzers_stderr = dup(STDERR_FILENO);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        trocar::fuzz::TROCAR_FUZZ_TARGET(std::string_view(reinterpret_cast<const char*>(data), size));
    } catch (const std::exception& error) {
        dprintf(fuzzers_stderr, "FIND: %s\n", error.what());
        throw;
    }
    return 0;
}
