// A complete detector to copy: one file like this one and one line in baselines/CMakeLists.txt,
//
//     trocar_add_detector(example)                              or, with a library,
//     trocar_add_detector(my_method NEEDS some_library::target)
//
// and `trocar list`, the contract tests, the micro benchmarks, the studies and the report know it. The method found
// here is a plain one: sort the triangles' boxes along one axis, sweep, decide what is left exactly.
//
// Say in this comment which settings of your library you changed from its defaults, and why (README.md, rule 1).
#include "geometry/box_pairs.hpp"
#include "geometry/exact.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {  // nothing but the entry function at the end is visible to the outside

class Example final : public Detector {
public:
    // Once per run. The topology (triangles, bodies, which bodies are tested) stays the same and outlives the run.
    // `frame` holds the first positions; bad ones must not hurt here, detect reports them.
    void prepare(const Topology& topology, const Frame& /*frame*/) override { topology_ = &topology; }

    // Once per tick: follow the moved vertices. Here belongs what a library calls refit or rebuild; its time is shown
    // in a column of its own. With a query distance (m) above 0 also pairs that come as near as that are wanted, in
    // contacts.near; a method that can answer this says so in its entry (.query_distance), this one refuses.
    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        if (is_answerable(*topology_, frame)) triangle_boxes(frame.position, topology_->triangles, boxes_);
    }

    // Once per tick, with the frame that update saw: all intersecting pairs of the body pairs that the topology lists.
    // Never throw: catch what your library throws and say so in contacts.outcome.
    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;  // NaN in, outcome not_finite out
        if (!check_no_query_distance(query_distance_, contacts)) return;
        for (const auto& [body_a, body_b] : topology_->body_pairs) {
            overlapping_boxes(boxes_, topology_->bodies[static_cast<std::size_t>(body_a)].triangles,
                              topology_->bodies[static_cast<std::size_t>(body_b)].triangles, candidates_);
            for (const auto& [a, b] : candidates_) {
                ++contacts.work.triangle_tests;  // counters are yours to fill; they make no difference to the answer
                if (triangles_intersect(corners(frame, a), corners(frame, b))) contacts.pairs.push_back({a, b});
            }
        }
        contacts.sort();  // sorted by (a, b), a < b, each pair once
    }

private:
    [[nodiscard]] Corners corners(const Frame& frame, Index triangle) const {
        return corners_of(topology_->triangles, frame.position, triangle);
    }

    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    // Buffers are members and keep their memory: after the first ticks nothing is allocated any more.
    std::vector<Box> boxes_;
    std::vector<IndexPair> candidates_;
};

}  // namespace

// The one function that the CMake line searches for: <name>_detector. Settings that a user may want to sweep are
// declared in `.parameters` and reach the maker checked; fcl_bvh.cpp shows how.
DetectorEntry example_detector() {
    return {.name = "example",
            .configuration = "double precision; sweep along one axis, exact triangle test",
            .own = true,
            .claims_exact = true,
            .make = [](const ParameterValues&) { return std::make_unique<Example>(); }};
}

}  // namespace trocar
