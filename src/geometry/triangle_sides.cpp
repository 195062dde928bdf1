#include "geometry/triangle_sides.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace trocar {

std::vector<TriangleSide> sorted_sides(const Triangles& triangles, std::span<const Index> chosen) {
    std::vector<TriangleSide> sides;
    sides.reserve(3 * chosen.size());
    for (const Index t : chosen) {
        for (int corner = 0; corner < 3; ++corner) {
            const Index from = triangles(corner, t);
            const Index to = triangles((corner + 1) % 3, t);
            if (from != to) sides.push_back({std::min(from, to), std::max(from, to), t, from < to});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const TriangleSide& a, const TriangleSide& b) {
        return std::tie(a.low, a.high, a.triangle, a.forward) < std::tie(b.low, b.high, b.triangle, b.forward);
    });
    return sides;
}

std::vector<TriangleSide> sorted_sides(const Triangles& triangles, Range range) {
    std::vector<Index> chosen(at(range.count));
    std::iota(chosen.begin(), chosen.end(), range.first);
    return sorted_sides(triangles, chosen);
}

std::vector<TriangleSide> sorted_sides(const Triangles& triangles) {
    return sorted_sides(triangles, Range{0, static_cast<Index>(triangles.cols())});
}

std::vector<RimEdge> rim_of(std::span<const TriangleSide> sides) {
    std::vector<RimEdge> rim;
    for_each_edge(sides, [&rim](std::span<const TriangleSide> edge) {
        RimEdge net{edge.front().low, edge.front().high, 0};
        for (const TriangleSide& side : edge) net.count += side.forward ? 1 : -1;
        if (net.count != 0) rim.push_back(net);
    });
    return rim;
}

double mean_edge(const Triangles& triangles, const Matrix3X& position, Range range) {
    double sum = 0.0;
    for (Index t = range.first; t < range.end(); ++t) {
        for (int i = 0; i < 3; ++i) {
            sum += (position.col(triangles(i, t)) - position.col(triangles((i + 1) % 3, t))).norm();
        }
    }
    return range.count > 0 ? sum / (3.0 * range.count) : 0.0;
}

}  // namespace trocar
