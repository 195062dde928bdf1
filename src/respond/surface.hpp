// Neighbourhood of the surfaces: triangles at a vertex, vertex areas and normals.
#pragma once

#include <span>
#include <vector>

#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

class SurfaceNeighbours {
public:
    void prepare(const Topology& topology);
    /// Computes areas at the first call; later calls have no effect.
    void measure(const Topology& topology, const Matrix3X& position);
    [[nodiscard]] std::span<const Index> triangles_at(Index vertex) const {
        const auto v = static_cast<std::size_t>(vertex);
        return {triangle_.data() + first_[v], static_cast<std::size_t>(first_[v + 1] - first_[v])};
    }
    /// One third of the adjacent triangles' area when measured, m².
    [[nodiscard]] double area(Index vertex) const { return area_[static_cast<std::size_t>(vertex)]; }
    /// Unit, area-weighted mean of the adjacent outer normals; zero where they cancel.
    [[nodiscard]] Vector3 vertex_normal(const Topology& topology, const Matrix3X& position, Index vertex) const;
    /// Normalised barycentric blend of a triangle's corner normals, continuous along the surface (METHODS §5). On tools
    /// and bone it excludes faces across creases of more than 60 degrees. Returns the face normal if the blend deviates
    /// from it by more than 75 degrees (a sharp rim).
    [[nodiscard]] Vector3 blended_normal(const Topology& topology, const Matrix3X& position, Index triangle,
                                         const Vector3& weights) const;

private:
    std::vector<Index> first_;  ///< N + 1
    std::vector<Index> triangle_;
    std::vector<double> area_;
};

/// Outer normal times twice the area, m².
Vector3 area_normal(const Topology& topology, const Matrix3X& position, Index triangle);

}  // namespace trocar
