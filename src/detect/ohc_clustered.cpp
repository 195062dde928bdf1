// ohc_clustered: the cascade of ohc for meshes with fixed topology. ohc spends most of a tick on the place of every
// triangle. Here only vertices are read, as a stream, and triangles only near other bodies. Each level holds sixteen of
// the next, compact in space and fixed at the start (clusters.hpp). A tick is a cascade: each level passes on what it
// could not rule out. This file decides the order of levels and declares the parameters:
//
// * blocks [update]: up to 64 vertices, cut where their order jumps. Boxes by minimum and maximum in memory order;
//   unmoved blocks are skipped (clustered_bodies.hpp, block_boxes.hpp).
// * regions [boxes: update, pairs: detect]: 16 groups; the box is the union over their blocks. Cell, object and
//   primitive map (cell_map.hpp) hold regions as primitives and give each pair that shares a cell once, over all
//   bodies. The list is renewed only when a region leaves its entered cells (clustered_regions.hpp).
// * groups [detect]: 16 clusters, for regions whose boxes overlap. From here on each step tests a box against sixteen
//   (clustered_descent.hpp, kernels in cluster_kernels.hpp).
// * clusters [detect]: 16 triangles, for groups whose boxes overlap. The group's vertices are converted to float.
// * triangles [detect]: for clusters whose boxes overlap. Candidates are pairs of triangles whose boxes overlap
//   (clustered_boxes.hpp has the boxes of groups, clusters and triangles).
// * pairs [detect]: the exact test (narrow_phase.hpp), with swept=on also the continuous one (swept.hpp). Limits and
//   reuse of the last tick's pairs are in clustered_answer.hpp.
//
// No pair is lost: each box encloses its content. Cell numbers (lattice.hpp) and floats (cluster_kernels.hpp) are
// monotone functions of coordinates, so overlapping boxes stay overlapping. Pairs of two unmoved groups are not
// examined: their triangle pairs are those of the last tick. The query distance is added to one box of each pair on all
// sides, and the last answer is reused while it stays the same. With swept=on every box holds both ends of the tick,
// and everything is renewed in every tick.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "detect/cluster_kernels.hpp"
#include "detect/clustered_answer.hpp"
#include "detect/clustered_bodies.hpp"
#include "detect/clustered_boxes.hpp"
#include "detect/clustered_descent.hpp"
#include "detect/clustered_regions.hpp"
#include "detect/clustered_work.hpp"
#include "detect/ohc_work.hpp"
#include "detect/shared_parameters.hpp"
#include "detect/swept.hpp"
#include "detect/triangle_filter.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

class OhcClustered final : public Detector {
public:
    explicit OhcClustered(const ClusteredSettings& settings)
        : settings_(settings), answer_(settings_, kernels_of(settings, triangle_filters()), bodies_, clock_, work_) {
        work_.budget = settings.work_budget;
    }

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        bodies_.prepare(topology);
        regions_.prepare(topology);
        answer_.prepare();
        clock_.path = false;  // the frame before belongs to another world
        ready_ = false;
        if (is_answerable(topology, frame)) build(frame);
    }

    void update(const Frame& frame, double query_distance) override {
        work_.start();
        if (std::exchange(clock_.query_distance, query_distance) != query_distance)
            clock_.answered_at = ClusteredClock::never;
        clock_.path = false;
        if (frame.position.cols() != topology_->vertex_count) {
            answerable_ = false;
            ready_ = false;
            return;
        }
        if (!ready_) {
            answerable_ = is_answerable(*topology_, frame);
            if (answerable_) build(frame);
        }
        if (ready_) {
            clock_.path = settings_.swept && has_path(*topology_, frame);
            const bool whole = !known_ || !frame.moved || settings_.swept;
            const std::int64_t vertices = whole ? topology_->vertex_count : bodies_.ask(*frame.moved);
            if (work_.spend(work_.counters.vertices_read, clock_.path ? 2 * vertices : vertices)) {
                answerable_ = read(frame, whole);
                known_ = answerable_;
            } else {
                known_ = false;
                answerable_ = is_answerable(*topology_, frame);
            }
        }
        after_update_ = work_;
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!answerable_) {
            if (!check_frame(*topology_, frame, contacts)) return;
            contacts.outcome = {OutcomeKind::unsupported, "detect was called with another frame than update"};
            return;
        }
        contacts.query_distance = clock_.query_distance;
        work_ = after_update_;
        descent_.clear();
        if (bodies_.all().size() > 1) {
            if (settings_.limited()) answer_.test_last_pairs(frame, contacts);
            if (!work_.truncated) find_candidates(frame);
            answer_.test_candidates(frame, descent_.candidates(), contacts);
            answer_.keep_unmoved_pairs(contacts);
        }
        answer_.close(contacts);
        clock_.answered_at =
            work_.truncated || settings_.limited() || settings_.swept ? ClusteredClock::never : clock_.now;
        contacts.work = work_.counters;
        contacts.truncated = work_.truncated;
    }

private:
    /// Runs before the first tick, or before the first valid one.
    void build(const Frame& frame) {
        bodies_.build(frame);
        regions_.build();
        boxes_.build();
        descent_.build();
        answer_.build();
        clock_.answered_at = ClusteredClock::never;
        ready_ = true;
        known_ = read(frame, true);
    }

    /// Level of update: boxes of all blocks and regions that moved, and the cells of those regions. False when a number
    /// is not finite.
    bool read(const Frame& frame, bool whole) {
        ++clock_.now;
        if (!bodies_.read(frame, whole)) return false;
        regions_.follow();
        return true;
    }

    /// Levels of detect above the triangle test; each may end the tick.
    void find_candidates(const Frame& frame) {
        regions_.find_pairs();
        if (!work_.truncated) regions_.find_meetings();
        if (work_.truncated || regions_.meetings().empty()) return;
        boxes_.start();
        for (const ClusteredRegions::Pair& pair : regions_.meetings()) {
            descent_.pair_regions(frame, pair);
            if (work_.truncated) return;
        }
    }

    ClusteredSettings settings_;
    const Topology* topology_ = nullptr;
    OhcWork work_;
    OhcWork after_update_;
    ClusteredClock clock_;
    ClusteredBodies bodies_{settings_, clock_};
    ClusteredRegions regions_{bodies_, clock_, work_};
    ClusteredBoxes boxes_{settings_, bodies_, regions_, clock_, work_};
    ClusteredDescent descent_{settings_, regions_, boxes_, clock_, work_};
    ClusteredAnswer answer_;
    bool ready_ = false;       ///< clusters are built
    bool known_ = false;       ///< block boxes are up to date with the last frame
    bool answerable_ = false;  ///< the last update's frame was valid
};

}  // namespace

DetectorEntry ohc_clustered_detector() {
    return {
        .name = "ohc_clustered",
        .configuration =
            std::string("double precision boxes of vertex blocks, float boxes of triangles; exact triangle test; "
                        "one thread; vectors: ") +
            cluster_kernels().front().target,
        .own = true,
        .claims_exact = true,
        .query_distance = true,
        .parameters = {choice_parameter(
                           "order", "auto", {"auto", "given", "local"},
                           "vertices and triangles in the caller's order, in one made for locality, or the better one"),
                       choice_parameter("simd", "auto", {"auto", "scalar"},
                                        "the widest vectors the CPU has, or none; the answer is the same"),
                       test_parameter(), swept_parameter(), work_budget_parameter()},
        .make = [](const ParameterValues& values) {
            ClusteredSettings settings;
            if (values.is("order", "given")) settings.order = ClusterOrder::given;
            if (values.is("order", "local")) settings.order = ClusterOrder::local;
            settings.scalar = values.is("simd", "scalar");
            settings.take(values);
            return std::make_unique<OhcClustered>(settings);
        }};
}

}  // namespace trocar
