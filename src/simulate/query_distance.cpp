#include "simulate/query_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/triangle_sides.hpp"

namespace trocar {
namespace {

/// m, over all bodies; infinite without a triangle.
double smallest_edge(const Topology& topology, const Frame& frame) {
    double smallest = std::numeric_limits<double>::infinity();
    for (const BodyRange& body : topology.bodies) {
        const double edge = mean_edge(topology.triangles, frame.position, body.triangles);
        if (edge > 0.0) smallest = std::min(smallest, edge);
    }
    return smallest;
}

}  // namespace

QueryDistance::QueryDistance(const Scene& scene) {
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t b = 0; b < scene.topology.bodies.size(); ++b) {
        const BodyRange& body = scene.topology.bodies[b];
        const bool driven = b < scene.bodies.size() && scene.bodies[b].motion.has_value();
        if (body.kind != BodyKind::tissue && !driven) continue;
        const double edge = mean_edge(scene.topology.triangles, scene.first.position, body.triangles);
        if (edge > 0.0) smallest = std::min(smallest, edge);
    }
    if (!std::isfinite(smallest)) smallest = smallest_edge(scene.topology, scene.first);
    if (std::isfinite(smallest)) edge_ = smallest;
}

QueryDistance::QueryDistance(const Topology& topology, const Frame& frame) {
    const double smallest = smallest_edge(topology, frame);
    if (std::isfinite(smallest)) edge_ = smallest;
}

double QueryDistance::of(double driven_move, double tissue_move, double deep) const {
    const double wanted = margin() + driven_move + std::min(tissue_move + deep, driven_move + most());
    double query_distance = margin();
    while (query_distance < wanted && std::isfinite(wanted) && query_distance > 0.0) query_distance *= 2.0;
    return query_distance;
}

double furthest_move(const Frame& frame, std::span<const Range> ranges) {
    double square = 0.0;
    for (const Range& range : ranges) {
        for (Index v = range.first; v < range.end(); ++v) {
            square = std::max(square, (frame.position.col(v) - frame.previous.col(v)).squaredNorm());
        }
    }
    return std::sqrt(square);
}

}  // namespace trocar
