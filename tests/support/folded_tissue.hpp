// Tissue in two layers under a tool: a folded sheet and a flat bag.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "support/closed_loop.hpp"

namespace trocar::test {

/// Two layers and their joint. Triangles are ordered: upper layer, lower layer, joint.
struct LayeredTissue {
    Shape mesh;
    Index upper = 0;  ///< number of triangles of the upper layer, front in +z
    Index lower = 0;  ///< number of triangles of the lower layer, front in -z
    bool closed = false;
};

/// Open sheet, 2·half_width wide in y, folded about a bend at x = `half_length`. The layers extend from x =
/// -`half_length` to x = `half_length` at z = 0 and z = -gap. Lengths in m.
inline LayeredTissue make_fold(double half_length, double half_width, double gap, double edge) {
    std::vector<std::array<double, 2>> path;  // x, z
    const auto along = static_cast<int>(std::lround(2.0 * half_length / edge));
    for (int i = 0; i <= along; ++i) path.push_back({-half_length + 2.0 * half_length * i / along, 0.0});
    const auto turn = std::max(2, static_cast<int>(std::lround(std::numbers::pi * gap / 2.0 / edge)));
    for (int i = 1; i < turn; ++i) {
        const double angle = std::numbers::pi * i / turn;
        path.push_back({half_length + 0.5 * gap * std::sin(angle), -0.5 * gap + 0.5 * gap * std::cos(angle)});
    }
    for (int i = 0; i <= along; ++i) path.push_back({half_length - 2.0 * half_length * i / along, -gap});
    const auto across = static_cast<int>(std::lround(2.0 * half_width / edge));
    const auto points = static_cast<Index>(path.size());
    LayeredTissue fold;
    for (int j = 0; j <= across; ++j) {
        for (const auto& [x, z] : path)
            fold.mesh.vertices.emplace_back(x, -half_width + 2.0 * half_width * j / across, z);
    }
    const auto add = [&](int from, int to) {
        for (int i = from; i < to; ++i) {
            for (int j = 0; j < across; ++j) {
                const Index a = static_cast<Index>(j) * points + i;
                const Index b = a + 1;
                const Index c = a + points;
                const Index d = c + 1;
                if ((i + j) % 2 == 0) {
                    fold.mesh.triangles.push_back({a, b, d});
                    fold.mesh.triangles.push_back({a, d, c});
                } else {
                    fold.mesh.triangles.push_back({a, b, c});
                    fold.mesh.triangles.push_back({b, d, c});
                }
            }
        }
        return static_cast<Index>(2 * (to - from) * across);
    };
    fold.upper = add(0, along);
    fold.lower = add(along + turn, static_cast<int>(points) - 1);
    add(along, along + turn);
    return fold;
}

/// Closed flat bag of n×n squares, whose walls are `gap` apart and meet at the rim. Lengths in m.
inline LayeredTissue make_bag(int n, double edge, double gap) {
    LayeredTissue bag;
    bag.closed = true;
    const Shape sheet = make_sheet(n, edge);
    const double half_length = 0.5 * n * edge;
    const auto on_rim = [&](const Vector3& p) { return p.head<2>().cwiseAbs().maxCoeff() > half_length - 1e-9; };
    std::vector<Index> below;
    for (const Vector3& p : sheet.vertices) bag.mesh.vertices.emplace_back(p.x(), p.y(), on_rim(p) ? -0.5 * gap : 0.0);
    for (std::size_t v = 0; v < sheet.vertices.size(); ++v) {
        const Vector3& p = sheet.vertices[v];
        below.push_back(on_rim(p) ? static_cast<Index>(v) : static_cast<Index>(bag.mesh.vertices.size()));
        if (!on_rim(p)) bag.mesh.vertices.emplace_back(p.x(), p.y(), -gap);
    }
    const auto under = [&](const std::array<Index, 3>& t) {
        const auto at = [&](std::size_t i) { return below[static_cast<std::size_t>(t[i])]; };
        return std::array<Index, 3>{at(2), at(1), at(0)};
    };
    // Triangles with all corners on the rim would occur in both walls.
    std::vector<std::array<Index, 3>> kept;
    for (const auto& t : sheet.triangles) {
        const auto below_it = under(t);
        if (below_it[0] != t[2] || below_it[1] != t[1] || below_it[2] != t[0]) kept.push_back(t);
    }
    bag.mesh.triangles = kept;
    for (const auto& t : kept) bag.mesh.triangles.push_back(under(t));
    bag.upper = bag.lower = static_cast<Index>(kept.size());
    return bag;
}

}  // namespace trocar::test
