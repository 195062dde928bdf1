// First stage of ohc_clustered's cascade: selects the bodies that take part, builds their clusters and reads their
// vertices. It reads the frame by body and updates the boxes of blocks and regions (block_boxes.hpp). Bodies are not
// compared here.
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

struct MovingBody {
    Index body = -1;
    ClusteredBody clusters;
    std::unique_ptr<BlockBoxes> boxes;
    std::size_t first_region = 0;  ///< number of this body's first region among those of all bodies
    std::size_t first_group = 0;   ///< number of this body's first group among those of all bodies
};

class ClusteredBodies {
public:
    ClusteredBodies(const ClusteredSettings& settings, const ClusteredClock& clock)
        : settings_(settings), kernels_(kernels_of(settings, vertex_kernels())), clock_(clock) {}

    /// Finds the bodies that may collide with another.
    void prepare(const Topology& topology);
    /// Builds the clusters. The frame affects their order and never the answer. Nothing is read.
    void build(const Frame& frame);

    /// Selects the blocks of `ranges` and returns how many vertices `read` reads; blocks are read as a whole.
    std::int64_t ask(const std::vector<Range>& ranges);
    /// Updates the boxes of all blocks and regions that moved, at time clock.now: of all blocks (`whole`) or of the
    /// selected ones. False when a number is not finite.
    bool read(const Frame& frame, bool whole);

    [[nodiscard]] const Topology& topology() const { return *topology_; }
    /// Bodies that take part. Under a limit instruments come first, so that truncation affects them least.
    [[nodiscard]] const std::vector<MovingBody>& all() const { return bodies_; }
    [[nodiscard]] const MovingBody& moving(Index owner) const { return bodies_[static_cast<std::size_t>(owner)]; }
    [[nodiscard]] std::size_t region_count() const { return region_count_; }
    [[nodiscard]] std::size_t group_count() const { return group_count_; }
    /// Whether at least two bodies have a part that did not move since the last answer.
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
    std::vector<bool> tested_;  ///< per body: may collide with another
    std::vector<MovingBody> bodies_;
    std::vector<Index> owner_of_body_;      ///< number in bodies_, -1 if none
    std::vector<Index> place_of_triangle_;  ///< in its body's clusters
    std::vector<Range> unused_vertices_;    ///< of bodies that take no part
    std::vector<Range> unused_moved_;       ///< moved vertices of those
    std::size_t region_count_ = 0;
    std::size_t group_count_ = 0;
};

}  // namespace trocar
