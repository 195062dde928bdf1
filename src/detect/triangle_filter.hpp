// SIMD float filter for triangle pairs: which certainly meet, which certainly do not, and which need the exact test.
// near_filter.hpp adds which of the separate ones are within the query distance. A sign counts only above a proven
// error bound, so the filter is never wrong.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/contact.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// Up to 64 pairs of triangles p0 p1 p2 and q0 q1 q2 as differences of corners, taken in double and rounded to float.
/// Relative error of each: 1.001 · 2^-24. [axis][pair], m or any unit.
struct TriangleBatch {
    static constexpr std::size_t most = 64;
    using Lanes = std::array<std::array<float, most>, 3>;
    alignas(64) Lanes u1;  ///< p1 − p0
    alignas(64) Lanes v1;  ///< p2 − p0
    alignas(64) Lanes u2;  ///< q1 − q0
    alignas(64) Lanes v2;  ///< q2 − q0
    alignas(64) Lanes w;   ///< p0 − q0
};

/// Bit k belongs to pair k. Pairs in neither set do not meet.
struct TriangleVerdicts {
    std::uint64_t meet = 0;
    std::uint64_t undecided = 0;
};

/// For pairs that do not meet. Pairs in neither set are further apart than the query distance.
struct NearVerdicts {
    std::uint64_t near = 0;
    std::uint64_t undecided = 0;
};

/// Decides the pairs of a batch whose bits are set in `asked`. `query_distance`: query distance in the unit of the
/// batch, > 0.
using NearDecider = NearVerdicts (*)(const TriangleBatch& batch, std::uint64_t asked, float query_distance);

struct TriangleFilter {
    /// Fills a batch with `count` <= TriangleBatch::most pairs. `position`: x y z by vertex, m; `corners`: three
    /// vertices by triangle.
    void (*gather)(const double* position, const Index* corners, const TrianglePair* pairs, std::size_t count,
                   TriangleBatch& batch) = nullptr;
    /// Decides the first `count` pairs; the others may hold any numbers.
    TriangleVerdicts (*decide)(const TriangleBatch& batch, std::size_t count) = nullptr;
    NearDecider decide_near = nullptr;
    const char* target = "";  ///< instruction set, as Highway names it
};

/// One per instruction set that was built and that this CPU has, best first, scalar last.
const std::vector<TriangleFilter>& triangle_filters();

}  // namespace trocar
