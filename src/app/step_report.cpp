#include "app/step_report.hpp"
#include "app/json_values.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "method/registry.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

/// "0.412 ms", or the words for a bound that there is not.
std::string shown(double seconds, const char* none) {
    return std::isfinite(seconds) ? fmt::format("{:.4g} ms", 1e3 * seconds) : std::string(none);
}

/// What is not certain in either direction is unknown.
const char* verdict_of(const Scene& scene, const StepCheck& check) {
    if (check.unstable(scene.dt)) return "unstable";
    return scene.dt / check.tissue.substeps <= check.tissue.stable_step ? "stable" : "unknown";
}

void print_json(const Scene& scene, const std::string& stepper, const StepCheck& check) {
    const StepEstimate& tissue = check.tissue;
    const bool stable = scene.dt / tissue.substeps <= tissue.stable_step;
    Json operators = Json::array();
    for (const OperatorStep& coupling : check.operators) {
        operators.push_back({{"body", scene.topology.bodies[static_cast<std::size_t>(coupling.body)].name},
                             {"stable_step", json_number(coupling.stable_step)},
                             {"most_stiffness", coupling.most_stiffness},
                             {"unstable", coupling.unstable}});
    }
    const Json document{{"scene", scene.name},
                        {"stepper", stepper},
                        {"dt", scene.dt},
                        {"verdict", verdict_of(scene, check)},
                        {"message", why_unstable(scene, check)},
                        {"tissue",
                         {{"substeps", tissue.substeps},
                          {"substeps_stable", tissue.substeps_stable},
                          {"stable_step", json_number(tissue.stable_step)},
                          {"stable_step_undamped", json_number(tissue.stable_step_undamped)},
                          {"unstable_step", json_number(tissue.unstable_step)},
                          {"damping_decides", tissue.damping_decides},
                          {"springs", tissue.springs},
                          {"spring_evaluations", tissue.spring_evaluations()},
                          {"decides", deciding_place(scene, tissue, scene.first.position)},
                          {"remedy", stable ? std::string() : step_remedy(scene, tissue)}}},
                        {"operators", operators}};
    print_json_line(document);
}

}  // namespace

void print_step(const Scene& scene, const std::string& stepper, const StepCheck& check, bool json) {
    const std::string name = stepper.empty() ? registry().default_stepper().name : stepper;
    if (json) {
        print_json(scene, name, check);
        return;
    }
    const StepEstimate& tissue = check.tissue;
    fmt::print("scene      {}: ticks of {:g} ms, stepper {}\n", scene.name, scene.dt * 1e3, name);
    fmt::print("verdict    {}\n", verdict_of(scene, check));
    if (!scene.has_tissue()) fmt::print("tissue     none\n");
    if (tissue.vertex >= 0) {
        fmt::print("sub-steps  {} of {} taken, {} are stable for certain\n", tissue.substeps,
                   shown(scene.dt / tissue.substeps, ""), tissue.substeps_stable);
        fmt::print("step       stable up to {} (without damping {}), unstable from {}; {} decides\n",
                   shown(tissue.stable_step, "any"), shown(tissue.stable_step_undamped, "any"),
                   shown(tissue.unstable_step, "nowhere known"), tissue.damping_decides ? "damping" : "stiffness");
        fmt::print("place      {}\n", deciding_place(scene, tissue, scene.first.position));
        fmt::print("cost       {} springs x {} sub-steps = {} spring evaluations a tick\n", tissue.springs,
                   tissue.substeps, tissue.spring_evaluations());
        if (scene.dt / tissue.substeps > tissue.stable_step) fmt::print("remedy     {}\n", step_remedy(scene, tissue));
    } else if (scene.has_tissue()) {
        fmt::print("step       no bound: any step is stable\n");
    }
    for (const OperatorStep& coupling : check.operators) {
        fmt::print("operator   {}: stable below {}; at {} below {:.4g} N/m{}\n",
                   scene.topology.bodies[static_cast<std::size_t>(coupling.body)].name,
                   shown(coupling.stable_step, "any step"), shown(scene.dt / check.substeps, ""),
                   coupling.most_stiffness, coupling.unstable ? ": UNSTABLE" : "");
    }
    if (const std::string why = why_unstable(scene, check); !why.empty()) fmt::print("refused    {}\n", why);
}

}  // namespace trocar::app
