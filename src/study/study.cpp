#include "study/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include "geometry/input_error.hpp"
#include "method/registry.hpp"
#include "scene/json_node.hpp"
#include "simulate/overrides.hpp"

namespace trocar {
namespace {

constexpr const char* study_format = "trocar-study-1";

/// An object with known keys only, and all of `required`.
void expect_object(const JsonNode& node, const std::vector<std::string>& known,
                   const std::vector<std::string>& required) {
    node.expect_keys(known);
    for (const std::string& key : required) (void)node.at(key);
}

/// A list that is not empty.
std::vector<JsonNode> items_of(const JsonNode& node) {
    std::vector<JsonNode> items = node.list();
    if (items.empty()) node.fail("a list that is not empty");
    return items;
}

std::int64_t count_of(const JsonNode& node) { return node.integer(1, 1'000'000'000'000); }

std::optional<std::string> reason_of_absence(const std::vector<AbsentMethod>& absent, const std::string& name) {
    for (const AbsentMethod& method : absent) {
        if (method.name == name) return method.reason;
    }
    return std::nullopt;
}

/// Checks a method text against the registry; the registry's own complaint is passed on with the place in the file.
template <typename LookUp>
StudyMethod check_method(const JsonNode& node, const std::string& text, const std::vector<AbsentMethod>& absent,
                         LookUp look_up) {
    StudyMethod method;
    try {
        const MethodSpec spec = parse_method(text);
        method.text = spec.text();
        method.absent_reason = reason_of_absence(absent, spec.name);
        if (!method.absent_reason) {
            const auto& entry = look_up(spec.name);
            const ParameterValues checked(entry.name, entry.parameters, spec.parameters);
        }
    } catch (const InputError& error) {
        node.fail("a method of trocar list", error.what());
    }
    return method;
}

StudyMethod read_method(const JsonNode& node, bool is_detector, const std::vector<std::string>& scenes = {}) {
    const bool plain = node.is_text();
    if (!plain && scenes.empty()) expect_object(node, {"method", "setting", "basis"}, {"method"});
    if (!plain && !scenes.empty()) expect_object(node, {"method", "setting", "basis", "scenes"}, {"method"});
    const JsonNode name = plain ? node : node.at("method");
    StudyMethod method =
        is_detector ? check_method(name, name.text(), registry().absent_detectors(),
                                   [](const std::string& n) -> const DetectorEntry& { return registry().detector(n); })
                    : check_method(name, name.text(), registry().absent_responses(),
                                   [](const std::string& n) -> const ResponseEntry& { return registry().response(n); });
    if (plain) return method;
    if (node.has("setting")) {
        method.setting = node.at("setting").word({"default", "recommended", "tuned"});
    }
    if (node.has("scenes")) {
        for (const JsonNode& item : items_of(node.at("scenes"))) method.scenes.push_back(item.word(scenes));
    }
    if (node.has("basis")) method.basis = node.at("basis").text();
    if (method.setting != "default" && method.basis.empty()) {
        node.fail("the key 'basis' (who recommends the setting, or the search and its budget)", "none");
    }
    return method;
}

std::vector<StudyMethod> read_methods(const JsonNode& node, bool is_detector, const std::vector<std::string>& scenes) {
    std::vector<StudyMethod> methods;
    std::set<std::string> seen;
    for (const JsonNode& item : items_of(node)) {
        methods.push_back(read_method(item, is_detector, scenes));
        if (!seen.insert(methods.back().text).second) item.fail("each method once", methods.back().text + " again");
    }
    return methods;
}

std::vector<std::string> read_scenes(const JsonNode& node, const std::filesystem::path& study_file) {
    std::vector<std::string> scenes;
    std::set<std::string> seen;
    for (const JsonNode& item : items_of(node)) {
        scenes.push_back(item.text());
        if (!seen.insert(scenes.back()).second) item.fail("each scene once", scenes.back() + " again");
        if (!std::filesystem::is_regular_file(study_file.parent_path() / scenes.back())) {
            item.fail("a scene file, relative to the study file", fmt::format("'{}' (no such file)", scenes.back()));
        }
    }
    return scenes;
}

template <typename Part>
void read_counts(const JsonNode& node, std::int64_t repetitions, Part& part) {
    part.repetitions = node.has("repetitions") ? count_of(node.at("repetitions")) : repetitions;
    part.ticks = node.has("ticks") ? count_of(node.at("ticks")) : 0;
    part.truth_stride = node.has("truth_stride") ? count_of(node.at("truth_stride")) : 1;
}

std::string text_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream || !std::filesystem::is_regular_file(file)) {
        throw InputError(file.string(), "", "a study file", "no such file");
    }
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

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

void settle_absent(PlannedRun& run) {
    for (const StudyMethod* method : {&run.detector, &run.response}) {
        if (!method->absent_reason || run.settled) continue;
        run.settled = Outcome{OutcomeKind::absent,
                              fmt::format("{}: {}", parse_method(method->text).name, *method->absent_reason)};
    }
}

bool has_native_contacts(const StudyMethod& detector) {
    return detector.absent_reason || registry().detector(parse_method(detector.text).name).native_contacts;
}

/// Why a response can do nothing with contacts of this source; empty when it can.
std::string unreadable(const StudyMethod& response, const std::string& contacts) {
    if (response.absent_reason) return {};
    const ResponseEntry& entry = registry().response(parse_method(response.text).name);
    if (contacts == "canonical" && entry.needs_native) return "the response reads native contacts only";
    if (contacts == "native" && !entry.reads_native) {
        return "the response needs the overlap case of a contact, which native contacts do not tell";
    }
    return {};
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

bool runs_on(const StudyMethod& method, const std::string& scene) {
    return method.scenes.empty() || std::find(method.scenes.begin(), method.scenes.end(), scene) != method.scenes.end();
}

/// The method with one parameter set, whatever it was before.
StudyMethod with_parameter(const StudyMethod& method, const std::string& key, const std::string& value) {
    StudyMethod changed = method;
    MethodSpec spec = parse_method(method.text);
    spec.parameters[key] = value;
    changed.text = spec.text();
    return changed;
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
                    for (const std::string& value : sweep.values) {
                        PlannedRun run =
                            planned(study, "work_precision", scene, part.ticks, part.truth_stride, repetition,
                                    owner == "detector" ? with_parameter(detector, key, value) : detector,
                                    owner == "response" ? with_parameter(response, key, value) : response,
                                    sweep.responses.empty() ? "" : sweep.contacts);
                        if (owner == sweep.knob) run.spec.overrides = sweep.knob + "=" + value;
                        run.spec.knob = sweep.knob;
                        run.spec.point = value;
                        if (!run.settled || repetition == 0) runs.push_back(std::move(run));
                    }
                }
            }
        }
    }
}

void add_ablation(const Study& study, std::int64_t repetition, std::vector<PlannedRun>& runs) {
    if (!study.ablation || repetition >= study.ablation->repetitions) return;
    const AblationPart& part = *study.ablation;
    for (const std::string& scene : part.scenes) {
        const auto add = [&](const StudyMethod& response, const std::string& knob, const std::string& point) {
            PlannedRun run = planned(study, "ablation", scene, part.ticks, part.truth_stride, repetition, part.detector,
                                     response, "canonical");
            run.spec.knob = knob;
            run.spec.point = point;
            if (!run.settled || repetition == 0) runs.push_back(std::move(run));
        };
        add(part.from, "", "from");
        add(part.to, "", "to");
        for (const AblationPart::Switch& one : part.switches) {
            if (!one.scenes.empty() && std::find(one.scenes.begin(), one.scenes.end(), scene) == one.scenes.end()) {
                continue;
            }
            const std::string& back = one.from.empty() ? one.to : one.from;
            add(with_parameter(part.from, one.parameter, one.to), one.parameter, "from with " + one.to);
            add(with_parameter(part.to, one.parameter, back), one.parameter, "to with " + back);
        }
    }
}

/// The runs of one repetition; an unanswerable combination is told once, in the first repetition, not per scene.
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
                if (wanted(run)) runs.push_back(std::move(run));
            }
        }
    }
    if (study.closed_loop && repetition < study.closed_loop->repetitions) {
        const ClosedLoopPart& part = *study.closed_loop;
        for (const std::string& contacts : part.contacts) {
            for (const StudyMethod& response : part.responses) {
                const std::string reason = unreadable(response, contacts);
                if (reason.empty() || repetition > 0) continue;
                PlannedRun run = planned(study, "closed_loop", "", part.ticks, part.truth_stride, 0, StudyMethod{},
                                         response, contacts);
                run.settled = Outcome{OutcomeKind::unsupported, reason};
                runs.push_back(std::move(run));
            }
            for (const StudyMethod& detector : part.detectors) {
                if (contacts == "native" && !has_native_contacts(detector)) {
                    if (repetition > 0) continue;
                    PlannedRun run = planned(study, "closed_loop", "", part.ticks, part.truth_stride, 0, detector,
                                             StudyMethod{}, contacts);
                    run.settled = Outcome{OutcomeKind::unsupported, "the detector has no contacts of its own"};
                    runs.push_back(std::move(run));
                    continue;
                }
                for (const StudyMethod& response : part.responses) {
                    if (!unreadable(response, contacts).empty()) continue;
                    for (const std::string& scene : part.scenes) {
                        if (!runs_on(detector, scene) || !runs_on(response, scene)) continue;
                        PlannedRun run = planned(study, "closed_loop", scene, part.ticks, part.truth_stride, repetition,
                                                 detector, response, contacts);
                        if (wanted(run)) runs.push_back(std::move(run));
                    }
                }
            }
        }
    }
    if (study.triangle_pair && repetition < study.triangle_pair->repetitions) {
        for (const std::string& scene : study.triangle_pair->scenes) {
            PlannedRun run =
                planned(study, "triangle_pair", scene, study.triangle_pair->ticks, study.triangle_pair->truth_stride,
                        repetition, StudyMethod{}, study.triangle_pair->response, "canonical");
            if (wanted(run)) runs.push_back(std::move(run));
        }
    }
    add_sweeps(study, repetition, runs);
    add_ablation(study, repetition, runs);
    if (study.paced && repetition < study.paced->repetitions) {
        for (const std::string& scene : study.paced->scenes) {
            for (const StudyMethod& detector : study.paced->detectors) {
                for (const StudyMethod& response : study.paced->responses) {
                    if (!runs_on(detector, scene) || !runs_on(response, scene)) continue;
                    PlannedRun run = planned(study, "paced", scene, study.paced->ticks, 0, repetition, detector,
                                             response, "canonical");
                    if (wanted(run)) runs.push_back(std::move(run));
                }
            }
        }
    }
    return runs;
}

std::string settings_text(const std::vector<Parameter>& declared, const std::map<std::string, std::string>& given,
                          std::string_view method) {
    const ParameterValues values(method, declared, given);
    std::vector<std::string> items;
    for (const Parameter& parameter : declared) {
        const std::string& value = values.text(parameter.name);
        std::string item = fmt::format("{} = {}", parameter.name, value);
        if (!parameter.unit.empty() && parameter.unit != "1" && value.find_first_of("0123456789") == 0) {
            item += " " + parameter.unit;
        }
        if (value != parameter.default_value) item += fmt::format(" (default {})", parameter.default_value);
        items.push_back(std::move(item));
    }
    return fmt::format("{}", fmt::join(items, ", "));
}

template <typename Entry>
void add_entry_facts(const std::string& prefix, const Entry& entry, const StudyMethod& method,
                     std::map<std::string, std::string>& facts) {
    facts[prefix + "library"] = entry.library;
    facts[prefix + "version"] = entry.version;
    facts[prefix + "configuration"] = entry.configuration;
    facts[prefix + "own"] = entry.own ? "yes" : "no";
    facts[prefix + "settings"] = settings_text(entry.parameters, parse_method(method.text).parameters, entry.name);
}

void add_method_facts(const std::string& prefix, const StudyMethod& method, std::map<std::string, std::string>& facts) {
    facts[prefix + "setting"] = method.setting;
    facts[prefix + "basis"] = method.basis;
    if (method.absent_reason) facts[prefix + "absent"] = *method.absent_reason;
}

/// Checks a parameter of every method of the list by making the method with it.
void check_parameter(const JsonNode& node, const std::vector<StudyMethod>& methods, bool is_detector,
                     const std::string& key, const std::string& value) {
    for (const StudyMethod& method : methods) {
        if (method.absent_reason) continue;
        const MethodSpec spec = parse_method(with_parameter(method, key, value).text);
        try {
            if (is_detector) {
                const DetectorEntry& entry = registry().detector(spec.name);
                const ParameterValues checked(entry.name, entry.parameters, spec.parameters);
            } else {
                const ResponseEntry& entry = registry().response(spec.name);
                const ParameterValues checked(entry.name, entry.parameters, spec.parameters);
            }
        } catch (const InputError& error) {
            node.fail("a parameter and value of trocar list", error.what());
        }
    }
}

WorkPrecisionPart read_sweeps(const JsonNode& node, const std::filesystem::path& file, std::int64_t repetitions) {
    expect_object(node, {"sweeps", "ticks", "repetitions", "truth_stride"}, {"sweeps"});
    WorkPrecisionPart part;
    read_counts(node, repetitions, part);
    for (const JsonNode& item : items_of(node.at("sweeps"))) {
        expect_object(item, {"scenes", "detectors", "responses", "contacts", "knob", "values"},
                      {"scenes", "detectors", "knob", "values"});
        WorkPrecisionPart::Sweep sweep;
        sweep.scenes = read_scenes(item.at("scenes"), file);
        sweep.detectors = read_methods(item.at("detectors"), true, sweep.scenes);
        if (item.has("responses")) sweep.responses = read_methods(item.at("responses"), false, sweep.scenes);
        if (item.has("contacts")) sweep.contacts = item.at("contacts").word({"canonical", "native"});
        const JsonNode knob = item.at("knob");
        sweep.knob = knob.text();
        const bool of_detector = sweep.knob.rfind("detector.", 0) == 0;
        const bool of_response = sweep.knob.rfind("response.", 0) == 0;
        const auto& knobs = scene_knobs();
        const bool of_scene =
            std::any_of(knobs.begin(), knobs.end(), [&sweep](const SceneKnob& one) { return one.name == sweep.knob; });
        if (!of_detector && !of_response && !of_scene) {
            knob.fail("dt, k, substeps, detector.KEY or response.KEY", "'" + sweep.knob + "'");
        }
        if (!of_detector && sweep.responses.empty()) {
            item.fail("the key 'responses': this knob acts in the closed loop only", "none");
        }
        for (const JsonNode& value : items_of(item.at("values"))) {
            sweep.values.push_back(value.is_text() ? value.text() : fmt::format("{}", value.number()));
            const std::string& text = sweep.values.back();
            const std::string key = sweep.knob.substr(sweep.knob.find('.') + 1);
            if (of_detector) check_parameter(value, sweep.detectors, true, key, text);
            if (of_response) check_parameter(value, sweep.responses, false, key, text);
            if (!of_scene) continue;
            try {
                (void)override_value(sweep.knob + "=" + text, sweep.knob);
            } catch (const InputError& error) {
                value.fail("a value of the knob " + sweep.knob, error.what());
            }
        }
        part.sweeps.push_back(std::move(sweep));
    }
    return part;
}

AblationPart read_ablation(const JsonNode& node, const std::filesystem::path& file, std::int64_t repetitions) {
    expect_object(node, {"scenes", "detector", "from", "to", "switches", "ticks", "repetitions", "truth_stride"},
                  {"scenes", "detector", "from", "to", "switches"});
    AblationPart part;
    read_counts(node, repetitions, part);
    part.scenes = read_scenes(node.at("scenes"), file);
    part.detector = read_method(node.at("detector"), true);
    part.from = read_method(node.at("from"), false);
    part.to = read_method(node.at("to"), false);
    for (const JsonNode& item : items_of(node.at("switches"))) {
        expect_object(item, {"parameter", "from", "to", "scenes"}, {"parameter", "to"});
        AblationPart::Switch one{.parameter = item.at("parameter").text(),
                                 .from = item.has("from") ? item.at("from").text() : std::string(),
                                 .to = item.at("to").text(),
                                 .scenes = {}};
        check_parameter(item, {part.from}, false, one.parameter, one.to);
        check_parameter(item, {part.to}, false, one.parameter, one.from.empty() ? one.to : one.from);
        if (item.has("scenes")) {
            for (const JsonNode& scene : items_of(item.at("scenes"))) one.scenes.push_back(scene.word(part.scenes));
        }
        part.switches.push_back(std::move(one));
    }
    return part;
}

}  // namespace

Study read_study(const std::filesystem::path& file) {
    const std::string file_name = file.string();
    const Json document = parse_json(text_of(file), file_name);
    const JsonNode root(document, file_name);
    expect_object(root,
                  {"format", "name", "seed", "repetitions", "time_limit_s", "reference", "replay", "closed_loop",
                   "triangle_pair", "work_precision", "ablation", "paced"},
                  {"format", "name"});
    root.at("format").expect_word(study_format);

    Study study;
    study.file = file;
    study.name = root.at("name").text();
    if (study.name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") !=
        std::string::npos) {
        root.at("name").fail("a name of letters, digits, _ and - (it names a folder)");
    }
    if (root.has("seed")) study.seed = root.at("seed").unsigned_integer();
    const std::int64_t repetitions = root.has("repetitions") ? count_of(root.at("repetitions")) : 1;
    if (root.has("time_limit_s")) study.time_limit_s = root.at("time_limit_s").positive();

    if (root.has("replay")) {
        const JsonNode node = root.at("replay");
        expect_object(node, {"scenes", "detectors", "ticks", "repetitions", "truth_stride", "between_ticks"},
                      {"scenes", "detectors"});
        ReplayPart part;
        part.scenes = read_scenes(node.at("scenes"), file);
        part.detectors = read_methods(node.at("detectors"), true, part.scenes);
        read_counts(node, repetitions, part);
        if (node.has("between_ticks")) part.between_ticks = node.at("between_ticks").flag();
        study.replay = std::move(part);
    }
    if (root.has("closed_loop")) {
        const JsonNode node = root.at("closed_loop");
        expect_object(node, {"scenes", "detectors", "responses", "contacts", "ticks", "repetitions", "truth_stride"},
                      {"scenes", "detectors", "responses"});
        ClosedLoopPart part;
        part.scenes = read_scenes(node.at("scenes"), file);
        part.detectors = read_methods(node.at("detectors"), true, part.scenes);
        part.responses = read_methods(node.at("responses"), false, part.scenes);
        if (node.has("contacts")) {
            for (const JsonNode& item : items_of(node.at("contacts"))) {
                const std::string contacts = item.word({"canonical", "native"});
                if (std::find(part.contacts.begin(), part.contacts.end(), contacts) != part.contacts.end()) {
                    item.fail("each contact source once", contacts + " again");
                }
                part.contacts.push_back(contacts);
            }
        } else {
            part.contacts = {"canonical"};
        }
        read_counts(node, repetitions, part);
        study.closed_loop = std::move(part);
    }
    if (root.has("triangle_pair")) {
        const JsonNode node = root.at("triangle_pair");
        expect_object(node, {"scenes", "response", "ticks", "repetitions", "truth_stride"}, {"scenes", "response"});
        TrianglePairPart part;
        part.scenes = read_scenes(node.at("scenes"), file);
        part.response = read_method(node.at("response"), false);
        read_counts(node, repetitions, part);
        study.triangle_pair = std::move(part);
    }
    if (root.has("work_precision")) study.work_precision = read_sweeps(root.at("work_precision"), file, repetitions);
    if (root.has("ablation")) study.ablation = read_ablation(root.at("ablation"), file, repetitions);
    if (root.has("paced")) {
        const JsonNode node = root.at("paced");
        expect_object(node, {"scenes", "detectors", "responses", "ticks", "repetitions"},
                      {"scenes", "detectors", "responses"});
        PacedPart part;
        part.scenes = read_scenes(node.at("scenes"), file);
        part.detectors = read_methods(node.at("detectors"), true, part.scenes);
        part.responses = read_methods(node.at("responses"), false, part.scenes);
        read_counts(node, repetitions, part);
        study.paced = std::move(part);
    }
    if (!study.replay && !study.closed_loop && !study.triangle_pair && !study.work_precision && !study.ablation &&
        !study.paced) {
        root.fail("at least one of the keys replay, closed_loop, triangle_pair, work_precision, ablation, paced",
                  "none of them");
    }
    if (root.has("reference")) {
        study.reference = read_method(root.at("reference"), true).text;
        const auto named = [&study](const auto& part) {
            return part && std::any_of(part->detectors.begin(), part->detectors.end(),
                                       [&study](const StudyMethod& m) { return m.text == study.reference; });
        };
        if (!named(study.replay) && !named(study.closed_loop)) {
            root.at("reference").fail("one of the study's detectors");
        }
    }
    return study;
}

SceneFacts facts_of(const Scene& scene) {
    SceneFacts facts;
    facts.name = scene.name;
    facts.hash = fmt::format("{:016x}", scene.hash);
    facts.ticks = scene.ticks;
    facts.dt = scene.dt;
    facts.triangles = scene.topology.triangle_count();
    std::set<std::string> classes;
    for (const auto& [first, second] : scene.topology.body_pairs) {
        constexpr std::string_view letters = "IRT";
        const auto kind_a = static_cast<std::size_t>(scene.topology.bodies[static_cast<std::size_t>(first)].kind);
        const auto kind_b = static_cast<std::size_t>(scene.topology.bodies[static_cast<std::size_t>(second)].kind);
        classes.insert(fmt::format("{}2{}", letters[std::min(kind_a, kind_b)], letters[std::max(kind_a, kind_b)]));
    }
    facts.pair_class = fmt::format("{}", fmt::join(classes, "+"));
    return facts;
}

SceneFacts read_scene_facts(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data) {
    SceneFacts facts;
    facts.name = file.stem().string();
    if (lacks_data(file, data)) {
        facts.lacks_data = true;
        return facts;
    }
    return facts_of(read_scene(file, data));
}

std::vector<PlannedRun> make_plan(const Study& study) {
    std::int64_t repetitions = 0;
    if (study.work_precision) repetitions = std::max(repetitions, study.work_precision->repetitions);
    if (study.ablation) repetitions = std::max(repetitions, study.ablation->repetitions);
    if (study.paced) repetitions = std::max(repetitions, study.paced->repetitions);
    if (study.replay) repetitions = std::max(repetitions, study.replay->repetitions);
    if (study.closed_loop) repetitions = std::max(repetitions, study.closed_loop->repetitions);
    if (study.triangle_pair) repetitions = std::max(repetitions, study.triangle_pair->repetitions);
    std::vector<PlannedRun> plan;
    std::uint64_t random = study.seed;
    for (std::int64_t repetition = 0; repetition < repetitions; ++repetition) {
        std::vector<PlannedRun> runs = block(study, repetition);
        shuffle(runs, random);
        std::move(runs.begin(), runs.end(), std::back_inserter(plan));
    }
    return plan;
}

namespace {

double rough_seconds(const SceneFacts& facts, const RunSpec& spec) {
    const auto ticks = static_cast<double>(spec.ticks);
    const auto triangles = static_cast<double>(facts.triangles);
    constexpr double start = 0.05;            // s, process and scene
    constexpr double tick = 1.0e-4;           // s
    constexpr double tick_triangle = 1.0e-7;  // s per triangle
    constexpr double judged = 5.0e-4;         // s
    constexpr double judged_triangle = 1.2e-6;
    if (spec.mode == "paced") return start + 2.0 * ticks * facts.dt;
    const double truth =
        spec.mode == "triangle_pair" || spec.truth_stride == 0 ? 0.0 : ticks / static_cast<double>(spec.truth_stride);
    return start + ticks * (tick + tick_triangle * triangles) + truth * (judged + judged_triangle * triangles);
}

}  // namespace

void complete_run(const SceneFacts& facts, PlannedRun& run) {
    run.spec.scene = facts.name;
    run.spec.scene_hash = facts.hash;
    run.spec.pair_class = facts.pair_class;
    if (run.spec.ticks == 0) run.spec.ticks = facts.ticks;
    if (const double dt = override_value(run.spec.overrides, "dt"); dt > 0.0) {
        // The same time, in other ticks.
        run.spec.ticks = std::max(1LL, std::llround(static_cast<double>(run.spec.ticks) * facts.dt / dt));
    }
    run.rough_seconds = rough_seconds(facts, run.spec);
    if (facts.lacks_data && !run.settled) {
        run.settled = Outcome{OutcomeKind::unsupported, "no data"};
    }
}

std::map<std::string, std::string> method_facts(const Study& study, const PlannedRun& run) {
    std::map<std::string, std::string> facts;
    const bool outside = study.file.is_absolute() || study.file.generic_string().rfind("..", 0) == 0;
    facts["study.file"] = (outside ? study.file.filename() : study.file).generic_string();
    facts["study.reference"] = study.reference;
    facts["study.time_limit_s"] = fmt::format("{}", study.time_limit_s);
    const Registry& all = registry();
    for (const AbsentMethod& method : all.absent_detectors()) facts["absent.detector." + method.name] = method.reason;
    for (const AbsentMethod& method : all.absent_responses()) facts["absent.response." + method.name] = method.reason;
    if (!run.detector.text.empty()) {
        add_method_facts("detector.", run.detector, facts);
        if (!run.detector.absent_reason) {
            const DetectorEntry& entry = all.detector(parse_method(run.detector.text).name);
            add_entry_facts("detector.", entry, run.detector, facts);
            facts["detector.claims_exact"] = entry.claims_exact ? "yes" : "no";
            facts["detector.native_contacts"] = entry.native_contacts ? "yes" : "no";
        }
    }
    if (!run.response.text.empty()) {
        add_method_facts("response.", run.response, facts);
        if (!run.response.absent_reason) {
            const ResponseEntry& entry = all.response(parse_method(run.response.text).name);
            add_entry_facts("response.", entry, run.response, facts);
            facts["response.table_row"] = entry.table_row;
        }
    }
    return facts;
}

}  // namespace trocar
