#include "detect/ohc_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "detect/swept.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

/// The smallest range that holds both.
CellRange hull(const CellRange& a, const CellRange& b) {
    if (is_empty(a)) return b;
    if (is_empty(b)) return a;
    return {cell_min(a.low, b.low), cell_max(a.high, b.high)};
}

}  // namespace

void OhcBodies::prepare(const Topology& topology, const Frame& frame) {
    topology_ = &topology;
    const std::size_t bodies = topology.bodies.size();
    filter_.prepare(topology);
    order_.clear();
    for (Index number = 0; number < topology.body_count(); ++number) {
        const bool may_hit_any =
            std::ranges::any_of(filter_.mask(number), [](std::uint64_t word) { return word != 0; });
        if (may_hit_any && body(number).triangles.count > 0) order_.push_back(number);
    }
    const auto rank = [this](Index number) {
        const BodyRange& range = body(number);
        return std::pair(settings_.limited() && range.kind != BodyKind::instrument, range.triangles.count);
    };
    std::stable_sort(order_.begin(), order_.end(), [&rank](Index a, Index b) { return rank(a) < rank(b); });
    make_groups();
    boxes_.resize(bodies);
    wide_boxes_.resize(bodies);
    meeting_.prepare(bodies);
    cells_.prepare(topology);
    query_distance_ = 0.0;
    cell_edge_ = 0.0;
    choose_cell(frame);
}

/// Bodies with equal masks become a group: neither is in its own mask, so they cannot collide.
void OhcBodies::make_groups() {
    const auto same = [this](Index a, Index b) { return std::ranges::equal(filter_.mask(a), filter_.mask(b)); };
    // Moves each body up to the first one of its group.
    groups_.clear();
    for (std::size_t begin = 0; begin < order_.size();) {
        const Index first = order_[begin];
        const auto end = std::stable_partition(order_.begin() + static_cast<std::ptrdiff_t>(begin), order_.end(),
                                               [&](Index number) { return same(first, number); });
        const auto past = static_cast<std::size_t>(end - order_.begin());
        groups_.push_back({.first_body = begin, .end_body = past});
        begin = past;
    }
}

void OhcBodies::set_query_distance(double query_distance) {
    query_distance_ = query_distance;
    for (const Group& group : groups_) {
        const bool first_of_two = groups_.size() == 2 && &group == &groups_.front();
        const double growth = first_of_two ? query_distance : groups_.size() == 2 ? 0.0 : 0.5 * query_distance;
        for (std::size_t k = group.first_body; k < group.end_body; ++k) cells_.grow(order_[k], growth);
    }
}

void OhcBodies::choose_cell(const Frame& frame) {
    if (!is_answerable(*topology_, frame)) return;
    Vector3 corner = Vector3::Zero();
    if (frame.position.cols() > 0) corner = frame.position.rowwise().minCoeff();
    double edge = settings_.cell;
    if (std::isnan(edge)) {
        double shortest = std::numeric_limits<double>::infinity();
        double shortest_moving = shortest;
        double sum = 0.0;
        double count = 0.0;
        for (const Index number : order_) {
            const BodyRange& range = body(number);
            const double length = edge_length(frame, range.triangles);
            sum += length;
            count += 3.0 * range.triangles.count;
            const double mean = length / (3.0 * range.triangles.count);
            if (!(mean > 0.0)) continue;
            shortest = std::min(shortest, mean);
            if (range.kind != BodyKind::rigid) shortest_moving = std::min(shortest_moving, mean);
        }
        if (std::isfinite(shortest_moving)) shortest = shortest_moving;
        edge = std::max(1.5 * shortest, sum / count);
        if (!(edge > 0.0) || !std::isfinite(edge)) {
            cells_.lattice().set(1.0, corner);  // all points coincide; repeated in the next tick
            return;
        }
    }
    cell_edge_ = edge;
    cells_.lattice().set(edge, corner);
}

double OhcBodies::edge_length(const Frame& frame, Range triangles) const {
    double sum = 0.0;
    for (Index t = triangles.first; t < triangles.end(); ++t) {
        const auto v = topology_->triangles.col(t);
        for (int k = 0; k < 3; ++k) sum += (frame.position.col(v((k + 1) % 3)) - frame.position.col(v(k))).norm();
    }
    return sum;
}

bool OhcBodies::read_boxes(const Frame& frame) {
    if (frame.position.cols() != topology_->vertex_count) return false;
    cells_.set_path(settings_.swept && has_path(*topology_, frame));
    paths_.assign(cells_.path() ? boxes_.size() : 0, {});
    bool finite = true;
    for (std::size_t number = 0; number < boxes_.size(); ++number) {
        const Range vertices = topology_->bodies[number].vertices;
        boxes_[number] = Extent{};
        if (vertices.count == 0) continue;
        const std::size_t first = 3 * at(vertices.first);
        finite &= kernels_.box_of_run(frame.position.data() + first, vertices.count, boxes_[number]);
        if (cells_.path()) {
            BoxOnPath<Extent>& path = paths_[number];
            finite &= kernels_.box_of_run(frame.previous.data() + first, vertices.count, path.start);
            path.end = boxes_[number];
            boxes_[number].add(path.start);
        }
    }
    if (finite && cells_.path()) find_parts();
    return finite;
}

/// Finds, for bodies that move far, the part of their path that passes others within the query distance: the hull of
/// all such parts. For other bodies it is the whole path.
void OhcBodies::find_parts() {
    constexpr double far = 2.0;  // times their own size
    parts_.assign(paths_.size(), {});
    for (const Index body : order_) {
        const BoxOnPath<Extent>& path = paths_[at(body)];
        double size = 0.0;
        double length = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
            size = std::max(size, path.end.high[k] - path.end.low[k]);
            length = std::max(length, std::abs(path.end.low[k] - path.start.low[k]));
        }
        if (length <= far * size) continue;
        const BoxOnPath<Extent> near{path.start.grown(query_distance_), path.end.grown(query_distance_)};
        TickPart hull{1.0, 0.0};
        for (const Index other : order_) {
            if (other == body || !filter_.may_hit(body, other)) continue;
            const TickPart part = part_of_meeting(near, paths_[at(other)]);
            if (part.empty()) continue;
            hull = {std::min(hull.first, part.first), std::max(hull.last, part.last)};
        }
        parts_[at(body)] = hull.empty() ? TickPart{0.0, 0.0} : hull;
    }
    cells_.set_path(true, parts_);
}

CellRange OhcBodies::place_groups() {
    if (Lattice::at_limit(place_all())) {
        // A body is more than 2^30 cells from the old corner: choose a corner at the bodies' present place.
        Extent all;
        for (const Extent& box : boxes_) all.add(box);
        cells_.lattice().set(cells_.lattice().edge(), Vector3(all.low[0], all.low[1], all.low[2]));
        place_all();
    }
    for (const Index number : order_) wide_boxes_[at(number)] = wide_box(number);
    meeting_.find(order_, wide_boxes_, [this](Index a, Index b) { return filter_.may_hit(a, b); });
    CellRange meeting = no_cells;
    for (const Index number : order_) {
        for (const Extent& part : meeting_.of(number)) meeting = hull(meeting, cells_of(part));
    }
    return meeting;
}

/// The body's box with the margin of its triangles.
Extent OhcBodies::wide_box(Index number) const { return boxes_[at(number)].grown(cells_.around(number)); }

CellRange OhcBodies::cells_of(const Extent& box) const {
    return {cells_.lattice().cell(Vector3(box.low[0], box.low[1], box.low[2])),
            cells_.lattice().cell(Vector3(box.high[0], box.high[1], box.high[2]))};
}

CellRange OhcBodies::place_all() {
    CellRange all = no_cells;
    for (Group& group : groups_) {
        group.range = no_cells;
        for (std::size_t k = group.first_body; k < group.end_body; ++k) {
            group.range = hull(group.range, cells_of(wide_box(order_[k])));
        }
        all = hull(all, group.range);
    }
    return all;
}

}  // namespace trocar
