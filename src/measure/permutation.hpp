// Permutes triangles, vertices or bodies of a scene, for metamorphic tests: answers of a method must not depend on
// their order.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "contact/contact.hpp"
#include "scene/scene.hpp"

namespace trocar {

/// A permuted world and the mapping to the original.
struct Permutation {
    Topology topology;
    std::vector<Index> vertex;    ///< old number of every vertex
    std::vector<Index> triangle;  ///< old number of every triangle
    std::vector<Index> body;      ///< old number of every body

    [[nodiscard]] Frame permuted(const Frame& frame) const;
    /// Pairs of the permuted world in original numbers, smaller number first, sorted.
    [[nodiscard]] std::vector<TrianglePair> original(const std::vector<TrianglePair>& pairs) const;
};

enum class Shuffle : std::uint8_t { triangles, triangles_and_vertices };

/// Permutes triangles (and vertices) of each body at random and rotates the corners by `seed`.
Permutation shuffled(const Topology& topology, std::uint32_t seed, Shuffle what);

/// Orders the bodies by `order` (old numbers, each at most once); bodies not listed are removed.
Permutation with_bodies_in_order(const Topology& topology, const std::vector<Index>& order);

/// Permutes the whole scene. Bodies must stay sorted by kind and vertices in their order within a body, since a scene
/// guarantees both.
Scene permuted(const Scene& scene, const Permutation& permutation);

/// Rounds every length as a file in millimetres does: times 1000, rounded, times 0.001, rounded.
Scene through_millimetres(const Scene& scene);

Scene moved(const Scene& scene, const Vector3& by);

/// Rounds coordinates to multiples of 2^-30 m, so that a shift by a few metres and a factor of 1000 are exact.
Frame on_grid(const Frame& frame);
/// position * factor + by; `previous` equals `position` and the velocity is 0.
Frame placed(const Frame& frame, double factor, const Vector3& by);

}  // namespace trocar
