// Springs by vertex and by body: adjacency, strain and mean rest length.
#pragma once

#include <span>
#include <vector>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Springs at each vertex, so that a vertex's force takes time proportional to its own springs.
class VertexSprings {
public:
    void prepare(const Topology& topology, const Materials& materials);
    /// Indices of the springs at a vertex.
    [[nodiscard]] std::span<const Index> of(Index vertex) const {
        const auto v = static_cast<std::size_t>(vertex);
        return {spring_.data() + first_[v], static_cast<std::size_t>(first_[v + 1] - first_[v])};
    }
    /// Largest strain (1 = doubled length) of the springs at a vertex; 0 without any.
    [[nodiscard]] double largest_strain(const Materials& materials, const Matrix3X& position, Index vertex) const;

private:
    std::vector<Index> first_;  ///< N + 1
    std::vector<Index> spring_;
};

/// m, mean rest length of all springs. Precondition: there is one.
double mean_spring_length(const Materials& materials);
/// m, per body: mean rest length of a tissue's springs, 0 for other bodies.
std::vector<double> mean_spring_lengths(const Topology& topology, const Materials& materials);

}  // namespace trocar
