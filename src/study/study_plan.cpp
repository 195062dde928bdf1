// From a study to its shuffled list of runs: which combinations are made, and which are settled without being made.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/random.hpp"
#include "geometry/size_limits.hpp"
#include "method/registry.hpp"
#include "simulate/interleaved.hpp"
#include "simulate/overrides.hpp"
#include "simulate/resolution.hpp"
#include "study/runner.hpp"
#include "study/study.hpp"

namespace trocar {
namespace {

void add_run(PlannedRun run, std::vector<PlannedRun>& runs) {
    if (are_sizes_limited() && runs.size() >= static_cast<std::size_t>(most_runs)) {
        throw InputError("study", "", limit_text(most_runs, "runs"), "more");
    }
    runs.push_back(std::move(run));
}

void settle_absent(PlannedRun& run) {
    for (const Level* method : {&run.detector, &run.response}) {
        if (!method->absent_reason || run.settled) continue;
        run.settled = Outcome{OutcomeKind::absent,
                              fmt::format("{}: {}", parse_method(method->text).name, *method->absent_reason)};
    }
}

/// Why a detector has nothing to give for contacts of this generator; empty when it has.
std::string unreported(const Level& detector, const std::string& contacts) {
    if (detector.absent_reason) return {};
    return why_unreported(registry().detector(parse_method(detector.text).name),
                          registry().contact_generator(contacts));
}

/// Why a response can do nothing with contacts of this generator; empty when it can.
std::string unreadable(const Level& response, const std::string& contacts) {
    if (response.absent_reason) return {};
    return why_unreadable(registry().contact_generator(contacts), parse_method(response.text));
}

/// The contact generator that a response works from where none is named.
std::string own_contact_generator(const Level& response) {
    if (response.absent_reason) return "intersection";
    return default_contact_generator(parse_method(response.text));
}

/// The list of a factor that a level runs with: its own, else the experiment's.
const std::vector<std::string>& levels_of(const Level& level, const std::string& factor,
                                          const std::vector<std::string>& all) {
    const auto own = level.only.find(factor);
    return own == level.only.end() ? all : own->second;
}

bool runs_with(const Level& level, const std::string& factor, const std::string& one) {
    const auto own = level.only.find(factor);
    return own == level.only.end() || std::find(own->second.begin(), own->second.end(), one) != own->second.end();
}

/// Contact generators of a response; of a detector alone, those whose query distance it is asked for, or the empty one.
std::vector<std::string> generators_of(const Experiment& experiment, const Level& response) {
    if (response.text.empty()) return experiment.contacts.empty() ? std::vector<std::string>{""} : experiment.contacts;
    const std::vector<std::string>& chosen = levels_of(response, "contacts", experiment.contacts);
    return chosen.empty() ? std::vector<std::string>{own_contact_generator(response)} : chosen;
}

/// What a run is to the report. Sections select runs by it.
std::string mode_of(const Experiment& experiment, Input::Kind input) {
    if (experiment.perturbed) return "metamorphic";
    if (input == Input::Kind::external) return "external";
    if (input != Input::Kind::scene && input != Input::Kind::generated) return "hard_case";
    if (experiment.clock == Experiment::Clock::paced) return "paced";
    if (experiment.sweep) return "work_precision";
    if (!experiment.against.empty()) return experiment.against == twin ? "resolution" : "against";
    if (experiment.cycles > 0) return "repeated_motion";
    if (experiment.frames == Experiment::Frames::replay) return "replay";
    return experiment.truth_stride == 0 ? "cost_by_size" : "closed_loop";
}

PlannedRun planned(const Study& study, const Experiment& experiment, std::int64_t repetition, const Level& detector,
                   const Level& response, const std::string& contacts) {
    PlannedRun run;
    run.spec.study = study.name;
    run.spec.mode = mode_of(experiment, Input::Kind::scene);
    run.spec.detector = detector.text;
    run.spec.response = response.text;
    run.spec.contacts = contacts;
    if (!response.text.empty()) run.spec.device = study.device;
    run.spec.setting = response.text.empty() || response.setting == "default" ? detector.setting : response.setting;
    run.spec.repetition = repetition;
    run.spec.seed = study.seed;
    run.spec.ticks = experiment.ticks;
    run.spec.truth_stride = experiment.truth_stride;
    run.spec.against = experiment.against;
    run.detector = detector;
    run.response = response;
    settle_absent(run);
    return run;
}

void set_input(const Experiment& experiment, const Input& input, PlannedRun& run) {
    run.spec.mode = mode_of(experiment, input.kind);
    run.spec.scene_file = input.file;
    run.spec.scene = input.name.empty() ? std::filesystem::path(input.file).stem().string() : input.name;
    if (input.ticks > 0) run.spec.ticks = input.ticks;
    run.facts = input.facts;
    if (experiment.dither > 0.0) run.spec.overrides = fmt::format("dither={}", experiment.dither);
    if (experiment.cycles > 0) run.spec.overrides = fmt::format("cycles={}", experiment.cycles);
    if (run.spec.mode == "replay") run.spec.between_ticks = experiment.between_ticks;
    if (run.spec.mode == "closed_loop") {
        run.spec.detail_stride = experiment.detail_stride;
        if (!run.detector.judged) run.spec.truth_stride = 0;
    }
    if (run.spec.mode == "metamorphic" || run.spec.mode == "paced") run.spec.truth_stride = 0;
}

void set_stepper(const std::string& stepper, PlannedRun& run) {
    run.spec.stepper = stepper;
    if (run.spec.mode != "cost_by_size" && run.spec.mode != "paced") return;
    run.facts["run.stepper"] = stepper.empty() ? registry().default_stepper().name : stepper;
}

/// The run with one value of the sweep.
PlannedRun with_value(PlannedRun run, const std::string& knob, const std::string& value) {
    const std::string owner = knob.substr(0, knob.find('.'));
    const std::string key = knob.substr(std::min(knob.find('.') + 1, knob.size()));
    if (owner == "detector") run.detector = with_parameter(run.detector, key, value);
    if (owner == "response") run.response = with_parameter(run.response, key, value);
    if (owner == knob) run.spec.overrides += (run.spec.overrides.empty() ? "" : ",") + knob + "=" + value;
    run.spec.detector = run.detector.text;
    run.spec.response = run.response.text;
    run.spec.knob = knob;
    run.spec.point = value;
    return run;
}

/// Adds the row of a combination that is settled on every input. The first repetition reports it, once.
void add_unsupported(PlannedRun run, const std::string& reason, std::vector<PlannedRun>& runs) {
    run.settled = Outcome{OutcomeKind::unsupported, reason};
    add_run(std::move(run), runs);
}

/// Combinations of contact generators with responses that cannot read them, and with detectors that lack them.
void add_without_contacts(const Study& study, const Experiment& experiment, std::vector<PlannedRun>& runs) {
    std::vector<std::string> generators;
    if (experiment.responses.empty()) generators = experiment.contacts;
    for (const Level& response : experiment.responses) {
        for (const std::string& contacts : generators_of(experiment, response)) {
            if (const std::string reason = unreadable(response, contacts); !reason.empty()) {
                add_unsupported(planned(study, experiment, 0, {}, response, contacts), reason, runs);
            }
            if (std::find(generators.begin(), generators.end(), contacts) == generators.end()) {
                generators.push_back(contacts);
            }
        }
    }
    for (const std::string& contacts : generators) {
        for (const Level& detector : experiment.detectors) {
            const std::string reason = unreported(detector, contacts);
            if (reason.empty()) continue;
            add_unsupported(planned(study, experiment, 0, detector, {}, contacts), reason, runs);
        }
    }
}

/// The runs of one combination of input, detector, response and contact generator.
void add_combination(const Experiment& experiment, const PlannedRun& combination, std::vector<PlannedRun>& runs) {
    std::vector<std::string> steppers = levels_of(combination.response, "steppers", experiment.steppers);
    if (steppers.empty()) steppers = {""};
    for (const std::string& stepper : steppers) {
        PlannedRun run = combination;
        set_stepper(stepper, run);
        if (!experiment.sweep) {
            add_run(std::move(run), runs);
            continue;
        }
        for (const std::string& value : experiment.sweep->values) {
            add_run(with_value(run, experiment.sweep->knob, value), runs);
        }
    }
}

/// Keeps the first of equal runs, with the basis of any: a search that finds nothing better than a method as it comes
/// names that one, which the list may have already. Every run of a study makes the plan again, and keys of all runs
/// cost more than the rest of it.
void keep_equal_runs_once(const Experiment& experiment, std::size_t start, std::vector<PlannedRun>& runs) {
    std::map<std::string, int> levels;
    for (const Level& response : experiment.responses) ++levels[response.text];
    if (levels.size() == experiment.responses.size()) return;
    std::map<std::string, std::size_t> seen;
    std::size_t kept = start;
    for (std::size_t i = start; i < runs.size(); ++i) {
        const auto named = levels.find(runs[i].spec.response);
        const bool stands_alone = named != levels.end() && named->second == 1;
        const auto [first, is_new] =
            stands_alone ? std::pair(seen.end(), true) : seen.emplace(run_key(runs[i].spec, runs[i].facts, 0.0), kept);
        if (is_new) {
            if (kept != i) runs[kept] = std::move(runs[i]);
            ++kept;
            continue;
        }
        std::string& basis = runs[first->second].response.basis;
        if (basis.empty()) basis = runs[i].response.basis;
    }
    runs.resize(kept);
}

/// The runs of one repetition. A combination that is settled without running is reported in the first one only.
void add_experiment(const Study& study, const Experiment& experiment, std::int64_t repetition,
                    std::vector<PlannedRun>& runs) {
    const std::vector<Level> none(1);
    const bool alone = experiment.responses.empty();
    const std::size_t start = runs.size();
    if (repetition == 0) add_without_contacts(study, experiment, runs);
    for (const Input& input : experiment.inputs) {
        // Cases: the clock is no part of the answer. Generated scenes: the reference alone takes part twice.
        if (repetition > 0 && input.kind != Input::Kind::scene) continue;
        for (const Level& detector : experiment.detectors) {
            if (!runs_with(detector, "inputs", input.file)) continue;
            if (detector.most_triangles > 0 && input.triangles > detector.most_triangles) continue;
            for (const Level& response : alone ? none : experiment.responses) {
                if (!runs_with(response, "inputs", input.file)) continue;
                if (!runs_with(response, "detectors", detector.text)) continue;
                for (const std::string& contacts : generators_of(experiment, response)) {
                    if (!alone && !unreadable(response, contacts).empty()) continue;
                    if (!contacts.empty() && !unreported(detector, contacts).empty()) continue;
                    PlannedRun run = planned(study, experiment, repetition, detector, response, contacts);
                    set_input(experiment, input, run);
                    const bool generated = input.kind == Input::Kind::generated;
                    if (generated || input.kind == Input::Kind::external) {
                        run.group = fmt::format("{} {}", &experiment - study.experiments.data(), input.file);
                    }
                    if (generated && detector.text == study.reference && !experiment.sweep) {
                        PlannedRun again = run;
                        again.spec.repetition = 1;
                        add_combination(experiment, again, runs);
                    }
                    if (!run.settled || repetition == 0) add_combination(experiment, run, runs);
                }
            }
        }
    }
    keep_equal_runs_once(experiment, start, runs);
}

double rough_seconds(const SceneFacts& facts, const RunSpec& spec) {
    const auto ticks = static_cast<double>(spec.ticks);
    const auto triangles = static_cast<double>(facts.triangles);
    if (is_generated(spec)) return 0.4 + 2e-6 * triangles;
    if (is_external(spec)) return 2.0;
    constexpr double start = 0.05;            // s, process and scene
    constexpr double tick = 1.0e-4;           // s
    constexpr double tick_triangle = 1.0e-7;  // s per triangle
    constexpr double judged = 5.0e-4;         // s
    constexpr double judged_triangle = 1.2e-6;
    if (spec.mode == "paced") return start + 2.0 * ticks * facts.dt;
    if (is_mesh_case(spec)) return start;
    if (spec.mode == "metamorphic") return start + 7.0 * ticks * (tick + tick_triangle * triangles);
    if (spec.mode == "resolution")
        return start + 2.0 * ticks * (tick + judged + (tick_triangle + judged_triangle) * triangles);
    const double truth = spec.truth_stride == 0 ? 0.0 : ticks / static_cast<double>(spec.truth_stride);
    return start + ticks * (tick + tick_triangle * triangles) + truth * (judged + judged_triangle * triangles);
}

}  // namespace

/// The method with one parameter set, whatever it was before.
Level with_parameter(const Level& method, const std::string& key, const std::string& value) {
    Level changed = method;
    MethodSpec spec = parse_method(method.text);
    spec.parameters[key] = value;
    changed.text = spec.text();
    return changed;
}

std::string methods_in_words(const RunSpec& spec) {
    std::string text = spec.detector;
    if (!spec.response.empty()) text += (text.empty() ? "" : " + ") + spec.response;
    if (!spec.stepper.empty()) text += ", " + spec.stepper;
    if (spec.mode == "closed_loop") text += " (" + spec.contacts + ")";
    if (!spec.point.empty()) text += " [" + spec.knob + " " + spec.point + "]";
    return text;
}

std::vector<PlannedRun> make_plan(const Study& study) {
    std::int64_t repetitions = 0;
    for (const Experiment& experiment : study.experiments) repetitions = std::max(repetitions, experiment.repetitions);
    if (are_sizes_limited() && repetitions > most_runs) {
        throw InputError("study", "", limit_text(most_runs, "runs"), fmt::format("{} repetitions", repetitions));
    }
    std::vector<PlannedRun> plan;
    Random random(study.seed);
    for (std::int64_t repetition = 0; repetition < repetitions; ++repetition) {
        std::vector<PlannedRun> runs;
        for (const Experiment& experiment : study.experiments) {
            if (repetition < experiment.repetitions) add_experiment(study, experiment, repetition, runs);
        }
        random.shuffle(runs);
        for (PlannedRun& run : runs) add_run(std::move(run), plan);
    }
    return plan;
}

void complete_run(const SceneFacts& facts, PlannedRun& run) {
    if (run.spec.mode != "hard_case") run.spec.scene = facts.name;
    run.spec.scene_hash = facts.hash;
    if (!facts.references.empty()) run.facts["scene.references"] = facts.references;
    run.spec.pair_class = facts.pair_class;
    if (run.spec.ticks == 0) run.spec.ticks = facts.ticks;
    if (is_generated(run.spec)) run.spec.truth_stride = ticks_per_block(run.spec.ticks);
    if (override_value(run.spec.overrides, "cycles") > 0.0 && facts.motions != 1 && !facts.lacks_data) {
        throw InputError("study", run.spec.scene_file, "one body with a motion, for cycles to repeat",
                         fmt::format("{}", facts.motions));
    }
    if (run.spec.mode == "resolution" && !facts.has_resolution_window && !facts.lacks_data) {
        throw InputError(
            "study", run.spec.scene_file,
            fmt::format("contact_off and {} s after it, to hold a run against its twin", ResolutionWindow::length),
            "a scene without");
    }
    if (const double dt = override_value(run.spec.overrides, "dt"); dt > 0.0) {
        // The same time, in other ticks.
        run.spec.ticks = std::max(1LL, std::llround(static_cast<double>(run.spec.ticks) * facts.dt / dt));
    }
    if (are_sizes_limited() && run.spec.ticks > most_record_ticks) {
        throw InputError("study", run.spec.scene, limit_text(most_record_ticks, "ticks of a run"),
                         fmt::format("{}", run.spec.ticks));
    }
    run.rough_seconds = rough_seconds(facts, run.spec);
    if (facts.lacks_data && !run.settled) {
        run.settled = Outcome{OutcomeKind::unsupported, "no data"};
    }
}

}  // namespace trocar
