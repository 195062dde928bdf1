#include "detect/narrow_phase.hpp"

#include "geometry/exact.hpp"

namespace trocar {
namespace {

Corners corners(const Topology& topology, const Frame& frame, Index triangle) {
    const auto vertices = topology.triangles.col(triangle);
    return {frame.position.col(vertices(0)), frame.position.col(vertices(1)), frame.position.col(vertices(2))};
}

}  // namespace

void test_pairs(const Topology& topology, const Frame& frame, std::span<const TrianglePair> candidates,
                std::vector<TrianglePair>& pairs) {
    for (const TrianglePair& pair : candidates) {
        if (triangles_intersect(corners(topology, frame, pair.a), corners(topology, frame, pair.b)))
            pairs.push_back(pair);
    }
}

}  // namespace trocar
