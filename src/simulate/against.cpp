#include "simulate/against.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "measure/statistics.hpp"

namespace trocar {

Against::Against(const Scene& scene, std::unique_ptr<Simulation> other)
    : scene_(&scene),
      other_(std::move(other)),
      difference_(static_cast<std::size_t>(scene.topology.vertex_count), 0.0),
      path_(difference_) {}

void Against::find_contact(const ContactSet& contacts) {
    if (contact_ || contacts.pairs.empty()) return;
    Vector3 sum = Vector3::Zero();
    double count = 0.0;
    for (const TrianglePair& pair : contacts.pairs) {
        for (const Index triangle : {pair.a, pair.b}) {
            const Index body = scene_->topology.body_of_triangle[static_cast<std::size_t>(triangle)];
            if (scene_->topology.bodies[static_cast<std::size_t>(body)].kind != BodyKind::tissue) continue;
            for (int k = 0; k < 3; ++k) {
                sum += scene_->first.position.col(scene_->topology.triangles(k, triangle));
                count += 1.0;
            }
        }
    }
    if (count > 0.0) contact_ = sum / count;
}

void Against::follow(const Simulation& tested, const StepRow& row) {
    const StepRow other = other_->step();
    if (!other_->outcome().ok()) return;
    find_contact(other_->contacts());
    ++ticks_;
    const double force = (row.tool_force - other.tool_force).norm();
    force_square_sum_ += force * force;
    force_max_ = std::fmax(force_max_, force);
    advance_ns_.push_back(static_cast<double>(other.stage_ns.at(static_cast<std::size_t>(Stage::advance))));
    for (const BodyRange& body : scene_->topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            const auto place = static_cast<std::size_t>(v);
            const auto at = other_->frame().position.col(v);
            difference_[place] = std::max(difference_[place], (at - tested.frame().position.col(v)).norm());
            path_[place] = std::max(path_[place], (at - scene_->first.position.col(v)).norm());
        }
    }
}

Summary Against::figures() const {
    Summary figures;
    if (ticks_ == 0) return figures;
    figures[Metric::against_force_rms_n] = std::sqrt(force_square_sum_ / static_cast<double>(ticks_));
    figures[Metric::against_force_max_n] = force_max_;
    figures[Metric::against_advance_median_ns] = median(advance_ns_);
    if (!contact_) return figures;
    double near = std::numeric_limits<double>::quiet_NaN();
    double far = near;
    double far_path = near;
    for (const BodyRange& body : scene_->topology.bodies) {
        if (body.kind != BodyKind::tissue) continue;
        for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
            const auto place = static_cast<std::size_t>(v);
            const double distance = (scene_->first.position.col(v) - *contact_).norm();
            if (distance < near_limit) near = std::fmax(near, difference_[place]);
            if (distance < far_limit) continue;
            far = std::fmax(far, difference_[place]);
            far_path = std::fmax(far_path, path_[place]);
        }
    }
    figures[Metric::against_near_max_m] = near;
    figures[Metric::against_far_max_m] = far;
    figures[Metric::against_far_path_m] = far_path;
    return figures;
}

}  // namespace trocar
