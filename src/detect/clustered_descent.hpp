// Third stage of ohc_clustered's cascade: descends from two regions that meet to the triangles whose boxes overlap.
// Every level tests a box against sixteen at a time (cluster_kernels.hpp). clustered_boxes.hpp computes and keeps the
// boxes. No triangle is tested here.
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

    /// Reserves room for an ordinary contact.
    void build() { candidates_.reserve(ordinary_contact); }
    void clear() { candidates_.clear(); }
    /// Adds the candidates of two regions that meet, except those of two groups at rest. Ends early when the budget is
    /// spent, which OhcWork records.
    void pair_regions(const Frame& frame, const ClusteredRegions::Pair& pair);
    /// Pairs of triangles whose boxes overlap or are within the query distance, each once.
    [[nodiscard]] const std::vector<TrianglePair>& candidates() const { return candidates_; }

private:
    /// A group with the union of its blocks' boxes.
    struct GroupRef {
        const MovingBody& moving;
        Index number;
        FloatBox box;
    };
    /// One of the sixteen clusters of an open group.
    struct ClusterRef {
        const ClusteredBody& clusters;
        Index group;
        ClusteredBoxes::Group& opened;
        std::size_t number;
    };

    void descend(const Frame& frame, const ClusteredRegions::Pair& pair);
    void drop_apart(const Frame& frame, std::size_t known);
    bool spend_box_tests(std::int64_t amount) { return work_.spend(work_.counters.box_tests, amount); }
    // Inline and defined beside their only caller, so that the levels become one function.
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
