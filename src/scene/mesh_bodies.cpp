#include "scene/mesh_bodies.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "geometry/disjoint_sets.hpp"
#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"

namespace trocar {
std::vector<Index> component_of_triangle(const Triangles& triangles, Index vertices) {
    const auto count = static_cast<Index>(triangles.cols());
    DisjointSets connected(vertices);
    for (Index t = 0; t < count; ++t) {
        for (int k = 1; k < 3; ++k) connected.merge(triangles(k, t), triangles(0, t));
    }
    std::vector<Index> component_of_root(at(vertices), -1);
    std::vector<Index> component(at(count));
    Index components = 0;
    for (Index t = 0; t < count; ++t) {
        Index& own = component_of_root[at(connected.find(triangles(0, t)))];
        if (own < 0) own = components++;
        component[at(t)] = own;
    }
    return component;
}

MeshBodies cut_into_bodies(const Triangles& triangles, Index vertices, const std::vector<Index>& part_of_triangle,
                           const std::string& place) {
    MeshBodies result;
    result.body_of_vertex.assign(at(vertices), -1);
    result.vertex_in_world.assign(at(vertices), -1);
    result.triangle_in_world.assign(part_of_triangle.size(), -1);
    const auto last = std::max_element(part_of_triangle.begin(), part_of_triangle.end());
    const std::size_t count = last == part_of_triangle.end() ? 0 : at(*last) + 1;
    if (are_sizes_limited() && count > static_cast<std::size_t>(most_bodies)) {
        throw InputError(place, "", limit_text(most_bodies, "bodies"), fmt::format("{}", count));
    }
    std::vector<std::vector<Index>> members(count);  // triangles by body
    for (std::size_t t = 0; t < part_of_triangle.size(); ++t) {
        const Index part = part_of_triangle[t];
        members[at(part)].push_back(static_cast<Index>(t));
        for (int k = 0; k < 3; ++k) {
            const Index vertex = triangles(k, static_cast<Eigen::Index>(t));
            Index& body = result.body_of_vertex[at(vertex)];
            if (body >= 0 && body != part) {
                throw InputError(place, fmt::format("triangle {}", t), "vertices of one body",
                                 fmt::format("vertex {}, which another body has too", vertex));
            }
            body = part;
        }
    }
    std::vector<std::vector<Index>> vertices_of(count);
    for (Index v = 0; v < vertices; ++v) {
        if (result.body_of_vertex[at(v)] >= 0) vertices_of[at(result.body_of_vertex[at(v)])].push_back(v);
    }
    std::vector<Index> local(at(vertices), -1);
    Index next_triangle = 0;
    for (std::size_t b = 0; b < count; ++b) {
        Body body{.closed = false};
        body.vertex_count = static_cast<Index>(vertices_of[b].size());
        for (Index i = 0; i < body.vertex_count; ++i) {
            const Index v = vertices_of[b][at(i)];
            local[at(v)] = i;
            result.vertex_in_world[at(v)] = result.vertex_count++;
        }
        body.triangles.resize(3, static_cast<Eigen::Index>(members[b].size()));
        for (std::size_t i = 0; i < members[b].size(); ++i) {
            const Index t = members[b][i];
            result.triangle_in_world[at(t)] = next_triangle++;
            for (int k = 0; k < 3; ++k) body.triangles(k, static_cast<Eigen::Index>(i)) = local[at(triangles(k, t))];
        }
        result.bodies.push_back(std::move(body));
    }
    return result;
}

Matrix3X MeshBodies::in_world_order(const Matrix3X& vertices) const {
    Matrix3X ordered(3, vertex_count);
    for (std::size_t v = 0; v < vertex_in_world.size(); ++v) {
        const Index place = vertex_in_world[v];
        if (place >= 0) ordered.col(place) = vertices.col(static_cast<Eigen::Index>(v));
    }
    return ordered;
}

}  // namespace trocar
