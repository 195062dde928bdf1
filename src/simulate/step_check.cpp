#include "simulate/step_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "method/registry.hpp"
#include "scene/scene_settings.hpp"
#include "tissue/stability.hpp"

namespace trocar {
namespace {

constexpr int usual_substeps = 4;

/// Number of a vertex in the files of its body.
Index file_number(const Scene& scene, Index vertex) {
    const Index body = scene.topology.body_of_vertex(vertex);
    const Index own = vertex - scene.topology.bodies[at(body)].vertices.first;
    if (at(body) >= scene.bodies.size() || scene.bodies[at(body)].file_vertex.size() <= at(own)) return own;
    return scene.bodies[at(body)].file_vertex[at(own)];
}

std::string milliseconds(double seconds) {
    return std::isfinite(seconds) ? fmt::format("{:.3g} ms", 1e3 * seconds) : std::string("any length");
}

/// Stable where h² k/m + 2 h c/m < 4, with coupling stiffness k and total damping c of the operator.
OperatorStep operator_step(const OperatorModel& coupling, Index body, double h) {
    OperatorStep step{.body = body};
    const double damping = coupling.damping + coupling.coupling_damping;
    step.stable_step =
        critical_time_step(std::sqrt(coupling.coupling_stiffness / coupling.mass), damping / coupling.mass);
    step.most_stiffness = std::max(0.0, (4.0 * coupling.mass - 2.0 * h * damping) / (h * h));
    step.unstable = h >= step.stable_step;
    return step;
}

/// Sub-steps that keep the step 5 % below the limit.
double substeps_of(const Scene& scene, const OperatorStep& coupling) {
    return std::ceil(1.05 * scene.dt / coupling.stable_step);
}

std::string why_operator_unstable(const Scene& scene, const StepCheck& check, const OperatorStep& coupling) {
    const OperatorModel& model = scene.bodies[at(coupling.body)].motion->coupling;
    const double needed = substeps_of(scene, coupling);
    std::string remedy = coupling.most_stiffness > 0.0
                             ? fmt::format("coupling_stiffness below {:.3g} N/m", coupling.most_stiffness)
                             : fmt::format("less damping");
    if (scene.has_tissue() && needed <= most_substeps) remedy += fmt::format(", {:.0f} sub-steps", needed);
    return fmt::format(
        "the operator on {} ({:g} kg, {:g} N/m, {:g} N s/m) is unstable at steps of {}, its limit is {}: {} or a "
        "shorter dt would do",
        scene.topology.bodies[at(coupling.body)].name, model.mass, model.coupling_stiffness,
        model.damping + model.coupling_damping, milliseconds(scene.dt / check.substeps),
        milliseconds(coupling.stable_step), remedy);
}

}  // namespace

bool StepCheck::unstable(double dt) const {
    return tissue.surely_unstable(dt) || std::any_of(operators.begin(), operators.end(),
                                                     [](const OperatorStep& coupling) { return coupling.unstable; });
}

StepCheck check_step(const Scene& scene, const std::string& stepper, bool closely) {
    StepCheck check;
    check.substeps = std::max(1, scene.materials.substeps);
    if (scene.has_tissue()) {
        const MethodSpec spec = parse_method(stepper.empty() ? registry().default_stepper().name : stepper);
        check.tissue = make_stepper(spec.name, spec.parameters)
                           ->estimate(scene.topology, scene.materials, scene.first.position, scene.dt, closely);
    }
    const std::vector<Index> operators = operators_of_bodies(scene);
    for (Index body = 0; body < scene.topology.body_count(); ++body) {
        const bool is_first = operators[at(body)] == static_cast<Index>(check.operators.size());
        if (!is_first) continue;
        const OperatorModel& coupling = scene.bodies[at(body)].motion->coupling;
        check.operators.push_back(operator_step(coupling, body, scene.dt / check.substeps));
    }
    return check;
}

std::string vertex_name(const Scene& scene, Index vertex) {
    return fmt::format("vertex {} of {}", file_number(scene, vertex),
                       scene.topology.bodies[at(scene.topology.body_of_vertex(vertex))].name);
}

std::string deciding_place(const Scene& scene, const StepEstimate& estimate, const Matrix3X& position) {
    if (estimate.vertex < 0) return {};
    const Vector3 p = 1e3 * position.col(estimate.vertex);
    std::string text = fmt::format("{} ({:.4g} {:.4g} {:.4g} mm, {:.3g} mg)", vertex_name(scene, estimate.vertex),
                                   p.x(), p.y(), p.z(), 1e6 * estimate.vertex_mass);
    if (estimate.edge[0] < 0) return text;
    const double length = (position.col(estimate.edge[0]) - position.col(estimate.edge[1])).norm();
    return text + fmt::format(", edge {}-{} of {:.3g} mm ({:.3g} N/m, {:.3g} N s/m)",
                              file_number(scene, estimate.edge[0]), file_number(scene, estimate.edge[1]), 1e3 * length,
                              estimate.edge_stiffness, estimate.edge_damping);
}

std::string step_remedy(const Scene& scene, const StepEstimate& estimate) {
    const std::string other = estimate.damping_decides ? "less damping" : "longer edges there or a softer tissue";
    if (estimate.substeps_stable <= most_substeps) {
        return fmt::format("substeps {} or more, {}, or a dt of {} would do", estimate.substeps_stable, other,
                           milliseconds(estimate.stable_step * estimate.substeps));
    }
    return fmt::format("no number of sub-steps up to {} would do for dt {}: {}", most_substeps, milliseconds(scene.dt),
                       other);
}

std::string why_unstable(const Scene& scene, const StepCheck& check) {
    for (const OperatorStep& coupling : check.operators) {
        if (coupling.unstable) return why_operator_unstable(scene, check, coupling);
    }
    const StepEstimate& tissue = check.tissue;
    if (!tissue.surely_unstable(scene.dt)) return {};
    return fmt::format(
        "sub-steps of {} are unstable for certain (from {} on; stable up to {}, without damping {}): {}; {}",
        milliseconds(scene.dt / tissue.substeps), milliseconds(tissue.unstable_step), milliseconds(tissue.stable_step),
        milliseconds(tissue.stable_step_undamped), deciding_place(scene, tissue, scene.first.position),
        step_remedy(scene, tissue));
}

int stable_substeps(const Scene& scene, const StepCheck& check) {
    double needed = check.substeps;
    if (check.tissue.surely_unstable(scene.dt)) {
        needed = std::max(needed, static_cast<double>(check.tissue.substeps_stable));
    }
    for (const OperatorStep& coupling : check.operators) {
        if (coupling.unstable) needed = std::max(needed, substeps_of(scene, coupling));
    }
    return needed <= most_substeps && scene.has_tissue() ? static_cast<int>(needed) : 0;
}

std::string cost_note(const Scene& scene, const StepCheck& check) {
    const StepEstimate& tissue = check.tissue;
    if (tissue.vertex < 0) return {};
    if (tissue.surely_unstable(scene.dt)) return why_unstable(scene, check);
    const std::string cost = fmt::format("{} sub-steps a tick, {} springs each ({} spring evaluations)",
                                         tissue.substeps, tissue.springs, tissue.spring_evaluations());
    const std::string place = deciding_place(scene, tissue, scene.first.position);
    if (scene.dt / tissue.substeps > tissue.stable_step) {
        return fmt::format("{}: neither proven stable ({} are) nor unstable (from {} on); {} decides", cost,
                           tissue.substeps_stable, milliseconds(tissue.unstable_step), place);
    }
    if (tissue.substeps <= usual_substeps) return {};
    return fmt::format("{}: {} would do; {} decides", cost, tissue.substeps_stable, place);
}

}  // namespace trocar
