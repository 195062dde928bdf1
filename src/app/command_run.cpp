// `trocar run`: one scene with one detector and one response, printed for a person or, with --json, for a machine.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "app/run_choice.hpp"
#include "app/step_report.hpp"
#include "geometry/input_error.hpp"
#include "measure/metrics.hpp"
#include "method/device.hpp"
#include "method/registry.hpp"
#include "scene/recording.hpp"
#include "scene/scene.hpp"
#include "simulate/nearest.hpp"
#include "simulate/runs.hpp"
#include "simulate/simulation.hpp"
#include "simulate/step_check.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

Json row_json(const StepRow& row) {
    Json stages = Json::object();
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        if (row.stage_ns.at(stage) >= 0) stages[stage_names.at(stage)] = row.stage_ns.at(stage);
    }
    return {{"tick", row.tick},
            {"time", json_number(row.time)},
            {"query_distance", json_number(row.query_distance)},
            {"pairs", row.pairs},
            {"proximity_false_negatives",
             row.proximity_false_negatives < 0 ? Json(nullptr) : Json(row.proximity_false_negatives)},
            {"contacts_offered", row.contacts_offered},
            {"contacts_used", row.contacts_used},
            {"residual_penetration", json_number(row.residual_penetration)},
            {"side_undecided", row.side_undecided < 0 ? Json(nullptr) : Json(row.side_undecided)},
            {"tool_force", json_vector(row.tool_force)},
            {"tool_moment", json_vector(row.tool_moment)},
            {"tip_force", json_vector(row.tip_force)},
            {"device_force", json_vector(row.device_force)},
            {"roll_torque", json_number(row.roll_torque)},
            {"saturated", row.saturated},
            {"grasped", row.grasped},
            {"detached", row.detached},
            {"passed_through", row.passed_through < 0 ? Json(nullptr) : Json(row.passed_through)},
            {"truncated", row.truncated},
            {"stage_ns", stages}};
}

/// Whether surfaces met or pushed each other. Contacts alone prove nothing: some generators make them at a distance.
bool met(const StepRow& row) {
    return row.true_pairs > 0 || (row.query_distance == 0.0 && row.pairs > 0) || !row.tool_force.isZero(0.0);
}
bool pushes(const Simulation& simulation) {
    const std::vector<Wrench>& loads = simulation.body_loads();
    return std::any_of(loads.begin(), loads.end(), [](const Wrench& load) { return !load.force.isZero(0.0); });
}

/// Nearest approach of a run in which nothing met, from a second run with the same bits. A paced run is repeated
/// without a clock.
std::optional<NearestApproach> nearest_of(const Scene& scene, RunSpec spec, const Record& record) {
    if (!record.outcome.ok() || std::any_of(record.rows.begin(), record.rows.end(), met)) return std::nullopt;
    spec.mode = "closed_loop";
    spec.truth_stride = 0;
    NearestApproach nearest;
    bool pushed = false;
    RunLimits limits;
    limits.allow_unstable_step = true;
    limits.watched = false;
    limits.observe = [&](const Simulation& simulation, const StepRow&) {
        pushed = pushed || pushes(simulation);
        if (!pushed) nearest.observe(scene.topology, simulation.seen());
    };
    limits.progress = [&](std::int64_t) { return !pushed; };
    run_closed_loop(scene, spec, limits);
    if (pushed || nearest.tick < 0) return std::nullopt;
    return nearest;
}

const std::string& name_of_body(const Scene& scene, Index body) {
    return scene.topology.bodies[static_cast<std::size_t>(body)].name;
}

Json nearest_json(const Scene& scene, const std::optional<NearestApproach>& nearest) {
    if (!nearest) return nullptr;
    const auto box = [](const Box& one) { return Json::array({json_vector(one.min), json_vector(one.max)}); };
    return {{"tick", nearest->tick},
            {"distance_m", json_number(nearest->distance)},
            {"bodies", Json::array({name_of_body(scene, nearest->body_a), name_of_body(scene, nearest->body_b)})},
            {"boxes_m", Json::array({box(nearest->box_a), box(nearest->box_b)})}};
}

std::string nearest_text(const Scene& scene, const NearestApproach& nearest) {
    const auto box = [&](Index body, const Box& one) {
        const Vector3 from = one.min * 1e3;
        const Vector3 to = one.max * 1e3;
        return fmt::format("{} within x {:.4g} to {:.4g}, y {:.4g} to {:.4g}, z {:.4g} to {:.4g} mm",
                           name_of_body(scene, body), from.x(), to.x(), from.y(), to.y(), from.z(), to.z());
    };
    return fmt::format("no contact {} and {} came nearest in tick {}: {:.4g} mm apart\n           {}\n           {}\n",
                       name_of_body(scene, nearest.body_a), name_of_body(scene, nearest.body_b), nearest.tick,
                       nearest.distance * 1e3, box(nearest.body_a, nearest.box_a), box(nearest.body_b, nearest.box_b));
}

void print_json(const Scene& scene, const Record& record, const std::optional<NearestApproach>& nearest) {
    Json rows = Json::array();
    for (const StepRow& row : record.rows) rows.push_back(row_json(row));
    Json summary = Json::object();
    for (const auto& [metric, value] : record.summary) summary[std::string(info_of(metric).name)] = json_number(value);
    summary["state_hash"] = record.state_hash;
    Json document{{"scene", record.spec.scene},
                  {"detector", record.spec.detector},
                  {"response", record.spec.response},
                  {"contacts", record.spec.contacts},
                  {"outcome", name_of(record.outcome.kind)},
                  {"message", record.outcome.message},
                  {"rows", rows},
                  {"summary", summary}};
    const TipSettings device = read_device(record.spec.device);
    document["device"] = {{"tip", device.fulcrum ? "fulcrum" : "sum"},
                          {"saturation", device.saturation},
                          {"rate", device.rate_limit},
                          {"filter", device.filter},
                          {"ramp", device.ramp}};
    if (!record.spec.stepper.empty()) document["stepper"] = record.spec.stepper;
    const auto unstable_step = record.environment.find("run.unstable_step");
    if (unstable_step != record.environment.end()) document["unstable_step"] = unstable_step->second;
    document["nearest"] = nearest_json(scene, nearest);
    print_json_line(document);
}

/// A figure in the unit a person reads: µs, mm; "n/a" where it does not apply.
std::string shown(const Record& record, Metric metric, double scale, const char* unit, const char* missing = "n/a") {
    const double value = value_of(record.summary, metric);
    return std::isnan(value) ? missing : fmt::format("{:.4g}{}", value * scale, unit);
}

void print_text(const Scene& scene, const Record& record) {
    const auto us = [&](Metric metric) { return shown(record, metric, 1e-3, " µs"); };
    const auto tail = [&](Metric metric) { return shown(record, metric, 1e-3, " µs", "n too small"); };
    const auto mm = [&](Metric metric) { return shown(record, metric, 1e3, " mm"); };
    const auto newton = [&](Metric metric) { return shown(record, metric, 1.0, " N"); };
    const auto plain = [&](Metric metric) { return shown(record, metric, 1.0, ""); };
    const std::string at_end =
        record.outcome.message.empty() ? std::string() : fmt::format(" ({})", record.outcome.message);
    fmt::print("scene      {}: {} bodies, {} triangles, {} of {} ticks of {:g} ms\n", scene.name,
               scene.topology.body_count(), scene.topology.triangle_count(), record.rows.size(), record.spec.ticks,
               scene.dt * 1e3);
    fmt::print("methods    {} + {}, {} contacts\n", record.spec.detector, record.spec.response, record.spec.contacts);
    fmt::print("outcome    {}{}\n", name_of(record.outcome.kind), at_end);
    fmt::print("pairs      at most {} in a tick; of {} true ones {} false negatives; {} false positives\n",
               plain(Metric::pairs_max), plain(Metric::true_pairs), plain(Metric::false_negatives),
               plain(Metric::false_positives));
    fmt::print("depth      error of contacts: median {}, worst {}\n", mm(Metric::depth_error_median_m),
               mm(Metric::depth_error_max_m));
    fmt::print("residual   penetration after a tick: median {}, largest {}; at the end {}\n",
               mm(Metric::residual_penetration_median_m), mm(Metric::residual_penetration_max_m),
               mm(Metric::residual_penetration_final_m));
    if (record.summary.at(Metric::passed_through) >= 0.0) {
        fmt::print("passed     a body was driven through another {} times\n", plain(Metric::passed_through));
    }
    fmt::print("tool force largest {}, root mean square {}, largest jump {}; without touch up to {}\n",
               newton(Metric::force_max_n), newton(Metric::force_rms_n), newton(Metric::force_jump_max_n),
               mm(Metric::force_without_touch_m));
    fmt::print(
        "tip        force largest {}, largest jump {}; moment on the tool largest {}; device saturated in {} ticks\n",
        newton(Metric::tip_force_max_n), newton(Metric::tip_force_jump_max_n),
        shown(record, Metric::tool_moment_max_nm, 1.0, " N m"), plain(Metric::saturated_ticks));
    if (record.summary.at(Metric::grasped_max) > 0.0) {
        fmt::print("grasp      at most {} vertices held, {} slipped\n", plain(Metric::grasped_max),
                   plain(Metric::detached));
    }
    fmt::print("time       tick of {} sub-steps: median {}, p99 {}, longest {}\n", plain(Metric::substeps),
               us(Metric::total_median_ns), tail(Metric::total_p99_ns), us(Metric::total_max_ns));
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        if (us(stage_median(stage)) == "n/a") continue;
        fmt::print("           {:<8} median {}, p99 {}\n", stage_names.at(stage), us(stage_median(stage)),
                   tail(stage_p99(stage)));
    }
    if (record.spec.mode == "paced") {
        fmt::print(
            "paced      from release to end: median {}, p99 {}, longest {}; {} overruns in {} ticks, {} skipped\n",
            us(Metric::paced_latency_median_ns), tail(Metric::paced_latency_p99_ns), us(Metric::paced_latency_max_ns),
            plain(Metric::paced_overruns), plain(Metric::paced_ticks), plain(Metric::paced_skipped));
        fmt::print(
            "           empty loop:          median {}, p99 {}, longest {}; {} overruns in {} ticks, {} skipped\n",
            us(Metric::empty_latency_median_ns), tail(Metric::empty_latency_p99_ns), us(Metric::empty_latency_max_ns),
            plain(Metric::empty_overruns), plain(Metric::empty_ticks), plain(Metric::empty_skipped));
    }
    fmt::print("memory     allocations in a tick: median {}, most {}\n", plain(Metric::allocations_median),
               plain(Metric::allocations_max));
    fmt::print("state      {} (hash of the last frame)\n", record.state_hash);
}

}  // namespace

int run(const CommonOptions& common, const RunOptions& options) {
    check_ticks(options.ticks);
    if (options.paced && options.record) {
        throw InputError("command line", "--record", "no recording in a paced run (writing takes its time)", "both");
    }
    RunSpec spec = spec_of(options.methods);
    if (options.paced) spec.mode = "paced";
    const ResponseEntry& response = registry().response(parse_method(spec.response).name);
    Scene scene = read_scene(options.scene, common.data);
    for (const std::string& note : scene.notes) {
        fmt::print(stderr, "trocar: {}: {}\n", options.scene.string(), note);
    }
    StepCheck step = check_step(scene, spec.stepper, options.explain_step);
    if (options.explain_step) {
        print_step(scene, spec.stepper, step, common.json);
        return done;
    }
    std::string more_substeps;
    if (const std::string why = why_unstable(scene, step); !why.empty() && options.unstable_step != "allow") {
        const int needed = options.unstable_step == "substep" ? stable_substeps(scene, step) : 0;
        if (needed == 0) {
            throw InputError(
                fmt::format("{}: {} (--unstable-step {}allow takes it all the same)", options.scene.string(), why,
                            stable_substeps(scene, step) > 0 ? "substep takes as many as are stable, " : ""));
        }
        more_substeps = fmt::format("{} sub-steps a tick instead of {}: {}", needed, step.substeps, why);
        fmt::print(stderr, "trocar: {}: {}\n", options.scene.string(), more_substeps);
        scene.materials.substeps = needed;
        step = check_step(scene, spec.stepper, false);
    }
    if (const std::string note = cost_note(scene, step); !note.empty()) {
        fmt::print(stderr, "trocar: {}: {}\n", options.scene.string(), note);
    }
    set_scene(scene, options.ticks, spec);
    // Of a run that fails, its outcome is the one line; this belongs to it then.
    const std::string acts_as =
        scene.has_tissue() || response.without_tissue.empty()
            ? std::string()
            : fmt::format("{} {}, and {} has none", response.name, response.without_tissue, scene.name);

    std::optional<RecordingWriter> recording;
    if (options.record) recording.emplace(*options.record, scene.topology, scene.dt);
    Record record;
    bool stopped = false;
    {
        SignalsHeld signals;
        Progress progress("tick", spec.ticks);
        RunLimits limits;
        limits.allow_unstable_step = options.unstable_step == "allow";
        limits.progress = until_interrupted(progress, signals, stopped);
        limits.observe = [&](const Simulation& simulation, const StepRow&) {
            if (recording && simulation.outcome().ok()) recording->write(simulation.seen());
        };
        record = run_closed_loop(scene, spec, limits);
    }
    if (stopped) {
        const std::string reported = fmt::format("interrupted after {} of {} ticks", record.rows.size(), spec.ticks);
        fmt::print(stderr, "trocar: {}\n", reported);
        if (common.json) {
            record.outcome.message = reported;
            print_json(scene, record, std::nullopt);
        }
        return interrupted;
    }
    if (recording) recording->finish();
    if (!more_substeps.empty()) record.environment["run.unstable_step"] = more_substeps;
    const std::optional<NearestApproach> nearest = nearest_of(scene, spec, record);
    if (common.json) {
        print_json(scene, record, nearest);
    } else {
        print_text(scene, record);
        if (nearest) fmt::print("{}", nearest_text(scene, *nearest));
    }
    if (record.outcome.ok()) {
        if (!acts_as.empty()) fmt::print(stderr, "trocar: {}\n", acts_as);
        return done;
    }
    fmt::print(stderr, "trocar: {} + {} ended as {}: {}{}\n", spec.detector, spec.response,
               name_of(record.outcome.kind), record.outcome.message,
               acts_as.empty() ? acts_as : fmt::format(" ({})", acts_as));
    return method_failed;
}

}  // namespace trocar::app
