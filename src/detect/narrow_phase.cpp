#include "detect/narrow_phase.hpp"

#include <algorithm>
#include <bit>

#include "geometry/crossing.hpp"
#include "geometry/exact.hpp"

namespace trocar {
namespace {

Corners corners(const Topology& topology, const Frame& frame, Index triangle) {
    const auto vertices = topology.triangles.col(triangle);
    return {frame.position.col(vertices(0)), frame.position.col(vertices(1)), frame.position.col(vertices(2))};
}

void test_exactly(const Topology& topology, const Frame& frame, std::span<const TrianglePair> candidates,
                  std::vector<TrianglePair>& pairs, const TriangleFilter& filter) {
    TriangleBatch batch;
    while (!candidates.empty()) {
        const std::size_t count = std::min(candidates.size(), TriangleBatch::most);
        filter.gather(frame.position.data(), topology.triangles.data(), candidates.data(), count, batch);
        const TriangleVerdicts verdicts = filter.decide(batch, count);
        for (std::uint64_t rest = verdicts.meet | verdicts.undecided; rest != 0; rest &= rest - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(rest));
            const TrianglePair pair = candidates[lane];
            if (((verdicts.meet >> lane) & 1U) != 0 ||
                triangles_intersect(corners(topology, frame, pair.a), corners(topology, frame, pair.b))) {
                pairs.push_back(pair);
            }
        }
        candidates = candidates.subspan(count);
    }
}

}  // namespace

TriangleTest triangle_test_from(std::string_view word) {
    if (word == "interval") return TriangleTest::interval;
    return word == "moller" ? TriangleTest::moller : TriangleTest::exact;
}

void test_pairs(TriangleTest test, const Topology& topology, const Frame& frame,
                std::span<const TrianglePair> candidates, std::vector<TrianglePair>& pairs,
                const TriangleFilter& filter) {
    if (test == TriangleTest::exact) {
        test_exactly(topology, frame, candidates, pairs, filter);
        return;
    }
    for (const TrianglePair& pair : candidates) {
        const Corners first = corners(topology, frame, pair.a);
        const Corners second = corners(topology, frame, pair.b);
        const bool meet = test == TriangleTest::interval ? cross_triangles(first, second).kind != CrossingKind::none
                                                         : moller_intersect(first, second);
        if (meet) pairs.push_back(pair);
    }
}

}  // namespace trocar
