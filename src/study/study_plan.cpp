// From a study to its shuffled list of runs: which combinations are made, which are settled without being made.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"
#include "method/registry.hpp"
#include "simulate/overrides.hpp"
#include "study/study.hpp"

namespace trocar {
namespace {

/// splitmix64 (Steele, Lea, Flood 2014): the same shuffle with every standard library.
std::uint64_t next_random(std::uint64_t& state) {
    std::uint64_t z = (state += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
}

void shuffle(std::vector<PlannedRun>& runs, std::uint64_t& state) {
    for (std::size_t i = runs.size(); i > 1; --i) {
        std::swap(runs[i - 1], runs[static_cast<std::size_t>(next_random(state) % i)]);
    }
}

void add_run(PlannedRun run, std::vector<PlannedRun>& runs) {
    if (are_sizes_limited() && runs.size() >= static_cast<std::size_t>(most_runs)) {
        throw InputError("study", "", limit_text(most_runs, "runs"), "more");
    }
    runs.push_back(std::move(run));
}

void settle_absent(PlannedRun& run) {
    for (const StudyMethod* method : {&run.detector, &run.response}) {
        if (!method->absent_reason || run.settled) continue;
        run.settled = Outcome{OutcomeKind::absent,
                              fmt::format("{}: {}", parse_method(method->text).name, *method->absent_reason)};
    }
}

/// Why a detector has nothing to give for contacts of this generator; empty when it has.
std::string unreported(const StudyMethod& detector, const std::string& contacts) {
    if (detector.absent_reason) return {};
    return why_unreported(registry().detector(parse_method(detector.text).name),
                          registry().contact_generator(contacts));
}

/// Why a response can do nothing with contacts of this generator; empty when it can.
std::string unreadable(const StudyMethod& response, const std::string& contacts) {
    if (response.absent_reason) return {};
    return why_unreadable(registry().contact_generator(contacts), parse_method(response.text));
}

/// The contact generator that a response works from where none is named.
std::string own_contact_generator(const StudyMethod& response) {
    if (response.absent_reason) return "intersection";
    return default_contact_generator(parse_method(response.text));
}

/// Why the two cannot work on contacts of this generator; empty when they can, and for a detector alone.
std::string why_without_contacts(const StudyMethod& detector, const StudyMethod& response,
                                 const std::string& contacts) {
    if (response.text.empty()) return {};
    const std::string reason = unreported(detector, contacts);
    return reason.empty() ? unreadable(response, contacts) : reason;
}

PlannedRun planned(const Study& study, const std::string& mode, const std::string& scene_file, std::int64_t ticks,
                   std::int64_t truth_stride, std::int64_t repetition, const StudyMethod& detector,
                   const StudyMethod& response, const std::string& contacts) {
    PlannedRun run;
    run.spec.study = study.name;
    run.spec.mode = mode;
    run.spec.scene_file = scene_file;
    run.spec.scene = std::filesystem::path(scene_file).stem().string();
    run.spec.detector = detector.text;
    run.spec.response = response.text;
    run.spec.contacts = contacts;
    if (!response.text.empty()) run.spec.device = study.device;
    run.spec.setting = detector.text.empty() ? response.setting : detector.setting;
    run.spec.repetition = repetition;
    run.spec.seed = study.seed;
    run.spec.ticks = ticks;
    run.spec.truth_stride = truth_stride;
    run.detector = detector;
    run.response = response;
    settle_absent(run);
    return run;
}

bool is_among(const std::vector<std::string>& chosen, const std::string& one) {
    return chosen.empty() || std::find(chosen.begin(), chosen.end(), one) != chosen.end();
}

bool runs_on(const StudyMethod& method, const std::string& scene) { return is_among(method.scenes, scene); }

/// Loops that nobody judges.
void add_loops(const Study& study, const std::string& mode, const std::optional<LoopPart>& part,
               std::int64_t repetition, std::vector<PlannedRun>& runs) {
    if (!part || repetition >= part->repetitions) return;
    const std::vector<std::string> steppers = part->steppers.empty() ? std::vector<std::string>{""} : part->steppers;
    for (const std::string& scene : part->scenes) {
        for (const StudyMethod& detector : part->detectors) {
            for (const StudyMethod& response : part->responses) {
                if (!runs_on(detector, scene) || !runs_on(response, scene)) continue;
                for (const std::string& stepper : steppers) {
                    PlannedRun run = planned(study, mode, scene, part->ticks, 0, repetition, detector, response,
                                             own_contact_generator(response));
                    run.spec.stepper = stepper;
                    run.facts["run.stepper"] = stepper.empty() ? registry().default_stepper().name : stepper;
                    if (!run.settled || repetition == 0) add_run(std::move(run), runs);
                }
            }
        }
    }
}

void add_sweeps(const Study& study, std::int64_t repetition, std::vector<PlannedRun>& runs) {
    if (!study.work_precision || repetition >= study.work_precision->repetitions) return;
    const WorkPrecisionPart& part = *study.work_precision;
    for (const WorkPrecisionPart::Sweep& sweep : part.sweeps) {
        const std::string owner = sweep.knob.substr(0, sweep.knob.find('.'));
        const std::string key = sweep.knob.substr(std::min(sweep.knob.find('.') + 1, sweep.knob.size()));
        const std::vector<StudyMethod> responses =
            sweep.responses.empty() ? std::vector<StudyMethod>{StudyMethod{}} : sweep.responses;
        for (const std::string& scene : sweep.scenes) {
            for (const StudyMethod& detector : sweep.detectors) {
                for (const StudyMethod& response : responses) {
                    if (!runs_on(detector, scene) || !runs_on(response, scene)) continue;
                    const bool own = sweep.contacts.empty() && !response.text.empty();
                    const std::string contacts = own ? own_contact_generator(response) : sweep.contacts;
                    const std::string reason = why_without_contacts(detector, response, contacts);
                    for (const std::string& value : sweep.values) {
                        PlannedRun run =
                            planned(study, "work_precision", scene, part.ticks, part.truth_stride, repetition,
                                    owner == "detector" ? with_parameter(detector, key, value) : detector,
                                    owner == "response" ? with_parameter(response, key, value) : response,
                                    sweep.responses.empty() ? "" : contacts);
                        if (owner == sweep.knob) run.spec.overrides = sweep.knob + "=" + value;
                        run.spec.knob = sweep.knob;
                        run.spec.point = value;
                        if (!run.settled && !reason.empty()) run.settled = Outcome{OutcomeKind::unsupported, reason};
                        if (!run.settled || repetition == 0) add_run(std::move(run), runs);
                    }
                }
            }
        }
    }
}

/// What a record must say of its case, so that the report needs no other file.
std::map<std::string, std::string> facts_of(const HardCase& hard_case) {
    std::map<std::string, std::string> facts{{"case.of", hard_case.of},
                                             {"case.reason", hard_case.reason},
                                             {"case.outcome", std::string(name_of(hard_case.outcome))}};
    if (hard_case.pairs) {
        facts["case.expected"] = fmt::format("{} {}, {} touching", hard_case.pairs->size(),
                                             hard_case.pairs->size() == 1 ? "pair" : "pairs", hard_case.touch.size());
    }
    if (!hard_case.bad_input.empty()) facts["case.expected"] = "refused, naming " + hard_case.bad_input;
    if (!hard_case.tested.empty()) facts["case.tested"] = hard_case.tested;
    for (const auto& [figure, most] : hard_case.at_most) facts["case.at_most." + figure] = fmt::format("{}", most);
    return facts;
}

void add_hard_cases(const Study& study, std::int64_t repetition, std::vector<PlannedRun>& runs) {
    if (!study.hard_cases || repetition > 0) return;  // the right answer is no matter of the clock
    const HardCasesPart& part = *study.hard_cases;
    const auto add = [&](const std::string& file, const std::string& name, std::int64_t ticks,
                         const StudyMethod& detector, const StudyMethod& response,
                         std::map<std::string, std::string> facts, const std::optional<Outcome>& settled) {
        PlannedRun run = planned(study, "hard_case", file, ticks, part.truth_stride, repetition, detector, response,
                                 response.text.empty() ? "" : own_contact_generator(response));
        run.spec.scene = name;
        run.facts = std::move(facts);
        if (settled) run.settled = settled;
        add_run(std::move(run), runs);
    };
    for (const HardCase& one : part.cases) {
        const std::string file = (std::filesystem::path(part.folder) / one.name / "expected.json").generic_string();
        const auto facts = facts_of(one);
        if (!one.tested.empty()) {
            add(file, one.name, 1, {}, {}, facts, Outcome{});
        } else if (!one.bad_input.empty()) {
            add(file, one.name, 1, {}, {}, facts, std::nullopt);
        } else if (one.pairs) {
            for (const StudyMethod& detector : part.detectors)
                add(file, one.name, 1, detector, {}, facts, std::nullopt);
        } else {
            const std::filesystem::path scene = std::filesystem::path(part.folder) / one.name / one.scene;
            for (const StudyMethod& response : part.responses) {
                add(scene.lexically_normal().generic_string(), one.name, one.ticks, part.detectors.front(), response,
                    facts, std::nullopt);
            }
        }
    }
    for (const std::string& family : part.families) {
        const std::string name = std::filesystem::path(family).stem().string();
        for (const StudyMethod& detector : part.detectors) add(family, name, 1, detector, {}, {}, std::nullopt);
    }
}

void add_metamorphic_tests(const Study& study, std::int64_t repetition, std::vector<PlannedRun>& runs) {
    if (!study.metamorphic || repetition >= study.metamorphic->repetitions) return;
    const LoopPart& part = *study.metamorphic;
    for (const std::string& scene : part.scenes) {
        const auto add = [&](const StudyMethod& detector, const StudyMethod& response) {
            PlannedRun run = planned(study, "metamorphic", scene, part.ticks, 0, repetition, detector, response,
                                     response.text.empty() ? "" : own_contact_generator(response));
            if (!run.settled || repetition == 0) add_run(std::move(run), runs);
        };
        for (const StudyMethod& detector : part.detectors) {
            if (runs_on(detector, scene)) add(detector, {});
        }
        for (const StudyMethod& response : part.responses) {
            if (runs_on(response, scene)) add(part.detectors.front(), response);
        }
    }
}

/// The runs of one repetition; an unanswerable combination is reported once, in the first repetition, not per scene.
std::vector<PlannedRun> block(const Study& study, std::int64_t repetition) {
    std::vector<PlannedRun> runs;
    const auto wanted = [repetition](const PlannedRun& run) { return !run.settled || repetition == 0; };
    if (study.replay && repetition < study.replay->repetitions) {
        for (const std::string& scene : study.replay->scenes) {
            for (const StudyMethod& detector : study.replay->detectors) {
                if (!runs_on(detector, scene)) continue;
                PlannedRun run = planned(study, "replay", scene, study.replay->ticks, study.replay->truth_stride,
                                         repetition, detector, StudyMethod{}, "");
                run.spec.between_ticks = study.replay->between_ticks;
                if (wanted(run)) add_run(std::move(run), runs);
            }
        }
    }
    if (study.closed_loop && repetition < study.closed_loop->repetitions) {
        const ClosedLoopPart& part = *study.closed_loop;
        std::vector<std::string> contact_generators = part.contacts;
        for (const StudyMethod& response : part.responses) {
            for (const std::string& own : response.contacts) {
                if (!is_among(contact_generators, own)) contact_generators.push_back(own);
            }
        }
        const auto takes = [&part](const StudyMethod& response, const std::string& contacts) {
            return is_among(response.contacts.empty() ? part.contacts : response.contacts, contacts);
        };
        for (const std::string& contacts : contact_generators) {
            for (const StudyMethod& response : part.responses) {
                const std::string reason = unreadable(response, contacts);
                if (reason.empty() || repetition > 0 || !takes(response, contacts)) continue;
                PlannedRun run = planned(study, "closed_loop", "", part.ticks, part.truth_stride, 0, StudyMethod{},
                                         response, contacts);
                run.settled = Outcome{OutcomeKind::unsupported, reason};
                add_run(std::move(run), runs);
            }
            for (const StudyMethod& detector : part.detectors) {
                if (const std::string reason = unreported(detector, contacts); !reason.empty()) {
                    if (repetition > 0) continue;
                    PlannedRun run = planned(study, "closed_loop", "", part.ticks, part.truth_stride, 0, detector,
                                             StudyMethod{}, contacts);
                    run.settled = Outcome{OutcomeKind::unsupported, reason};
                    add_run(std::move(run), runs);
                    continue;
                }
                for (const StudyMethod& response : part.responses) {
                    if (!unreadable(response, contacts).empty() || !takes(response, contacts)) continue;
                    if (!is_among(response.detectors, detector.text)) continue;
                    for (const std::string& scene : part.scenes) {
                        if (!runs_on(detector, scene) || !runs_on(response, scene)) continue;
                        PlannedRun run =
                            planned(study, "closed_loop", scene, part.ticks, detector.judged ? part.truth_stride : 0,
                                    repetition, detector, response, contacts);
                        run.spec.detail_stride = part.detail_stride;
                        if (!wanted(run)) continue;
                        const auto& steppers = response.steppers.empty() ? part.steppers : response.steppers;
                        for (const std::string& stepper : steppers) {
                            add_run(run, runs);
                            runs.back().spec.stepper = stepper;
                        }
                        if (steppers.empty()) add_run(std::move(run), runs);
                    }
                }
            }
        }
    }
    add_sweeps(study, repetition, runs);
    add_hard_cases(study, repetition, runs);
    add_metamorphic_tests(study, repetition, runs);
    add_loops(study, "cost_by_size", study.cost_by_size, repetition, runs);
    add_loops(study, "paced", study.paced, repetition, runs);
    return runs;
}

double rough_seconds(const SceneFacts& facts, const RunSpec& spec) {
    const auto ticks = static_cast<double>(spec.ticks);
    const auto triangles = static_cast<double>(facts.triangles);
    constexpr double start = 0.05;            // s, process and scene
    constexpr double tick = 1.0e-4;           // s
    constexpr double tick_triangle = 1.0e-7;  // s per triangle
    constexpr double judged = 5.0e-4;         // s
    constexpr double judged_triangle = 1.2e-6;
    if (spec.mode == "paced") return start + 2.0 * ticks * facts.dt;
    if (is_mesh_case(spec)) return start;
    if (spec.mode == "metamorphic") return start + 7.0 * ticks * (tick + tick_triangle * triangles);
    const double truth = spec.truth_stride == 0 ? 0.0 : ticks / static_cast<double>(spec.truth_stride);
    return start + ticks * (tick + tick_triangle * triangles) + truth * (judged + judged_triangle * triangles);
}

}  // namespace

/// The method with one parameter set, whatever it was before.
StudyMethod with_parameter(const StudyMethod& method, const std::string& key, const std::string& value) {
    StudyMethod changed = method;
    MethodSpec spec = parse_method(method.text);
    spec.parameters[key] = value;
    changed.text = spec.text();
    return changed;
}

std::vector<PlannedRun> make_plan(const Study& study) {
    std::int64_t repetitions = 0;
    if (study.hard_cases) repetitions = std::max<std::int64_t>(repetitions, 1);
    if (study.metamorphic) repetitions = std::max(repetitions, study.metamorphic->repetitions);
    if (study.work_precision) repetitions = std::max(repetitions, study.work_precision->repetitions);
    if (study.cost_by_size) repetitions = std::max(repetitions, study.cost_by_size->repetitions);
    if (study.paced) repetitions = std::max(repetitions, study.paced->repetitions);
    if (study.replay) repetitions = std::max(repetitions, study.replay->repetitions);
    if (study.closed_loop) repetitions = std::max(repetitions, study.closed_loop->repetitions);
    if (are_sizes_limited() && repetitions > most_runs) {
        throw InputError("study", "", limit_text(most_runs, "runs"), fmt::format("{} repetitions", repetitions));
    }
    std::vector<PlannedRun> plan;
    std::uint64_t random = study.seed;
    for (std::int64_t repetition = 0; repetition < repetitions; ++repetition) {
        std::vector<PlannedRun> runs = block(study, repetition);
        shuffle(runs, random);
        for (PlannedRun& run : runs) add_run(std::move(run), plan);
    }
    return plan;
}

void complete_run(const SceneFacts& facts, PlannedRun& run) {
    if (run.spec.mode != "hard_case") run.spec.scene = facts.name;
    run.spec.scene_hash = facts.hash;
    run.spec.pair_class = facts.pair_class;
    if (run.spec.ticks == 0) run.spec.ticks = facts.ticks;
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
