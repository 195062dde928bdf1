// Float boxes for ohc_clustered's descent (clustered_descent.hpp): of a region's groups, a group's clusters, a
// cluster's triangles. A box is computed on first use ("opened") and kept until it moves. Stored boxes do not include
// the query distance, so they outlast a change of it; the descent adds it to one box of each pair.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "detect/cluster_kernels.hpp"
#include "detect/clustered_bodies.hpp"
#include "detect/clustered_regions.hpp"
#include "detect/clustered_work.hpp"
#include "detect/ohc_work.hpp"
#include "detect/tick_part.hpp"

namespace trocar {

class ClusteredBoxes {
public:
    /// A group whose clusters are examined.
    struct Group {
        SixteenBoxes clusters;
        std::array<std::int32_t, fan> triangles{};  ///< places of its clusters in triangle_boxes_, -1 if none
        FloatBox box;
        BoxOnPath<FloatBox> path;  ///< swept: the box at both ends of the tick
        std::size_t points = 0;    ///< first vertex in points_; swept: followed by those of the frame before
        std::int64_t opened_at = -1;
        std::int64_t asked_at = -1;
        bool with_clusters = false;        ///< `clusters` is up to date
        std::uint32_t with_triangles = 0;  ///< bit per cluster: its triangle boxes are up to date
    };

    ClusteredBoxes(const ClusteredSettings& settings, const ClusteredBodies& bodies, ClusteredRegions& regions,
                   const ClusteredClock& clock, OhcWork& work)
        : settings_(settings),
          kernels_(kernels_of(settings, cluster_kernels())),
          vertex_kernels_(kernels_of(settings, vertex_kernels())),
          bodies_(bodies),
          regions_(regions),
          clock_(clock),
          work_(work) {}

    /// Forgets everything. Reserves room for all boxes of small scenes and for an ordinary contact in large ones, so
    /// that ticks need not allocate.
    void build();
    /// Starts the descent of a tick: chooses the FloatFrame, and forgets all boxes when most were not used in the last
    /// tick. Precondition: meetings exist.
    void start();

    [[nodiscard]] FloatBox to_float(const Extent& box) const {
        FloatBox result{};
        for (std::size_t k = 0; k < 3; ++k) {
            result.low[k] = to_float(box.low[k], k);
            result.high[k] = to_float(box.high[k], k);
        }
        return result;
    }

    /// The box grown by the tick's query distance.
    [[nodiscard]] FloatBox within_query_distance(const FloatBox& box) const {
        if (query_distance_ == 0.0F) return box;
        FloatBox result{};
        for (std::size_t k = 0; k < 3; ++k) {
            result.low[k] = grown_down(box.low[k], query_distance_);
            result.high[k] = grown_up(box.high[k], query_distance_);
        }
        return result;
    }
    /// Sixteen boxes grown by the tick's query distance, stored in `room` unless it is 0.
    [[nodiscard]] const SixteenBoxes& within_query_distance(const SixteenBoxes& boxes, SixteenBoxes& room) const {
        if (query_distance_ == 0.0F) return boxes;
        kernels_.grow(boxes, query_distance_, room);
        return room;
    }

    /// Updates the boxes of a region's groups, as unions of blocks; false when the budget does not allow it.
    bool open_region(Index number);
    /// Stays valid while groups are opened. Precondition: open_region returned true.
    [[nodiscard]] const SixteenBoxes& groups_of(Index region) const {
        return regions_opened_[static_cast<std::size_t>(place_of_region_[static_cast<std::size_t>(region)])].groups;
    }

    [[nodiscard]] bool is_open(const MovingBody& moving, Index group) const {
        const std::int32_t place = place_of_group_[moving.first_group + static_cast<std::size_t>(group)];
        return place >= 0 &&
               groups_opened_[static_cast<std::size_t>(place)].opened_at >= moving.boxes->group_moved_at(group);
    }
    /// Place of the group, with its float vertices and their box up to date; -1 when the budget does not allow it.
    std::int32_t open_group(const Frame& frame, const MovingBody& moving, Index group);
    /// False when two open groups, or their clusters i and j, are never within the query distance at the same time.
    /// Precondition: swept; for clusters, clusters_of was called for both.
    [[nodiscard]] bool may_meet_on_path(std::int32_t first, std::int32_t second) const;
    [[nodiscard]] bool may_meet_on_path(std::int32_t first, std::size_t i, std::int32_t second, std::size_t j) const;
    /// Valid until the next open_group.
    [[nodiscard]] Group& group(std::int32_t place) { return groups_opened_[static_cast<std::size_t>(place)]; }
    /// Cluster boxes of an open group.
    const SixteenBoxes& clusters_of(const ClusteredBody& clusters, Index group, std::int32_t place) {
        if (!groups_opened_[at(place)].with_clusters) box_clusters(clusters, group, place);
        return groups_opened_[at(place)].clusters;
    }

    /// Place of the triangle boxes of an open group's cluster i.
    std::size_t open_cluster(const ClusteredBody& clusters, Index group, Group& opened, std::size_t i) {
        if (((opened.with_triangles >> i) & 1U) == 0) box_triangles(clusters, group, opened, i);
        return static_cast<std::size_t>(opened.triangles[i]);
    }
    /// Valid until the next open_cluster.
    [[nodiscard]] const SixteenBoxes& triangles(std::size_t place) const { return triangle_boxes_[place]; }

private:
    struct Region {
        std::int64_t opened_at = -1;
        SixteenBoxes groups;
    };

    static std::size_t at(std::int32_t place) { return static_cast<std::size_t>(place); }
    void choose_floats();
    void forget();
    float to_float(double x, std::size_t axis) const {
        return static_cast<float>((x - floats_.origin[axis]) * floats_.scale);
    }
    void box_clusters(const ClusteredBody& clusters, Index group, std::int32_t place);
    void box_triangles(const ClusteredBody& clusters, Index group, Group& opened, std::size_t i);

    const ClusteredSettings& settings_;
    const ClusterKernels& kernels_;
    const VertexKernels& vertex_kernels_;
    const ClusteredBodies& bodies_;
    ClusteredRegions& regions_;
    const ClusteredClock& clock_;
    OhcWork& work_;
    FloatFrame floats_;
    float query_distance_ = 0.0F;                ///< query distance of the tick, in the unit of floats_
    std::vector<std::int32_t> place_of_region_;  ///< in regions_opened_, -1 if none
    std::vector<std::int32_t> place_of_group_;  ///< in groups_opened_, indexed from MovingBody::first_group; -1 if none
    std::vector<Region> regions_opened_;
    std::vector<Group> groups_opened_;
    std::vector<BoxOnPath<SixteenBoxes>> cluster_paths_;  ///< swept: per opened group, its clusters at both ends of the
                                                          ///< tick
    std::size_t groups_asked_ = 0;                        ///< groups used since the last tick began
    std::vector<FloatPoint> points_;
    std::vector<SixteenBoxes> triangle_boxes_;
};

}  // namespace trocar
