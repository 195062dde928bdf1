// Properties of a triangle surface by direct counting, for tests of generated shapes.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "scene/shapes.hpp"

namespace trocar::test {

using DirectedEdges = std::map<std::pair<Index, Index>, int>;

inline DirectedEdges directed_edges(const Triangles& triangles) {
    DirectedEdges edges;
    for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
        for (int corner = 0; corner < 3; ++corner) ++edges[{triangles(corner, t), triangles((corner + 1) % 3, t)}];
    }
    return edges;
}

inline std::vector<std::pair<Index, Index>> boundary_edges(const Triangles& triangles) {
    const DirectedEdges edges = directed_edges(triangles);
    std::vector<std::pair<Index, Index>> boundary;
    for (const auto& [edge, count] : edges) {
        if (edges.count({edge.second, edge.first}) == 0) boundary.push_back(edge);
    }
    return boundary;
}

inline bool every_edge_at_most_twice_and_opposite(const Triangles& triangles) {
    const DirectedEdges edges = directed_edges(triangles);
    return std::all_of(edges.begin(), edges.end(), [](const auto& entry) { return entry.second == 1; });
}

/// True when each edge occurs exactly twice, in opposite directions.
inline bool is_closed(const Triangles& triangles) {
    return every_edge_at_most_twice_and_opposite(triangles) && boundary_edges(triangles).empty();
}

inline double signed_volume(const Surface& surface) {
    double sum = 0.0;
    for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
        const auto v = surface.triangles.col(t);
        sum += surface.vertices.col(v[0]).dot(surface.vertices.col(v[1]).cross(surface.vertices.col(v[2]))) / 6.0;
    }
    return sum;
}

inline double area_of(const Surface& surface, Eigen::Index t) {
    const Vector3 a = surface.vertices.col(surface.triangles(0, t));
    const Vector3 b = surface.vertices.col(surface.triangles(1, t));
    const Vector3 c = surface.vertices.col(surface.triangles(2, t));
    return 0.5 * (b - a).cross(c - a).norm();
}

inline double total_area(const Surface& surface) {
    double sum = 0.0;
    for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) sum += area_of(surface, t);
    return sum;
}

/// Minimum height of all triangles relative to their longest edge; 0 below 1e-6.
inline double smallest_height(const Surface& surface) {
    double smallest = 1.0;
    for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
        double longest = 0.0;
        for (int corner = 0; corner < 3; ++corner) {
            const Vector3 edge = surface.vertices.col(surface.triangles((corner + 1) % 3, t)) -
                                 surface.vertices.col(surface.triangles(corner, t));
            longest = std::max(longest, edge.norm());
        }
        const double height = longest > 0.0 ? 2.0 * area_of(surface, t) / (longest * longest) : 0.0;
        smallest = std::min(smallest, height > 1e-6 ? height : 0.0);
    }
    return smallest;
}

inline double median_edge(const Surface& surface) {
    std::vector<double> lengths;
    for (const auto& [edge, count] : directed_edges(surface.triangles)) {
        lengths.push_back((surface.vertices.col(edge.first) - surface.vertices.col(edge.second)).norm());
    }
    std::nth_element(lengths.begin(), lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2), lengths.end());
    return lengths[lengths.size() / 2];
}

inline Index unused_vertices(const Surface& surface) {
    std::set<Index> used(surface.triangles.data(), surface.triangles.data() + surface.triangles.size());
    return static_cast<Index>(surface.vertices.cols()) - static_cast<Index>(used.size());
}

/// True when the closed surface has an edge whose neighbour's far corner lies above the triangle's plane.
inline bool has_concave_edge(const Surface& surface) {
    std::map<std::pair<Index, Index>, Index> opposite;
    for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
        for (int corner = 0; corner < 3; ++corner) {
            opposite[{surface.triangles(corner, t), surface.triangles((corner + 1) % 3, t)}] =
                surface.triangles((corner + 2) % 3, t);
        }
    }
    return std::any_of(opposite.begin(), opposite.end(), [&](const auto& entry) {
        const Vector3 a = surface.vertices.col(entry.first.first);
        const Vector3 b = surface.vertices.col(entry.first.second);
        const Vector3 c = surface.vertices.col(entry.second);
        const Vector3 far = surface.vertices.col(opposite.at({entry.first.second, entry.first.first}));
        const Vector3 normal = (b - a).cross(c - a).normalized();
        return normal.dot(far - a) > 1e-9 * (b - a).norm();
    });
}

}  // namespace trocar::test
