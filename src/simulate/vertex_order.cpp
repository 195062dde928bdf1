#include "simulate/vertex_order.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace trocar {
namespace {

/// Spreads the low 21 bits so that two free bits follow each.
std::uint64_t spread(std::uint64_t bits) {
    bits &= 0x1FFFFFU;
    bits = (bits | bits << 32U) & 0x1F00000000FFFFULL;
    bits = (bits | bits << 16U) & 0x1F0000FF0000FFULL;
    bits = (bits | bits << 8U) & 0x100F00F00F00F00FULL;
    bits = (bits | bits << 4U) & 0x10C30C30C30C30C3ULL;
    bits = (bits | bits << 2U) & 0x1249249249249249ULL;
    return bits;
}

/// Columns of `points` (m) in the order of the Morton curve through their box; ties by number.
std::vector<Index> curve_order(const Matrix3X& points) {
    std::vector<Index> order(static_cast<std::size_t>(points.cols()));
    if (order.empty()) return order;
    const Vector3 low = points.rowwise().minCoeff();
    const double extent = (points.rowwise().maxCoeff() - low).maxCoeff();
    const double scale = extent > 0.0 ? 2097151.0 / extent : 0.0;
    std::vector<std::pair<std::uint64_t, Index>> keys;
    keys.reserve(order.size());
    for (Index i = 0; i < points.cols(); ++i) {
        std::uint64_t key = 0;
        for (int axis = 0; axis < 3; ++axis) {
            key |= spread(static_cast<std::uint64_t>((points(axis, i) - low[axis]) * scale)) << axis;
        }
        keys.emplace_back(key, i);
    }
    std::sort(keys.begin(), keys.end());
    for (std::size_t i = 0; i < keys.size(); ++i) order[i] = keys[i].second;
    return order;
}

/// New vertex k is the old vertex order[k].
void reorder_vertices(const std::vector<Index>& order, Surface& surface) {
    Matrix3X vertices(3, surface.vertices.cols());
    std::vector<Index> number(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
        vertices.col(static_cast<Eigen::Index>(k)) = surface.vertices.col(order[k]);
        number[static_cast<std::size_t>(order[k])] = static_cast<Index>(k);
    }
    surface.vertices = std::move(vertices);
    surface.triangles = surface.triangles.unaryExpr([&](Index old) { return number[static_cast<std::size_t>(old)]; });
}

void reorder_triangles(const std::vector<Index>& order, Surface& surface) {
    Triangles triangles(3, surface.triangles.cols());
    for (std::size_t k = 0; k < order.size(); ++k) {
        triangles.col(static_cast<Eigen::Index>(k)) = surface.triangles.col(order[k]);
    }
    surface.triangles = std::move(triangles);
}

std::vector<Index> random_order(Eigen::Index count, Random& random) {
    std::vector<Index> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    random.shuffle(order);
    return order;
}

}  // namespace

std::vector<Index> renumber_along_curve(Surface& surface) {
    std::vector<Index> order = curve_order(surface.vertices);
    reorder_vertices(order, surface);
    Matrix3X centres(3, surface.triangles.cols());
    for (Index t = 0; t < surface.triangles.cols(); ++t) {
        const auto v = surface.triangles.col(t);
        centres.col(t) = (surface.vertices.col(v[0]) + surface.vertices.col(v[1]) + surface.vertices.col(v[2])) / 3.0;
    }
    reorder_triangles(curve_order(centres), surface);
    return order;
}

std::vector<Index> shuffle(Surface& surface, Random& random) {
    std::vector<Index> order = random_order(surface.vertices.cols(), random);
    reorder_vertices(order, surface);
    reorder_triangles(random_order(surface.triangles.cols(), random), surface);
    return order;
}

}  // namespace trocar
