#include "detect/narrow_phase.hpp"

#include <algorithm>
#include <bit>

#include "geometry/crossing.hpp"
#include "geometry/exact.hpp"
#include "geometry/triangle_distance.hpp"

namespace trocar {
namespace {

Corners corners(const Topology& topology, const Frame& frame, Index triangle) {
    return corners_of(topology.triangles, frame.position, triangle);
}

/// Calls apart(run of candidates, their batch, bits of those that meet) for each run.
template <typename Apart>
void test_exactly(const Topology& topology, const Frame& frame, std::span<const TrianglePair> candidates,
                  std::vector<TrianglePair>& pairs, const TriangleFilter& filter, const Apart& apart) {
    TriangleBatch batch;
    while (!candidates.empty()) {
        const std::size_t count = std::min(candidates.size(), TriangleBatch::most);
        filter.gather(frame.position.data(), topology.triangles.data(), candidates.data(), count, batch);
        const TriangleVerdicts verdicts = filter.decide(batch, count);
        std::uint64_t meet = verdicts.meet;
        for (std::uint64_t rest = verdicts.meet | verdicts.undecided; rest != 0; rest &= rest - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(rest));
            const TrianglePair pair = candidates[lane];
            if (((verdicts.meet >> lane) & 1U) != 0 ||
                triangles_intersect(corners(topology, frame, pair.a), corners(topology, frame, pair.b))) {
                pairs.push_back(pair);
                meet |= std::uint64_t{1} << lane;
            }
        }
        apart(candidates.first(count), batch, meet);
        candidates = candidates.subspan(count);
    }
}

bool meet(TriangleTest test, const Corners& first, const Corners& second) {
    return test == TriangleTest::interval ? cross_triangles(first, second).kind != CrossingKind::none
                                          : moller_intersect(first, second);
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
        test_exactly(topology, frame, candidates, pairs, filter,
                     [](auto /*run*/, const TriangleBatch& /*batch*/, std::uint64_t /*meet*/) {});
        return;
    }
    for (const TrianglePair& pair : candidates) {
        if (meet(test, corners(topology, frame, pair.a), corners(topology, frame, pair.b))) pairs.push_back(pair);
    }
}

bool is_near(const Topology& topology, const Frame& frame, const TrianglePair& pair, double query_distance) {
    return is_within_query_distance(corners(topology, frame, pair.a), corners(topology, frame, pair.b), query_distance);
}

std::int64_t test_pairs_within(double query_distance, TriangleTest test, const Topology& topology, const Frame& frame,
                               std::span<const TrianglePair> candidates, std::vector<TrianglePair>& pairs,
                               std::vector<TrianglePair>& near, const TriangleFilter& filter) {
    if (query_distance == 0.0) {
        test_pairs(test, topology, frame, candidates, pairs, filter);
        return 0;
    }
    std::int64_t asked = 0;
    if (test == TriangleTest::exact) {
        const auto query_distance_in_float = static_cast<float>(query_distance);
        test_exactly(
            topology, frame, candidates, pairs, filter,
            [&](std::span<const TrianglePair> run, const TriangleBatch& batch, std::uint64_t meet) {
                const std::uint64_t all = ~std::uint64_t{0} >> (TriangleBatch::most - run.size());
                const std::uint64_t apart = all & ~meet;
                asked += std::popcount(apart);
                const NearVerdicts verdicts = filter.decide_near(batch, apart, query_distance_in_float);
                for (std::uint64_t rest = verdicts.near | verdicts.undecided; rest != 0; rest &= rest - 1) {
                    const auto lane = static_cast<std::size_t>(std::countr_zero(rest));
                    if (((verdicts.near >> lane) & 1U) != 0 || is_near(topology, frame, run[lane], query_distance)) {
                        near.push_back(run[lane]);
                    }
                }
            });
        return asked;
    }
    for (const TrianglePair& pair : candidates) {
        if (meet(test, corners(topology, frame, pair.a), corners(topology, frame, pair.b))) {
            pairs.push_back(pair);
            continue;
        }
        ++asked;
        if (is_near(topology, frame, pair, query_distance)) near.push_back(pair);
    }
    return asked;
}

}  // namespace trocar
