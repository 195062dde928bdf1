#include "detect/narrow_phase.hpp"

#include "geometry/crossing.hpp"
#include "geometry/exact.hpp"

namespace trocar {
namespace {

Corners corners(const Topology& topology, const Frame& frame, Index triangle) {
    const auto vertices = topology.triangles.col(triangle);
    return {frame.position.col(vertices(0)), frame.position.col(vertices(1)), frame.position.col(vertices(2))};
}

bool intersect(TriangleTest test, const Corners& first, const Corners& second) {
    switch (test) {
        case TriangleTest::interval:
            return cross_triangles(first, second).kind != CrossingKind::none;
        case TriangleTest::moller:
            return moller_intersect(first, second);
        case TriangleTest::exact:
            break;
    }
    return triangles_intersect(first, second);
}

}  // namespace

TriangleTest triangle_test_from(std::string_view word) {
    if (word == "interval") return TriangleTest::interval;
    return word == "moller" ? TriangleTest::moller : TriangleTest::exact;
}

void test_pairs(TriangleTest test, const Topology& topology, const Frame& frame,
                std::span<const TrianglePair> candidates, std::vector<TrianglePair>& pairs) {
    for (const TrianglePair& pair : candidates) {
        if (intersect(test, corners(topology, frame, pair.a), corners(topology, frame, pair.b))) pairs.push_back(pair);
    }
}

}  // namespace trocar
