#include "measure/pair_truth.hpp"

#include <algorithm>

#include "geometry/box_pairs.hpp"
#include "geometry/exact.hpp"
#include "geometry/triangle_distance.hpp"

namespace trocar {
namespace {

/// Pairs of which wanted(corners, corners) holds, among those whose boxes overlap, each with `around` (m) around it.
template <typename Wanted>
void find_pairs(const Topology& topology, const Frame& frame, double around, const Wanted& wanted,
                std::vector<TrianglePair>& pairs) {
    pairs.clear();
    std::vector<Box> boxes;
    triangle_boxes(frame.position, topology.triangles, boxes);
    for (Box& box : boxes) box = box.grown(around);
    std::vector<IndexPair> candidates;
    for (const auto& [body_a, body_b] : topology.body_pairs) {
        overlapping_boxes(boxes, topology.bodies[static_cast<std::size_t>(body_a)].triangles,
                          topology.bodies[static_cast<std::size_t>(body_b)].triangles, candidates);
        for (const IndexPair& candidate : candidates) {
            if (wanted(corners_of(topology.triangles, frame.position, candidate.first),
                       corners_of(topology.triangles, frame.position, candidate.second))) {
                pairs.push_back({candidate.first, candidate.second});
            }
        }
    }
    std::sort(pairs.begin(), pairs.end());
}

/// How far `moved` reaches through the plane of `fixed`, on the side where it reaches less; 0 for a triangle without a
/// normal.
double depth_through_plane(const Corners& moved, const Corners& fixed) {
    const Vector3 normal = (fixed[1] - fixed[0]).cross(fixed[2] - fixed[0]);
    const double length = normal.norm();
    if (!(length > 0.0)) return 0.0;
    double above = 0.0;
    double below = 0.0;
    for (const Vector3& corner : moved) {
        const double height = (corner - fixed[0]).dot(normal) / length;
        above = std::max(above, height);
        below = std::max(below, -height);
    }
    return std::min(above, below);
}

}  // namespace

void true_pairs(const Topology& topology, const Frame& frame, std::vector<TrianglePair>& pairs) {
    find_pairs(topology, frame, 0.0, oracle_intersect, pairs);
}

void true_near_pairs(const Topology& topology, const Frame& frame, double query_distance,
                     std::vector<TrianglePair>& pairs) {
    find_pairs(
        topology, frame, 0.5 * query_distance,
        [query_distance](const Corners& first, const Corners& second) {
            return is_within_query_distance(first, second, query_distance) && !oracle_intersect(first, second);
        },
        pairs);
}

std::vector<Index> touching_pairs(const Topology& topology, const Frame& frame,
                                  const std::vector<TrianglePair>& pairs) {
    std::vector<Index> touching;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const PairClass pair_class = oracle_class(corners_of(topology.triangles, frame.position, pairs[i].a),
                                                  corners_of(topology.triangles, frame.position, pairs[i].b));
        if (pair_class == PairClass::touch_vertex || pair_class == PairClass::touch_edge) {
            touching.push_back(static_cast<Index>(i));
        }
    }
    return touching;
}

std::vector<TrianglePair> deepest_pairs(const Topology& topology, const Frame& frame,
                                        const std::vector<TrianglePair>& pairs) {
    if (pairs.size() <= deepest_count) return pairs;
    std::vector<std::pair<double, TrianglePair>> order;
    order.reserve(pairs.size());
    for (const TrianglePair& pair : pairs) {
        const Corners a = corners_of(topology.triangles, frame.position, pair.a);
        const Corners b = corners_of(topology.triangles, frame.position, pair.b);
        order.emplace_back(-std::min(depth_through_plane(a, b), depth_through_plane(b, a)), pair);
    }
    std::sort(order.begin(), order.end());
    std::vector<TrianglePair> deepest;
    for (std::size_t i = 0; i < deepest_count; ++i) deepest.push_back(order[i].second);
    std::sort(deepest.begin(), deepest.end());
    return deepest;
}

TickTruth truth_of(const Topology& topology, const Frame& frame) {
    TickTruth truth;
    true_pairs(topology, frame, truth.pairs);
    truth.touch = touching_pairs(topology, frame, truth.pairs);
    return truth;
}

PairErrors compare_pairs(const std::vector<TrianglePair>& reported, const std::vector<TrianglePair>& truth,
                         const std::vector<Index>& truth_touch) {
    std::vector<TrianglePair> found = reported;
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    PairErrors errors;
    std::size_t matched = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (std::binary_search(found.begin(), found.end(), truth[i])) {
            ++matched;
            continue;
        }
        ++errors.false_negatives;
        if (std::binary_search(truth_touch.begin(), truth_touch.end(), static_cast<Index>(i))) {
            ++errors.false_negatives_touch;
        }
    }
    errors.false_positives = static_cast<std::int64_t>(found.size() - matched);
    return errors;
}

void judge_pairs(const TickTruth& truth, const std::vector<TrianglePair>& reported, StepRow& row) {
    const PairErrors errors = compare_pairs(reported, truth.pairs, truth.touch);
    row.true_pairs = static_cast<std::int64_t>(truth.pairs.size());
    row.true_touch = static_cast<std::int64_t>(truth.touch.size());
    row.false_negatives = errors.false_negatives;
    row.false_positives = errors.false_positives;
    row.false_negatives_touch = errors.false_negatives_touch;
}

}  // namespace trocar
