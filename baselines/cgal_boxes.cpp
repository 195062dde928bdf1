// CGAL's box_intersection_d (hybrid of segment trees and sweep) on the triangles' boxes, followed by our exact triangle
// test. The header is GPL-3: built only with -DTROCAR_GPL=ON, and such a binary must not be redistributed under
// Apache-2.0.
//
// Settings, and where they depart from the library's default:
// * boxes are rebuilt each tick in double; the algorithm has no state to keep.
// * closed boxes (the default topology); `cutoff`, below which segment trees give way to a sweep, is 10, the default.
// * within a query distance every box has half of it added on all sides.
// * two bodies whose boxes do not overlap are not asked about, as with the other libraries that are asked body by body.
// * the algorithm permutes its arrays: they are refilled each tick, so the order of one tick cannot speed up the next.
#include <CGAL/box_intersection_d.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "candidates.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

using TriangleBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, Index>;

class CgalBoxes final : public Detector {
public:
    explicit CgalBoxes(std::ptrdiff_t cutoff) : cutoff_(cutoff) {}
    void prepare(const Topology& topology, const Frame& /*frame*/) override {
        topology_ = &topology;
        boxes_.assign(topology.bodies.size(), {});
        body_boxes_.assign(topology.bodies.size(), {});
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            boxes_[i].reserve(static_cast<std::size_t>(topology.bodies[i].triangles.count));
        }
    }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        if (!is_answerable(*topology_, frame)) return;
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            fill(frame, i, boxes_[i]);
            body_boxes_[i] = baselines::box_of_body(frame, topology_->bodies[i]).grown(query_distance_ / 2.0);
        }
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        contacts.query_distance = query_distance_;
        const auto test = [this, &frame, &contacts](const TriangleBox& a, const TriangleBox& b) {
            baselines::test_candidate(*topology_, frame, a.info(), b.info(), contacts);
        };
        for (auto [a, b] : topology_->body_pairs) {
            if (!body_boxes_[static_cast<std::size_t>(a)].overlaps(body_boxes_[static_cast<std::size_t>(b)])) continue;
            auto& boxes_a = boxes_[static_cast<std::size_t>(a)];
            auto& boxes_b = boxes_[static_cast<std::size_t>(b)];
            CGAL::box_intersection_d(boxes_a.begin(), boxes_a.end(), boxes_b.begin(), boxes_b.end(), test, cutoff_);
        }
        contacts.sort();
    }

private:
    void fill(const Frame& frame, std::size_t body, std::vector<TriangleBox>& boxes) const {
        boxes.clear();
        const Range triangles = topology_->bodies[body].triangles;
        for (Index t = triangles.first; t < triangles.end(); ++t) {
            const Box box = box_of(corners_of(topology_->triangles, frame.position, t)).grown(query_distance_ / 2.0);
            boxes.emplace_back(
                CGAL::Bbox_3(box.min.x(), box.min.y(), box.min.z(), box.max.x(), box.max.y(), box.max.z()), t);
        }
    }

    std::ptrdiff_t cutoff_;
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    std::vector<std::vector<TriangleBox>> boxes_;
    std::vector<Box> body_boxes_;
};

}  // namespace

DetectorEntry cgal_boxes_detector();
DetectorEntry cgal_boxes_detector() {
    return {.name = "cgal_boxes",
            .library = "CGAL",
            .version = CGAL_VERSION_STR,
            .configuration = "box_intersection_d (GPL-3), double boxes; candidates decided by trocar's exact test",
            .query_distance = true,
            .parameters = {integer_parameter("cutoff", "10", 1, 1e9,
                                             "sets of fewer boxes are swept instead of divided further")},
            .make = [](const ParameterValues& parameters) {
                return std::make_unique<CgalBoxes>(static_cast<std::ptrdiff_t>(parameters.integer("cutoff")));
            }};
}

}  // namespace trocar
