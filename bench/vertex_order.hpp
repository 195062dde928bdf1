// Permutes the vertices and triangles of a mesh once, before any method prepares. All methods get the same order.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/types.hpp"
#include "scene/shapes.hpp"

namespace trocar::bench {

/// splitmix64 (Steele, Lea and Flood 2014). Unlike standard distributions, it is equal on every standard library.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t next() {
        state_ += 0x9E3779B97F4A7C15ULL;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
        z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
        return z ^ (z >> 31U);
    }
    /// Integer in 0 … count-1; the modulo bias is below 2^-40 for the counts used here.
    std::size_t below(std::size_t count) { return static_cast<std::size_t>(next() % count); }
    /// In [-1, 1).
    double signed_unit() { return static_cast<double>(next() >> 11U) * 0x1p-52 - 1.0; }

private:
    std::uint64_t state_;
};

/// Sorts vertices along the Morton curve of their positions, and triangles along that of their centres. Entry k of the
/// result is the old number of vertex k.
std::vector<Index> renumber_along_curve(Surface& surface);

/// Random permutation of both; result as above.
std::vector<Index> shuffle(Surface& surface, Random& random);

}  // namespace trocar::bench
