// Reference detector: every triangle against every triangle of every listed body pair. Box test first, then the exact
// triangle test and, within a query distance, the distance. All other detectors are compared with its set of pairs, so
// it stays simple.
#include "geometry/box_pairs.hpp"
#include "geometry/exact.hpp"
#include "geometry/triangle_distance.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

class BruteForce final : public Detector {
public:
    void prepare(const Topology& topology, const Frame& /*frame*/) override { topology_ = &topology; }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        if (is_answerable(*topology_, frame)) triangle_boxes(frame.position, topology_->triangles, boxes_);
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        contacts.query_distance = query_distance_;
        contacts.work.vertices_read = frame.position.cols();
        for (const auto& [body_a, body_b] : topology_->body_pairs) {
            const Range first = topology_->bodies[static_cast<std::size_t>(body_a)].triangles;
            const Range second = topology_->bodies[static_cast<std::size_t>(body_b)].triangles;
            for (Index a = first.first; a < first.end(); ++a) {
                const Box around = boxes_[static_cast<std::size_t>(a)].grown(query_distance_);
                for (Index b = second.first; b < second.end(); ++b) {
                    ++contacts.work.box_tests;
                    if (!around.overlaps(boxes_[static_cast<std::size_t>(b)])) continue;
                    test(frame, {a, b}, contacts);
                }
            }
        }
        contacts.sort();
    }

private:
    void test(const Frame& frame, TrianglePair pair, ContactSet& contacts) const {
        const Corners first = corners(frame, pair.a);
        const Corners second = corners(frame, pair.b);
        ++contacts.work.triangle_tests;
        if (triangles_intersect(first, second)) {
            contacts.pairs.push_back(pair);
            return;
        }
        if (query_distance_ == 0.0) return;
        ++contacts.work.triangle_tests;
        if (is_within_query_distance(first, second, query_distance_)) contacts.near.push_back(pair);
    }
    [[nodiscard]] Corners corners(const Frame& frame, Index triangle) const {
        return corners_of(topology_->triangles, frame.position, triangle);
    }

    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    std::vector<Box> boxes_;
};

}  // namespace

DetectorEntry brute_force_detector() {
    return {.name = "brute_force",
            .configuration = "double precision; exact triangle test; quadratic in the number of triangles",
            .own = true,
            .claims_exact = true,
            .query_distance = true,
            .make = [](const ParameterValues&) { return std::make_unique<BruteForce>(); }};
}

}  // namespace trocar
