// Sides of triangles, sorted by edge: the start of every question about holes, rims and neighbours of a surface.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// One side of a triangle, from its lower to its higher vertex.
struct TriangleSide {
    Index low = -1;
    Index high = -1;
    Index triangle = -1;
    bool forward = false;  ///< the triangle's direction is low to high
};

/// Sides of the `chosen` triangles. Those of one edge are adjacent, in the order of their triangles. A side from a
/// vertex to itself is left out.
std::vector<TriangleSide> sorted_sides(const Triangles& triangles, std::span<const Index> chosen);
std::vector<TriangleSide> sorted_sides(const Triangles& triangles, Range range);
/// Sides of all triangles.
std::vector<TriangleSide> sorted_sides(const Triangles& triangles);

/// Calls act(sides of one edge) for each edge, in ascending order.
template <typename Act>
void for_each_edge(std::span<const TriangleSide> sides, const Act& act) {
    for (std::size_t first = 0, end = 0; first < sides.size(); first = end) {
        while (end < sides.size() && sides[end].low == sides[first].low && sides[end].high == sides[first].high) ++end;
        act(sides.subspan(first, end - first));
    }
}

/// Directed edge of a surface's boundary chain. Edges whose adjacent triangles cancel do not appear.
struct RimEdge {
    Index from = -1;
    Index to = -1;
    int count = 0;  ///< net number of times that triangles run along it
};
/// Rim of the triangles with these sides, from the lower to the higher vertex and in ascending order.
std::vector<RimEdge> rim_of(std::span<const TriangleSide> sides);

/// Mean length of the sides of a range of triangles; 0 without any.
double mean_edge(const Triangles& triangles, const Matrix3X& position, Range range);

}  // namespace trocar
