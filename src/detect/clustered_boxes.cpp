#include "detect/clustered_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace trocar {
namespace {

/// Boxes that overlap nothing, not even a box from one infinity to the other.
void empty(SixteenBoxes& boxes) {
    for (std::size_t k = 0; k < 3; ++k) {
        boxes.low[k].fill(std::numeric_limits<float>::quiet_NaN());
        boxes.high[k].fill(std::numeric_limits<float>::quiet_NaN());
    }
}

/// Adds each box of `other` to the one of the same number.
void unite(const SixteenBoxes& other, SixteenBoxes& boxes) {
    for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t i = 0; i < boxes.low[k].size(); ++i) {
            boxes.low[k][i] = std::min(boxes.low[k][i], other.low[k][i]);
            boxes.high[k][i] = std::max(boxes.high[k][i], other.high[k][i]);
        }
    }
}

/// Floats have a relative error of 2^-24, or of one smallest float.
TickPart part_of_meeting_in_float(const BoxOnPath<FloatBox>& p, const BoxOnPath<FloatBox>& q) {
    return part_of_meeting(p, q, 0x1p-23, 0x1p-148);
}

}  // namespace

void ClusteredBoxes::build() {
    place_of_region_.resize(bodies_.region_count());
    place_of_group_.resize(bodies_.group_count());
    forget();
    std::size_t clusters = 0;
    std::size_t points = 0;
    for (const MovingBody& moving : bodies_.all()) {
        clusters += static_cast<std::size_t>(moving.clusters.cluster_count);
        points += moving.clusters.vertices_of_group.member.size();
    }
    regions_opened_.reserve(bodies_.region_count());
    groups_opened_.reserve(std::min<std::size_t>(bodies_.group_count(), 512));
    cluster_paths_.reserve(settings_.swept ? groups_opened_.capacity() : 0);
    triangle_boxes_.reserve(std::min<std::size_t>(clusters, 2048));
    points_.reserve(std::min<std::size_t>(points, 65536));
}

void ClusteredBoxes::start() {
    choose_floats();
    query_distance_ = static_cast<float>(clock_.query_distance * floats_.scale);
    // A query distance that underflows in float must stay positive.
    if (clock_.query_distance > 0.0) query_distance_ = std::max(query_distance_, std::numeric_limits<float>::min());
    // Bounds the memory: contact moves, and boxes that are no longer used must not accumulate.
    constexpr std::size_t some = 16;
    if (groups_opened_.size() > 2 * std::exchange(groups_asked_, 0) + some) forget();
}

/// The origin is in the median region (of the smaller ones of all meetings), since floats are most precise there. A
/// distant vertex that enlarges a region has no effect. Opened boxes stay valid while the old choice is good enough.
void ClusteredBoxes::choose_floats() {
    const ClusteredRegions::Sized median = regions_.median_meeting();
    const Extent& box = regions_.extent_of(regions_.region(median.region));
    std::array<double, 3> centre{};
    double away = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
        centre[k] = 0.5 * box.low[k] + 0.5 * box.high[k];
        away = std::max(away, std::abs(centre[k] - floats_.origin[k]));
    }
    const double length = median.size * floats_.scale;
    constexpr double near = 64.0;
    if (away * floats_.scale <= near && length <= near && length >= 1.0 / near) return;
    // Clamped to representable powers of two.
    const double scale = median.size > 0.0 ? std::ldexp(1.0, std::clamp(-std::ilogb(median.size), -1020, 1020)) : 1.0;
    if (floats_.origin == centre && floats_.scale == scale) return;
    floats_ = {centre, scale};
    forget();
}

void ClusteredBoxes::forget() {
    std::fill(place_of_region_.begin(), place_of_region_.end(), -1);
    std::fill(place_of_group_.begin(), place_of_group_.end(), -1);
    regions_opened_.clear();
    groups_opened_.clear();
    cluster_paths_.clear();
    points_.clear();
    triangle_boxes_.clear();
}

bool ClusteredBoxes::open_region(Index number) {
    const ClusteredRegions::Region& region = regions_.region(number);
    const MovingBody& moving = regions_.owner_of(region);
    std::int32_t& place = place_of_region_[static_cast<std::size_t>(number)];
    if (place < 0) {
        place = static_cast<std::int32_t>(regions_opened_.size());
        regions_opened_.emplace_back();
    }
    Region& opened = regions_opened_[static_cast<std::size_t>(place)];
    if (opened.opened_at >= moving.boxes->region_moved_at(region.number)) return true;
    const ClusteredBody& clusters = moving.clusters;
    const Index first = region.number * fan;
    const Index end = std::min(first + fan, clusters.group_count);
    if (!work_.spend(work_.counters.box_tests, clusters.blocks_of_group.first[static_cast<std::size_t>(end)] -
                                                   clusters.blocks_of_group.first[static_cast<std::size_t>(first)])) {
        return false;
    }
    empty(opened.groups);
    for (Index g = first; g < end; ++g) {
        const FloatBox in_float = to_float(moving.boxes->group(g));
        for (std::size_t k = 0; k < 3; ++k) {
            opened.groups.low[k][static_cast<std::size_t>(g - first)] = in_float.low[k];
            opened.groups.high[k][static_cast<std::size_t>(g - first)] = in_float.high[k];
        }
    }
    opened.opened_at = clock_.now;
    return true;
}

std::int32_t ClusteredBoxes::open_group(const Frame& frame, const MovingBody& moving, Index group) {
    const ClusteredBody& clusters = moving.clusters;
    std::int32_t& place = place_of_group_[moving.first_group + static_cast<std::size_t>(group)];
    const Index count = clusters.vertices_of_group.count(group);
    if (place < 0) {
        place = static_cast<std::int32_t>(groups_opened_.size());
        Group& fresh = groups_opened_.emplace_back();
        if (settings_.swept) cluster_paths_.emplace_back();
        fresh.points = points_.size();
        fresh.triangles.fill(-1);
        points_.resize(points_.size() + static_cast<std::size_t>(settings_.swept ? 2 * count : count));
    }
    Group& opened = groups_opened_[static_cast<std::size_t>(place)];
    if (std::exchange(opened.asked_at, clock_.now) != clock_.now) ++groups_asked_;
    if (opened.opened_at >= moving.boxes->group_moved_at(group)) return place;
    if (!work_.spend(work_.counters.vertices_read, clock_.path ? 2 * count : count)) return -1;
    const Index* const vertices = clusters.vertices_of_group.begin(group);
    FloatPoint* const points = points_.data() + opened.points;
    vertex_kernels_.to_floats(frame.position.data(), vertices, count, floats_, points, opened.box);
    if (clock_.path) {
        FloatBox before{};
        vertex_kernels_.to_floats(frame.previous.data(), vertices, count, floats_, points + count, before);
        opened.path = {before, opened.box};
        for (std::size_t k = 0; k < 3; ++k) {
            opened.box.low[k] = std::min(opened.box.low[k], before.low[k]);
            opened.box.high[k] = std::max(opened.box.high[k], before.high[k]);
        }
    }
    opened.with_clusters = false;
    opened.with_triangles = 0;
    opened.opened_at = clock_.now;
    return place;
}

bool ClusteredBoxes::may_meet_on_path(std::int32_t first, std::int32_t second) const {
    const BoxOnPath<FloatBox>& p = groups_opened_[at(first)].path;
    return !part_of_meeting_in_float({within_query_distance(p.start), within_query_distance(p.end)},
                                     groups_opened_[at(second)].path)
                .empty();
}

bool ClusteredBoxes::may_meet_on_path(std::int32_t first, std::size_t i, std::int32_t second, std::size_t j) const {
    const BoxOnPath<SixteenBoxes>& p = cluster_paths_[at(first)];
    const BoxOnPath<SixteenBoxes>& q = cluster_paths_[at(second)];
    return !part_of_meeting_in_float(
                {within_query_distance(box_of(p.start, i)), within_query_distance(box_of(p.end, i))},
                {box_of(q.start, j), box_of(q.end, j)})
                .empty();
}

void ClusteredBoxes::box_clusters(const ClusteredBody& clusters, Index group, std::int32_t place) {
    Group& opened = groups_opened_[at(place)];
    const FloatPoint* const points = points_.data() + opened.points;
    const Index first = group * fan;
    const Index end = std::min(first + fan, clusters.cluster_count);
    const auto box_all = [&](const FloatPoint* from, SixteenBoxes& boxes) {
        if (end - first < fan) empty(boxes);
        for (Index c = first; c < end; ++c) {
            kernels_.box_of_places(from, clusters.vertices_of_cluster.begin(c), clusters.vertices_of_cluster.count(c),
                                   static_cast<std::size_t>(c - first), boxes);
        }
    };
    box_all(points, opened.clusters);
    if (clock_.path) {
        BoxOnPath<SixteenBoxes>& path = cluster_paths_[at(place)];
        box_all(points + clusters.vertices_of_group.count(group), path.start);
        path.end = opened.clusters;
        unite(path.start, opened.clusters);
    }
    opened.with_clusters = true;
}

void ClusteredBoxes::box_triangles(const ClusteredBody& clusters, Index group, Group& opened, std::size_t i) {
    std::int32_t& place = opened.triangles[i];
    if (place < 0) {
        place = static_cast<std::int32_t>(triangle_boxes_.size());
        triangle_boxes_.emplace_back();
    }
    const auto cluster = static_cast<std::size_t>(group) * fan + i;
    const FloatPoint* const points = points_.data() + opened.points;
    SixteenBoxes& boxes = triangle_boxes_[static_cast<std::size_t>(place)];
    kernels_.boxes_of_triangles(points, clusters.corners[cluster], boxes);
    if (clock_.path) {
        SixteenBoxes before;
        kernels_.boxes_of_triangles(points + clusters.vertices_of_group.count(group), clusters.corners[cluster],
                                    before);
        unite(before, boxes);
    }
    opened.with_triangles |= 1U << i;
}

}  // namespace trocar
