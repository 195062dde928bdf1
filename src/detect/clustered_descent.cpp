#include "detect/clustered_descent.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "detect/swept.hpp"

namespace trocar {
namespace {

/// For sixteen bits; std::popcount is a call where the instruction is not guaranteed.
constexpr std::int64_t bits_set(std::uint32_t bits) {
    bits -= (bits >> 1U) & 0x5555U;
    bits = (bits & 0x3333U) + ((bits >> 2U) & 0x3333U);
    bits = (bits + (bits >> 4U)) & 0x0F0FU;
    return (bits + (bits >> 8U)) & 0x1FU;
}

}  // namespace

void ClusteredDescent::pair_regions(const Frame& frame, const ClusteredRegions::Pair& pair) {
    const std::size_t known = candidates_.size();
    descend(frame, pair);
    if (clock_.path) drop_apart(frame, known);
}

/// Removes the candidates from number `known` on that are never within the query distance at the same time. Removes all
/// of them when the budget does not allow the test.
void ClusteredDescent::drop_apart(const Frame& frame, std::size_t known) {
    const auto fresh = candidates_.begin() + static_cast<std::ptrdiff_t>(known);
    const bool spent = !spend_box_tests(candidates_.end() - fresh);
    candidates_.erase(std::remove_if(fresh, candidates_.end(),
                                     [&](const TrianglePair& candidate) {
                                         return spent || !may_meet_on_path(regions_.topology(), frame, candidate,
                                                                           clock_.query_distance);
                                     }),
                      candidates_.end());
}

void ClusteredDescent::descend(const Frame& frame, const ClusteredRegions::Pair& pair) {
    if (!boxes_.open_region(pair.first) || !boxes_.open_region(pair.second)) return;
    const ClusteredRegions::Region& first = regions_.region(pair.first);
    const ClusteredRegions::Region& second = regions_.region(pair.second);
    const MovingBody& first_body = regions_.owner_of(first);
    const MovingBody& second_body = regions_.owner_of(second);
    const SixteenBoxes& first_groups = boxes_.groups_of(pair.first);
    const SixteenBoxes& second_groups = boxes_.groups_of(pair.second);
    if (!spend_box_tests(fan)) return;
    std::uint32_t near =
        kernels_.overlaps(first_groups, boxes_.within_query_distance(boxes_.to_float(regions_.extent_of(second))));
    if (!spend_box_tests(fan * bits_set(near))) return;
    SixteenRows rows;
    SixteenBoxes room;
    kernels_.rows(boxes_.within_query_distance(first_groups, room), near, second_groups, rows);
    for (; near != 0; near &= near - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(near));
        std::uint32_t row = rows[i];
        if (row == 0) continue;
        const Index group = first.number * fan + static_cast<Index>(i);
        const bool first_moved = clock_.moved(first_body.boxes->group_moved_at(group));
        for (; row != 0; row &= row - 1) {
            const auto j = static_cast<std::size_t>(std::countr_zero(row));
            const Index other = second.number * fan + static_cast<Index>(j);
            if (!first_moved && !clock_.moved(second_body.boxes->group_moved_at(other))) continue;
            const GroupRef p{first_body, group, box_of(first_groups, i)};
            const GroupRef q{second_body, other, box_of(second_groups, j)};
            if (!pair_groups(frame, p, q)) return;
        }
    }
}

/// Opens the smaller group first, if neither is open: most others are already clear of its clusters. False when the
/// budget does not allow it.
bool ClusteredDescent::pair_groups(const Frame& frame, const GroupRef& p, const GroupRef& q) {
    const bool p_first =
        boxes_.is_open(p.moving, p.number) || (!boxes_.is_open(q.moving, q.number) && p.box.size() <= q.box.size());
    const GroupRef& first = p_first ? p : q;
    const GroupRef& second = p_first ? q : p;
    const std::int32_t place = boxes_.open_group(frame, first.moving, first.number);
    if (place < 0) return false;
    if (!spend_box_tests(fan)) return false;
    const auto clear_of = [&](const FloatBox& box) {
        return kernels_.overlaps(boxes_.clusters_of(first.moving.clusters, first.number, place),
                                 boxes_.within_query_distance(box)) == 0;
    };
    if (clear_of(second.box)) return true;
    const std::int32_t other_place = boxes_.open_group(frame, second.moving, second.number);
    if (other_place < 0) return false;
    // The box of its vertices is tighter than that of its blocks.
    if (!spend_box_tests(fan)) return false;
    if (clear_of(boxes_.group(other_place).box)) return true;
    if (clock_.path) {
        if (!spend_box_tests(1)) return false;
        if (!boxes_.may_meet_on_path(place, other_place)) return true;
    }

    const std::int32_t p_place = p_first ? place : other_place;
    const std::int32_t q_place = p_first ? other_place : place;
    ClusteredBoxes::Group& p_open = boxes_.group(p_place);
    ClusteredBoxes::Group& q_open = boxes_.group(q_place);
    if (!spend_box_tests(fan)) return false;
    const SixteenBoxes& p_clusters = boxes_.clusters_of(p.moving.clusters, p.number, p_place);
    const SixteenBoxes& q_clusters = boxes_.clusters_of(q.moving.clusters, q.number, q_place);
    std::uint32_t near = kernels_.overlaps(p_clusters, boxes_.within_query_distance(q_open.box));
    if (!spend_box_tests(fan * bits_set(near))) return false;
    SixteenRows rows;
    SixteenBoxes room;
    kernels_.rows(boxes_.within_query_distance(p_clusters, room), near, q_clusters, rows);
    for (; near != 0; near &= near - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(near));
        for (std::uint32_t row = rows[i]; row != 0; row &= row - 1) {
            const auto j = static_cast<std::size_t>(std::countr_zero(row));
            if (clock_.path) {
                if (!spend_box_tests(1)) return false;
                if (!boxes_.may_meet_on_path(p_place, i, q_place, j)) continue;
            }
            if (!pair_clusters({p.moving.clusters, p.number, p_open, i}, {q.moving.clusters, q.number, q_open, j})) {
                return false;
            }
        }
    }
    return true;
}

/// Adds candidates of two clusters whose boxes overlap; the first belongs to the lower body. False when the budget does
/// not allow it.
bool ClusteredDescent::pair_clusters(const ClusterRef& p, const ClusterRef& q) {
    const std::size_t first_place = boxes_.open_cluster(p.clusters, p.group, p.opened, p.number);
    const std::size_t second_place = boxes_.open_cluster(q.clusters, q.group, q.opened, q.number);
    const SixteenBoxes& first_boxes = boxes_.triangles(first_place);
    const SixteenBoxes& second_boxes = boxes_.triangles(second_place);
    if (!spend_box_tests(fan)) return false;
    const std::size_t first_cluster = static_cast<std::size_t>(p.group) * fan + p.number;
    const std::size_t second_cluster = static_cast<std::size_t>(q.group) * fan + q.number;
    std::uint32_t near =
        kernels_.overlaps(first_boxes, boxes_.within_query_distance(box_of(q.opened.clusters, q.number)));
    if (!spend_box_tests(fan * bits_set(near))) return false;
    const Index* const first_triangle = p.clusters.triangle.data() + first_cluster * fan;
    const Index* const second_triangle = q.clusters.triangle.data() + second_cluster * fan;
    SixteenRows rows;
    SixteenBoxes room;
    kernels_.rows(boxes_.within_query_distance(first_boxes, room), near, second_boxes, rows);
    for (; near != 0; near &= near - 1) {
        const auto s = static_cast<std::size_t>(std::countr_zero(near));
        for (std::uint32_t row = rows[s]; row != 0; row &= row - 1) {
            const auto t = static_cast<std::size_t>(std::countr_zero(row));
            if (first_triangle[s] >= 0 && second_triangle[t] >= 0) {
                candidates_.push_back({first_triangle[s], second_triangle[t]});
            }
        }
    }
    return true;
}

}  // namespace trocar
