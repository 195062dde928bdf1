// Independent truth about pairs: exact pair sets from the frame alone, and the errors of a reported set. It never reads
// derive, a contact set (except the judged one) or a method's state.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/contact.hpp"
#include "measure/step_row.hpp"
#include "scene/world.hpp"

namespace trocar {

/// All intersecting pairs of the topology's body pairs by exact predicates (oracle of geometry/exact), sorted.
/// Triangles with a non-finite corner are left out; a method ends such a frame with not_finite.
void true_pairs(const Topology& topology, const Frame& frame, std::vector<TrianglePair>& pairs);

/// All pairs of the topology's body pairs that do not intersect (same oracle) and are at most `query_distance` (m)
/// apart, sorted. It has its own candidates; the distance is that of geometry/triangle_distance, which every detector
/// uses.
void true_near_pairs(const Topology& topology, const Frame& frame, double query_distance,
                     std::vector<TrianglePair>& pairs);

/// Positions in `pairs` that only touch (touch-vertex or touch-edge); ascending. Degenerate triangles have no touch
/// class.
std::vector<Index> touching_pairs(const Topology& topology, const Frame& frame, const std::vector<TrianglePair>& pairs);

/// Number of pairs of a tick that deepest_pairs keeps.
inline constexpr std::size_t deepest_count = 10;
/// The deepest of `pairs` (intersecting ones, sorted), or all when there are no more, sorted. Depth: the least distance
/// along the normal of either triangle that brings the other to one side of its plane. Ties go by the pair.
std::vector<TrianglePair> deepest_pairs(const Topology& topology, const Frame& frame,
                                        const std::vector<TrianglePair>& pairs);

/// Exact pairs of one frame.
struct TickTruth {
    std::vector<TrianglePair> pairs;  ///< intersecting pairs, sorted
    std::vector<Index> touch;         ///< positions in `pairs` of those that only touch
};
TickTruth truth_of(const Topology& topology, const Frame& frame);

struct PairErrors {
    std::int64_t false_negatives = 0;        ///< false negatives
    std::int64_t false_positives = 0;        ///< false positives
    std::int64_t false_negatives_touch = 0;  ///< those of `false_negatives` that only touch
};
/// `reported` in any order, repeats count once; `truth` sorted; `truth_touch` = positions in `truth` that only touch.
PairErrors compare_pairs(const std::vector<TrianglePair>& reported, const std::vector<TrianglePair>& truth,
                         const std::vector<Index>& truth_touch);
/// Sets the counts of true pairs and of errors in `row`.
void judge_pairs(const TickTruth& truth, const std::vector<TrianglePair>& reported, StepRow& row);

}  // namespace trocar
