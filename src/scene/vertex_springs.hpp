// Springs by vertex and by body: adjacency, strain and mean rest length.
#pragma once

#include <span>
#include <vector>

#include "geometry/index_lists.hpp"
#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Springs at each vertex, so that a vertex's force takes time proportional to its own springs.
class VertexSprings {
public:
    void prepare(const Topology& topology, const Materials& materials);
    /// Indices of the springs at a vertex.
    [[nodiscard]] std::span<const Index> of(Index vertex) const { return springs_.of(vertex); }
    /// Largest strain (1 = doubled length) of the springs at a vertex; 0 without any.
    [[nodiscard]] double largest_strain(const Materials& materials, const Matrix3X& position, Index vertex) const;

private:
    IndexLists springs_;  ///< by vertex
};

/// m, mean rest length of all springs. Precondition: there is one.
double mean_spring_length(const Materials& materials);
/// m, per body: mean rest length of a tissue's springs, 0 for other bodies.
std::vector<double> mean_spring_lengths(const Topology& topology, const Materials& materials);

}  // namespace trocar
