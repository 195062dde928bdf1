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

/// Difference of two corners, rounded once in double and once to float.
void put_difference(const double* to, const double* from, std::size_t lane, TriangleBatch::Lanes& lanes) {
    lanes[0][lane] = static_cast<float>(to[0] - from[0]);
    lanes[1][lane] = static_cast<float>(to[1] - from[1]);
    lanes[2][lane] = static_cast<float>(to[2] - from[2]);
}

void test_exactly(const Topology& topology, const Frame& frame, std::span<const TrianglePair> candidates,
                  std::vector<TrianglePair>& pairs, TriangleFilter filter) {
    const double* const position = frame.position.data();
    const auto corner = [&](Index triangle, Eigen::Index k) {
        return position + 3 * static_cast<std::size_t>(topology.triangles(k, triangle));
    };
    TriangleBatch batch;
    while (!candidates.empty()) {
        const std::size_t count = std::min(candidates.size(), TriangleBatch::most);
        for (std::size_t lane = 0; lane < count; ++lane) {
            const auto [first, second] = candidates[lane];
            const double* const p = corner(first, 0);
            const double* const q = corner(second, 0);
            put_difference(corner(first, 1), p, lane, batch.u1);
            put_difference(corner(first, 2), p, lane, batch.v1);
            put_difference(corner(second, 1), q, lane, batch.u2);
            put_difference(corner(second, 2), q, lane, batch.v2);
            put_difference(p, q, lane, batch.w);
        }
        const TriangleVerdicts verdicts = filter(batch, count);
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
                std::span<const TrianglePair> candidates, std::vector<TrianglePair>& pairs, TriangleFilter filter) {
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
