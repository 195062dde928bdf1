// Third stage of ohc_clustered's cascade: from two regions that meet down to the triangles whose boxes overlap. It is
// always the same step, a box against sixteen at a time (cluster_kernels.hpp); the boxes themselves are made and kept
// in clustered_boxes.hpp, and no triangle is tested here.
#pragma once

#include <vector>

#include "contact/contact.hpp"
#include "detect/cluster_kernels.hpp"
#include "detect/clustered_bodies.hpp"
#include "detect/clustered_boxes.hpp"
#include "detect/clustered_regions.hpp"
#include "detect/clustered_work.hpp"
#include "detect/ohc_work.hpp"

namespace trocar {

class ClusteredDescent {
public:
    ClusteredDescent(const ClusteredSettings& settings, const ClusteredRegions& regions, ClusteredBoxes& boxes,
                     const ClusteredClock& clock, OhcWork& work)
        : kernels_(kernels_of(settings, cluster_kernels())),
          regions_(regions),
          boxes_(boxes),
          clock_(clock),
          work_(work) {}

    /// Room for an ordinary contact.
    void build() { candidates_.reserve(ordinary_contact); }
    /// No candidates yet.
    void clear() { candidates_.clear(); }
    /// Adds the candidates of two regions that meet, groups that both rest aside. Ends early when the budget is spent,
    /// which the book of work reports.
    void pair_regions(const Frame& frame, const ClusteredRegions::Pair& pair);
    /// Pairs of triangles whose boxes overlap, or come within the query distance, each once.
    [[nodiscard]] const std::vector<TrianglePair>& candidates() const { return candidates_; }

private:
    /// A group with the box that its blocks make.
    struct GroupRef {
        const MovingBody& moving;
        Index number;
        FloatBox box;
    };
    /// One of sixteen clusters of an open group.
    struct ClusterRef {
        const ClusteredBody& clusters;
        Index group;
        ClusteredBoxes::Group& opened;
        std::size_t number;
    };

    void descend(const Frame& frame, const ClusteredRegions::Pair& pair);
    void drop_apart(const Frame& frame, std::size_t known);
    bool spend_box_tests(std::int64_t amount) { return work_.spend(work_.counters.box_tests, amount); }
    // Inline, and defined where alone they are called: the levels become one function.
    [[gnu::always_inline]] inline bool pair_groups(const Frame& frame, const GroupRef& p, const GroupRef& q);
    [[gnu::always_inline]] inline bool pair_clusters(const ClusterRef& p, const ClusterRef& q);

    const ClusterKernels& kernels_;
    const ClusteredRegions& regions_;
    ClusteredBoxes& boxes_;
    const ClusteredClock& clock_;
    OhcWork& work_;
    std::vector<TrianglePair> candidates_;
};

}  // namespace trocar
