#include "detect/swept.hpp"

#include <algorithm>
#include <tuple>

#include "detect/tick_part.hpp"
#include "detect/vertex_kernels.hpp"
#include "geometry/continuous.hpp"
#include "geometry/exact.hpp"

namespace trocar {
namespace {

MovingTriangle moving(const Topology& topology, const Frame& frame, Index triangle) {
    return moving_triangle(topology.triangles, frame.previous, frame.position, triangle);
}

bool moved(const Topology& topology, const Frame& frame, Index triangle) {
    const auto v = topology.triangles.col(triangle);
    for (int k = 0; k < 3; ++k) {
        if (frame.previous.col(v(k)) != frame.position.col(v(k))) return true;
    }
    return false;
}

BoxOnPath<Extent> box_on_path(const Topology& topology, const Frame& frame, Index triangle) {
    BoxOnPath<Extent> box;
    for (const Index v : topology.triangles.col(triangle)) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double start = frame.previous(static_cast<Eigen::Index>(axis), v);
            const double end = frame.position(static_cast<Eigen::Index>(axis), v);
            box.start.low[axis] = std::min(box.start.low[axis], start);
            box.start.high[axis] = std::max(box.start.high[axis], start);
            box.end.low[axis] = std::min(box.end.low[axis], end);
            box.end.high[axis] = std::max(box.end.high[axis], end);
        }
    }
    return box;
}

}  // namespace

bool may_meet_on_path(const Topology& topology, const Frame& frame, const TrianglePair& pair, double query_distance) {
    const BoxOnPath<Extent> path = box_on_path(topology, frame, pair.a);
    return !part_of_meeting(BoxOnPath<Extent>{path.start.grown(query_distance), path.end.grown(query_distance)},
                            box_on_path(topology, frame, pair.b))
                .empty();
}

bool either_moved(const Topology& topology, const Frame& frame, const TrianglePair& pair) {
    return moved(topology, frame, pair.a) || moved(topology, frame, pair.b);
}

void test_swept(const Topology& topology, const Frame& frame, std::span<const TrianglePair> candidates,
                std::vector<SweptContact>& swept) {
    for (const TrianglePair& pair : candidates) {
        if (!either_moved(topology, frame, pair)) continue;
        const MovingTriangle first = moving(topology, frame, pair.a);
        const MovingTriangle second = moving(topology, frame, pair.b);
        const std::optional<FirstMeeting> meeting = first_meeting(first, second);
        if (!meeting || meeting->kind == Meeting::overlap_at_start) continue;
        swept.push_back({.a = pair.a,
                         .b = pair.b,
                         .body_a = topology.body_of_triangle[static_cast<std::size_t>(pair.a)],
                         .body_b = topology.body_of_triangle[static_cast<std::size_t>(pair.b)],
                         .time = meeting->time,
                         .kind = meeting->kind == Meeting::edge_edge ? SweptKind::edge_edge : SweptKind::vertex_face});
    }
}

bool has_path(const Topology& topology, const Frame& frame) {
    return frame.previous.cols() == topology.vertex_count && frame.previous.allFinite();
}

void sort_swept(std::vector<SweptContact>& swept) {
    std::sort(swept.begin(), swept.end(), [](const SweptContact& x, const SweptContact& y) {
        return std::tie(x.a, x.b, x.body_a, x.body_b) < std::tie(y.a, y.b, y.body_a, y.body_b);
    });
}

}  // namespace trocar
