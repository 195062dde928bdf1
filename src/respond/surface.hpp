// Neighbourhood of the surfaces: triangles at a vertex, vertex areas and normals.
#pragma once

#include <span>
#include <vector>

#include "geometry/index_lists.hpp"
#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

class SurfaceNeighbours {
public:
    void prepare(const Topology& topology);
    /// Computes areas at the first call; later calls have no effect.
    void measure(const Topology& topology, const Matrix3X& position);
    [[nodiscard]] std::span<const Index> triangles_at(Index vertex) const { return triangles_.of(vertex); }
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
    IndexLists triangles_;  ///< by vertex
    std::vector<double> area_;
};

}  // namespace trocar
