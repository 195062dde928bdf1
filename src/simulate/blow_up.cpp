#include "simulate/blow_up.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/vertex_springs.hpp"
#include "simulate/query_distance.hpp"
#include "simulate/step_check.hpp"

namespace trocar {
namespace {

/// N, static force that a tissue body can carry: (c) of BlowUp.
double carried_by(const Scene& scene, const BodyRange& body) {
    const Materials& materials = scene.materials;
    const double strain = std::clamp(materials.strain_limit, 1.0, BlowUp::most_strain);
    double tension = 0.0;  // N m, Σ T L
    for (const Spring& spring : materials.springs) {
        if (body.vertices.contains(spring.i)) {
            tension += (spring.k * strain * spring.rest + spring.preload) * spring.rest;
        }
    }
    double area = 0.0;
    for (Index v = body.vertices.first; v < body.vertices.end(); ++v) area += materials.area[at(v)];
    return area > 0.0 ? 2.0 * tension / std::sqrt(area) : 0.0;
}

/// m, depth of the deepest contact; 0 without a depth.
double deepest_of(const ContactSet& contacts) {
    double deepest = 0.0;
    for (const Contact& contact : contacts.contacts)
        deepest = std::fmax(deepest, std::fmax(contact.depth, -contact.gap));
    return deepest;
}

}  // namespace

BlowUp::BlowUp(const Scene& scene) : scene_(&scene) {
    for (Index body = 0; body < scene.topology.body_count() && at(body) < scene.bodies.size(); ++body) {
        if (scene.bodies[at(body)].motion) driven_.push_back(scene.topology.bodies[at(body)].vertices);
    }
    if (!scene.has_tissue()) return;
    for (const BodyRange& body : scene.topology.bodies) {
        if (body.kind == BodyKind::tissue) most_force_ += carried_by(scene, body);
    }
    for (const double mass : scene.materials.mass) mass_ += mass;
    mean_rest_ = mean_spring_length(scene.materials);
}

Outcome BlowUp::judge(const Frame& seen, const Frame& after, const ContactSet& contacts, const ResponseOutput& output,
                      std::span<const ContactForce> contact_forces, std::span<const Wrench> reaction,
                      const EnergyMomentumAudit& audit) {
    if (!scene_->has_tissue()) return {};
    follow(seen, contacts, output, contact_forces);
    Outcome outcome = judge_force(output, reaction);
    if (outcome.ok()) outcome = judge_strain(after);
    if (outcome.ok()) outcome = judge_energy(audit);
    return outcome;
}

void BlowUp::follow(const Frame& seen, const ContactSet& contacts, const ResponseOutput& output,
                    std::span<const ContactForce> contact_forces) {
    if (!had_contact_) first_depth_ = std::max(first_depth_, deepest_of(contacts));
    had_contact_ = scene_->has_contact_at(seen.tick);
    touched_ = touched_ || !output.position_corrections.empty() ||
               std::any_of(contact_forces.begin(), contact_forces.end(),
                           [](const ContactForce& load) { return !load.force.isZero(0.0); });
    move_ = furthest_move(seen, driven_);
    if (touched_) path_ += move_;
}

Outcome BlowUp::judge_energy(const EnergyMomentumAudit& audit) {
    const double work = audit.absolute_work();
    const double gain = audit.tissue_gain();
    const double start = most_force_ * first_depth_;
    rich_ticks_ = gain > (1.0 + work_factor) * work + spare_energy + start ? rich_ticks_ + 1 : 0;
    if (rich_ticks_ < energy_ticks) return {};
    return {
        OutcomeKind::unstable,
        fmt::format(
            "energy from nothing: the tissue has gained {:.3g} J, scripts and operators did {:.3g} J of work (for {} "
            "ticks beyond {:g} times that)",
            gain, work, rich_ticks_, work_factor)};
}

Outcome BlowUp::judge_strain(const Frame& after) const {
    const Materials& materials = scene_->materials;
    const double limit = std::max(most_strain, std::isfinite(materials.strain_limit) ? materials.strain_limit : 0.0);
    const double path = path_ + first_depth_;
    double most_over = 0.0;
    const Spring* worst = nullptr;
    for (const Spring& spring : materials.springs) {
        if (!(spring.rest > 0.0)) continue;
        const double length = (after.position.col(spring.j) - after.position.col(spring.i)).norm();
        const double over = length / spring.rest - 1.0 - limit - path / std::max(spring.rest, mean_rest_);
        if (over <= most_over) continue;
        most_over = over;
        worst = &spring;
    }
    if (worst == nullptr) return {};
    const double length = (after.position.col(worst->j) - after.position.col(worst->i)).norm();
    return {
        OutcomeKind::unstable,
        fmt::format("edge {} to {} has a strain of {:.3g}, where the path of driven bodies ({:.3g} mm) asks for {:.3g} "
                    "at most",
                    vertex_name(*scene_, worst->i), vertex_name(*scene_, worst->j), length / worst->rest - 1.0,
                    1e3 * path, path / std::max(worst->rest, mean_rest_) + limit)};
}

Outcome BlowUp::judge_force(const ResponseOutput& output, std::span<const Wrench> reaction) const {
    const double dt = scene_->dt;
    const double most = most_force_ + mass_ * move_ / (dt * dt);
    for (std::size_t body = 0; body < reaction.size(); ++body) {
        if (scene_->topology.bodies[body].kind != BodyKind::instrument) continue;
        Vector3 force = reaction[body].force;
        if (body < output.wrench.size()) force += output.wrench[body].force;
        if (!(force.norm() > most)) continue;
        return {OutcomeKind::unstable, fmt::format("{:.4g} N from tissue on {}, which can carry {:.3g} N at most",
                                                   force.norm(), scene_->topology.bodies[body].name, most)};
    }
    return {};
}

}  // namespace trocar
