// Counts the heap allocations of each thread by standing in for malloc and its kin, so that libraries in C and C++ are
// counted alike. Only the program does this; the library leaves its users' allocator alone. Sanitizers bring their own
// allocator, so nothing is counted under them.
#include <cerrno>
#include <cstddef>
#include <cstdint>

#include "measure/allocations.hpp"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define TROCAR_COUNTS_ALLOCATIONS 1
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#undef TROCAR_COUNTS_ALLOCATIONS
#endif
#endif
#endif

#ifdef TROCAR_COUNTS_ALLOCATIONS

// The C library's own entry points, which it exports for this purpose; their names are its choice.
// NOLINTBEGIN(bugprone-reserved-identifier)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace {
thread_local constinit std::int64_t allocations = 0;
}

extern "C" {
void* malloc(std::size_t size) {
    ++allocations;
    return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
    ++allocations;
    return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
    ++allocations;
    return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
    ++allocations;
    return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    ++allocations;
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    if (alignment < sizeof(void*) || (alignment & (alignment - 1)) != 0) return EINVAL;
    ++allocations;
    void* const memory = __libc_memalign(alignment, size);
    if (memory == nullptr) return ENOMEM;
    *out = memory;
    return 0;
}
}
// NOLINTEND(bugprone-reserved-identifier)

namespace {
const bool registered = [] {
    trocar::set_allocation_counter([]() -> std::int64_t { return allocations; });
    return true;
}();
}  // namespace

#endif
