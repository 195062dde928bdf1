// First stage of ohc_clustered's cascade: which bodies take part, their clusters, and where their vertices are. All
// reading of a frame by body is here, with the boxes of blocks and regions that come of it (block_boxes.hpp); no body
// is held against another.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "detect/block_boxes.hpp"
#include "detect/clustered_work.hpp"
#include "detect/clusters.hpp"
#include "detect/vertex_kernels.hpp"
#include "scene/world.hpp"

namespace trocar {

/// One body during the run.
struct MovingBody {
    Index body = -1;
    ClusteredBody clusters;
    std::unique_ptr<BlockBoxes> boxes;
    std::size_t first_region = 0;  ///< of this body among the regions of all
    std::size_t first_group = 0;   ///< of this body among the groups of all
};

class ClusteredBodies {
public:
    ClusteredBodies(const ClusteredSettings& settings, const ClusteredClock& clock)
        : settings_(settings), kernels_(kernels_of(settings, vertex_kernels())), clock_(clock) {}

    /// Finds out who can hit anyone at all.
    void prepare(const Topology& topology);
    /// Makes the clusters; the frame decides their order, never the answer. Nothing is read.
    void build(const Frame& frame);

    /// How many vertices `read` will examine when these moved: blocks are read as a whole.
    std::int64_t ask(const std::vector<Range>& ranges);
    /// Boxes of all blocks and regions that moved, at clock.now, among all or among those asked for; false when a
    /// number is not finite.
    bool read(const Frame& frame, bool whole);

    [[nodiscard]] const Topology& topology() const { return *topology_; }
    /// Bodies that take part. Under a limit instruments come first, so that what is cut off concerns them least.
    [[nodiscard]] const std::vector<MovingBody>& all() const { return bodies_; }
    [[nodiscard]] const MovingBody& moving(Index owner) const { return bodies_[static_cast<std::size_t>(owner)]; }
    [[nodiscard]] std::size_t region_count() const { return region_count_; }
    [[nodiscard]] std::size_t group_count() const { return group_count_; }
    /// Whether there are two bodies of which not all moved since the last answer.
    [[nodiscard]] bool two_rest_in_part() const;
    /// Whether the triangle's group moved since the last answer. Precondition: its body takes part.
    [[nodiscard]] bool in_moved_group(Index triangle) const {
        const Index body = topology_->body_of_triangle[static_cast<std::size_t>(triangle)];
        const Index place = place_of_triangle_[static_cast<std::size_t>(triangle)];
        return clock_.moved(
            moving(owner_of_body_[static_cast<std::size_t>(body)]).boxes->group_moved_at(place / (fan * fan)));
    }

private:
    const ClusteredSettings& settings_;
    const VertexKernels& kernels_;
    const ClusteredClock& clock_;
    const Topology* topology_ = nullptr;
    std::vector<bool> tested_;  ///< per body: may hit another
    std::vector<MovingBody> bodies_;
    std::vector<Index> owner_of_body_;      ///< number in bodies_, -1 if none
    std::vector<Index> place_of_triangle_;  ///< in its body's clusters
    std::vector<Range> unused_vertices_;    ///< of bodies that take no part
    std::vector<Range> unused_moved_;       ///< of those, what moved
    std::size_t region_count_ = 0;
    std::size_t group_count_ = 0;
};

}  // namespace trocar
