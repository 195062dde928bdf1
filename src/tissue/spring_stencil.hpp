// Springs of a mesh that repeats, such as a sheet of rows: most vertices have springs at the same few offsets in the
// state. Springs of one offset are contiguous, and so are their ends. Vectors of neighbours then need no index, gather
// or transposition.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace trocar {

struct SpringArrays;

/// Allocates at cache line boundaries, so that no vector crosses two lines.
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

/// Springs by offset j - i: one column over the vertices i per offset, empty where there is no spring. The order of a
/// vertex's sum is that of SpringArrays: incoming by descending offset, then outgoing by ascending offset.
struct SpringStencil {
    static constexpr std::size_t group = 8;    ///< contiguous vertices; a vector holds all or half
    static constexpr std::size_t block = 256;  ///< vertices whose springs are evaluated before they move
    /// Columns of `work`. Not a multiple of a page, to avoid cache set conflicts between rows.
    static constexpr std::size_t window = 8192 + 72;
    static constexpr std::size_t longest = 2048;  ///< largest offset; both ends of a spring stay in the cache
    std::vector<std::size_t> offsets;             ///< ascending; empty: the springs do not repeat, all else is empty
    std::size_t groups = 0;
    /// Per offset and group: k, offset and damping of the springs as in SpringArrays, 0 where there is none.
    LineVector constants;
    /// Per group: outgoing, then incoming springs; one bit per offset and vertex.
    std::vector<std::uint8_t> present;
    std::size_t query_distance = 0;  ///< largest offset, rounded up to whole groups.
    /// Rows x y z of position and velocity around a block, then rows x y z of force per offset.
    LineVector work{};
    [[nodiscard]] bool empty() const { return offsets.empty(); }
};

/// Empty where a stencil would not pay, or would change the order of a sum.
SpringStencil spring_stencil(const SpringArrays& springs);

}  // namespace trocar
