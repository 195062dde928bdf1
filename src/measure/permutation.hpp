// The same world reported differently: triangles, vertices or bodies in another order. What a method answers must not
// depend on it; the contract tests and the determinism metamorphic test both report worlds anew with this.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "contact/contact.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// A world in another order, and the way back.
struct Permutation {
    Topology topology;
    std::vector<Index> vertex;    ///< old number of every vertex
    std::vector<Index> triangle;  ///< old number of every triangle
    std::vector<Index> body;      ///< old number of every body

    [[nodiscard]] Frame permuted(const Frame& frame) const;
    /// Pairs of the world reported anew in the numbers of the original, smaller number first, sorted.
    [[nodiscard]] std::vector<TrianglePair> original(const std::vector<TrianglePair>& pairs) const;
};

enum class Shuffle : std::uint8_t { triangles, triangles_and_vertices };

/// Triangles (and vertices) of each body in a random order, corners turned cyclically by `seed`.
Permutation shuffled(const Topology& topology, std::uint32_t seed, Shuffle what);

/// The bodies in `order` (old numbers, each at most once; bodies that are left out are gone).
Permutation with_bodies_in_order(const Topology& topology, const std::vector<Index>& order);

/// The whole scene in the order of the permutation. Kinds of bodies must still be sorted and vertices of one body in
/// their own order, since a scene promises both.
Scene permuted(const Scene& scene, const Permutation& permutation);

/// Every length as a file in millimetres would bring it: times 1000, rounded, times 0.001, rounded.
Scene through_millimetres(const Scene& scene);

/// The whole scene shifted.
Scene moved(const Scene& scene, const Vector3& by);

/// Coordinates rounded to multiples of 2^-30 m: on it, a shift by a few metres and a factor of 1000 are exact.
Frame on_grid(const Frame& frame);
/// position * factor + by, with `previous` put there as well and no velocity.
Frame placed(const Frame& frame, double factor, const Vector3& by);

}  // namespace trocar
