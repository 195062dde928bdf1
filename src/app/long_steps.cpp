#include "app/long_steps.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::app {

LongStepWatch::BodyMotion LongStepWatch::motion_of(const Frame& frame, const BodyRange& body) const {
    BodyMotion motion;
    for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
        motion.swept.add(frame.previous.col(v));
        motion.swept.add(frame.position.col(v));
        motion.mean += frame.position.col(v) - frame.previous.col(v);
    }
    if (body.vertices.count > 0) motion.mean /= static_cast<double>(body.vertices.count);
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        for (int corner = 0; corner < 3; ++corner) {
            const Index from = topology_->triangles(corner, t);
            const Index to = topology_->triangles((corner + 1) % 3, t);
            motion.edge += (frame.previous.col(to) - frame.previous.col(from)).norm();
        }
    }
    if (body.triangles.count > 0) motion.edge /= 3.0 * static_cast<double>(body.triangles.count);
    return motion;
}

double LongStepWatch::furthest(const Frame& frame, const BodyRange& body, const Vector3& against) const {
    double most = 0.0;
    for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
        most = std::max(most, (frame.position.col(v) - frame.previous.col(v) - against).norm());
    }
    return most;
}

void LongStepWatch::observe(const Frame& frame) {
    if (!frame.position.allFinite() || !frame.previous.allFinite()) return;
    motions_.clear();
    for (const BodyRange& body : topology_->bodies) motions_.push_back(motion_of(frame, body));
    bool is_long = false;
    for (const auto& pair : topology_->body_pairs) {
        const BodyMotion& a = motions_[static_cast<std::size_t>(pair[0])];
        const BodyMotion& b = motions_[static_cast<std::size_t>(pair[1])];
        const double edge = std::min(a.edge, b.edge);
        if (!(edge > 0.0) || !a.swept.overlaps(b.swept)) continue;
        for (const auto& [mover, other] : {std::pair{pair[0], &b}, std::pair{pair[1], &a}}) {
            const double step = furthest(frame, topology_->bodies[static_cast<std::size_t>(mover)], other->mean);
            if (!(step > edge)) continue;
            is_long = true;
            if (steps_.body >= 0 && step / edge <= steps_.step / steps_.edge) continue;
            steps_.tick = frame.tick;
            // Seen from either of the two the other one moves; the one that does is named.
            const auto own_step = [&](Index body) {
                return furthest(frame, topology_->bodies[static_cast<std::size_t>(body)], Vector3::Zero());
            };
            steps_.body = own_step(pair[0]) >= own_step(pair[1]) ? pair[0] : pair[1];
            steps_.step = step;
            steps_.edge = edge;
        }
    }
    steps_.frames += is_long ? 1 : 0;
}

std::string long_step_note(const LongSteps& steps, const Topology& topology) {
    if (steps.frames == 0) return {};
    return fmt::format(
        "step longer than feature in {} frames: up to frame {} {} goes {:.3g} m, {:.3g} times the mean edge of {:.3g} "
        "m, so that contacts between frames may be in no frame (swept=on reports them)",
        steps.frames, steps.tick, topology.bodies[static_cast<std::size_t>(steps.body)].name, steps.step,
        steps.step / steps.edge, steps.edge);
}

}  // namespace trocar::app
