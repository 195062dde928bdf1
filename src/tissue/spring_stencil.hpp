// Springs of a mesh that repeats, such as a sheet of rows: most vertices have a spring to the vertices at the same few
// offsets in the state. Springs of one offset then stand side by side, and so do their ends: vectors of neighbours are
// read and written in one go, without index, gather or transposition.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace trocar {

struct SpringArrays;

/// Memory from the start of a line of the cache: vectors then lie in one line each, not across two.
template <typename T>
struct LineAllocator {
    using value_type = T;
    static constexpr std::align_val_t line{64};
    LineAllocator() = default;
    template <typename U>
    LineAllocator(const LineAllocator<U>& /*other*/) {}
    T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), line)); }
    void deallocate(T* memory, std::size_t /*n*/) { ::operator delete(memory, line); }
    friend bool operator==(const LineAllocator& /*one*/, const LineAllocator& /*other*/) { return true; }
};
using LineVector = std::vector<double, LineAllocator<double>>;

/// Springs by offset j - i: those of one offset are a column over the vertices i, empty where there is none. The order
/// of a vertex's sum is that of SpringArrays: incoming by descending, then outgoing by ascending offset.
struct SpringStencil {
    static constexpr std::size_t group = 8;    ///< vertices side by side; a vector takes all or half
    static constexpr std::size_t block = 256;  ///< vertices whose springs are found before they move
    /// Columns of `work`. No multiple of a page, or all its arrays would share the same lines of the cache.
    static constexpr std::size_t window = 8192 + 72;
    static constexpr std::size_t longest = 2048;  ///< offset: what lies between the ends of a spring stays in the cache
    std::vector<std::size_t> offsets;  ///< ascending; empty: the springs do not repeat, nothing else is filled
    std::size_t groups = 0;
    /// Per offset and group k, offset and damping of its springs as in SpringArrays, 0 where there is none.
    LineVector constants;
    /// Per group first outgoing, then incoming springs: for each offset one bit per vertex that has one.
    std::vector<std::uint8_t> present;
    std::size_t query_distance = 0;  ///< largest offset, rounded up to groups
    /// Rows x y z and those of the velocity of the vertices around a block, then forces x y z per offset.
    LineVector work{};
    [[nodiscard]] bool empty() const { return offsets.empty(); }
};

/// Empty where going by offsets would not pay, or would change the order of a sum.
SpringStencil spring_stencil(const SpringArrays& springs);

}  // namespace trocar
