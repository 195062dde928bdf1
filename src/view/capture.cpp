#include "view/capture.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar {

std::vector<Index> tissue_vertices(const Topology& topology) {
    std::vector<Index> vertices;
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index vertex = body.vertices.first; vertex < body.vertices.end(); ++vertex) vertices.push_back(vertex);
    }
    return vertices;
}

RunCapture::RunCapture(const Topology& topology, std::int64_t stride, bool judged, Index tool)
    : stride_(stride), judged_(judged), tool_(tool), tissue_(tissue_vertices(topology)) {
    for (const BodyRange& body : topology.bodies) {
        if (body.kind == BodyKind::tissue) continue;
        for (Index vertex = body.vertices.first; vertex < body.vertices.end(); ++vertex) others_.push_back(vertex);
    }
}

/// A tool's tip that goes through a coarse sheet takes no vertex of the sheet into itself: what it is beyond is painted
/// where it is.
void RunCapture::sink_into_tissue(const PlayedFrame& frame, std::vector<double>& depth) const {
    if (tissue_.empty()) return;
    for (const Index vertex : others_) {
        const double sunk = frame.depth[static_cast<std::size_t>(vertex)];
        if (!(sunk > 0.0)) continue;
        const Vector3 place = frame.position.col(vertex);
        std::size_t nearest = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < tissue_.size(); ++k) {
            const double distance = (frame.position.col(tissue_[k]) - place).squaredNorm();
            if (distance < least) {
                least = distance;
                nearest = k;
            }
        }
        depth[nearest] = std::max(depth[nearest], sunk);
    }
}

ViewedFrame RunCapture::kept(const PlayedFrame& frame) const {
    ViewedFrame view;
    view.tick = frame.tick;
    view.position = frame.position;
    for (const Index vertex : tissue_) {
        const double depth = frame.depth[static_cast<std::size_t>(vertex)];
        view.depth.push_back(std::isfinite(depth) ? depth : 0.0);
        view.strain.push_back(std::abs(frame.strain[static_cast<std::size_t>(vertex)]));
    }
    sink_into_tissue(frame, view.depth);
    Vector3 pushed = Vector3::Zero();
    double force = 0.0;
    for (const PlayedContact& contact : frame.contacts) {
        // A generated contact of two features that are apart is not shown.
        const bool apart = contact.kind == ActingKind::found && !(contact.depth > 0.0);
        if (apart || !contact.point.allFinite()) continue;
        if (tool_ >= 0 && (contact.body == tool_ || contact.other == tool_) && contact.force.allFinite()) {
            pushed += contact.force.norm() * contact.point;
            force += contact.force.norm();
        }
        view.contacts.push_back(
            {.point = contact.point, .force = contact.force.allFinite() ? contact.force : Vector3::Zero()});
    }
    if (force > 0.0) view.tool_point = pushed / force;
    return view;
}

void RunCapture::see(const PlayedFrame& frame) {
    ViewedFrame view = kept(frame);
    for (std::size_t k = 0; k < tissue_.size(); ++k) {
        run_.depth_max = std::max(run_.depth_max, view.depth[k]);
        run_.strain_max = std::max(run_.strain_max, view.strain[k]);
        run_.displacement_max = std::max(run_.displacement_max, frame.displacement.col(tissue_[k]).norm());
    }
    for (const ViewedContact& contact : view.contacts) {
        run_.contact_force_max = std::max(run_.contact_force_max, contact.force.norm());
    }
    const double depth = judged_ ? frame.row.residual_penetration : frame.deepest_vertex();
    const double force = frame.row.tool_force.norm();
    run_.depth.push_back(depth);
    run_.force.push_back(frame.row.tool_force);
    run_.contacts.push_back(judged_ ? frame.row.contacts_offered : -1);
    if (depth > run_.worst_depth.value || (run_.worst_depth.tick < 0 && std::isfinite(depth))) {
        run_.worst_depth = {frame.tick, depth};
        deepest_ = view;
    }
    if (force > run_.worst_force.value || (run_.worst_force.tick < 0 && std::isfinite(force))) {
        run_.worst_force = {frame.tick, force};
        strongest_ = view;
    }
    if (frame.tick % stride_ == 0) run_.frames.push_back(view);
    last_ = std::move(view);
}

ViewedRun RunCapture::finish() {
    for (ViewedFrame* extra : {&deepest_, &strongest_, &last_}) {
        const auto place =
            std::lower_bound(run_.frames.begin(), run_.frames.end(), extra->tick,
                             [](const ViewedFrame& frame, std::int64_t tick) { return frame.tick < tick; });
        if (extra->tick < 0 || (place != run_.frames.end() && place->tick == extra->tick)) continue;
        run_.frames.insert(place, std::move(*extra));
    }
    return std::move(run_);
}

}  // namespace trocar
