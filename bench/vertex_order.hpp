// Renumbering of a mesh's vertices and triangles, once, before any method sees it. Every method gets the same
// numbering, so the gain or loss belongs to the scene and not to a method.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/types.hpp"
#include "scene/shapes.hpp"

namespace trocar::bench {

/// splitmix64 (Steele, Lea and Flood 2014): standard distributions differ between libraries, this does not.
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
    /// 0 … count-1; the bias of the remainder is below 2^-40 for any count of ours.
    std::size_t below(std::size_t count) { return static_cast<std::size_t>(next() % count); }
    /// In [-1, 1).
    double signed_unit() { return static_cast<double>(next() >> 11U) * 0x1p-52 - 1.0; }

private:
    std::uint64_t state_;
};

/// Vertices along the Morton curve of their positions, triangles along that of their centres. Entry k of the result is
/// the number that vertex k had before.
std::vector<Index> renumber_along_curve(Surface& surface);

/// A random permutation of both; result as above.
std::vector<Index> shuffle(Surface& surface, Random& random);

}  // namespace trocar::bench
