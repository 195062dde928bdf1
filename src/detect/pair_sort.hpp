// Radix sort of a tick's pairs by (a, b). Triangle numbers differ in few bytes, so a few counting passes are faster
// than comparison. The time does not depend on the input order.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "contact/contact.hpp"

namespace trocar {

/// Precondition: triangle numbers are not negative. The caller keeps `scratch`, so that no tick allocates after
/// warm-up.
inline void sort_pairs(std::vector<TrianglePair>& pairs, std::vector<TrianglePair>& scratch) {
    constexpr std::size_t few = 48;
    if (pairs.size() < few) {
        std::sort(pairs.begin(), pairs.end());
        return;
    }
    const auto key = [](const TrianglePair& pair) {
        return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(pair.a)) << 32U) |
               static_cast<std::uint32_t>(pair.b);
    };
    std::uint64_t differing = 0;
    for (const TrianglePair& pair : pairs) differing |= key(pair) ^ key(pairs.front());
    scratch.resize(pairs.size());
    for (unsigned shift = 0; shift < 64; shift += 8) {
        if (((differing >> shift) & 0xFFU) == 0) continue;
        std::array<std::uint32_t, 256> place{};
        for (const TrianglePair& pair : pairs) ++place[(key(pair) >> shift) & 0xFFU];
        std::uint32_t before = 0;
        for (std::uint32_t& count : place) {
            const std::uint32_t own = count;
            count = before;
            before += own;
        }
        for (const TrianglePair& pair : pairs) scratch[place[(key(pair) >> shift) & 0xFFU]++] = pair;
        pairs.swap(scratch);
    }
}

}  // namespace trocar
