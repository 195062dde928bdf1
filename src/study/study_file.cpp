// Reading a study file, strictly: every fault is told with its place in the file.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "method/device.hpp"
#include "method/registry.hpp"
#include "scene/json_node.hpp"
#include "simulate/overrides.hpp"
#include "study/study.hpp"

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
            static_cast<void>(checked_values(entry, spec.parameters));
        }
    } catch (const InputError& error) {
        node.fail("a method of trocar list", error.what());
    }
    return method;
}

StudyMethod read_method(const JsonNode& node, bool is_detector, const std::vector<std::string>& scenes = {},
                        const std::vector<std::string>& more_keys = {}) {
    const bool plain = node.is_text();
    std::vector<std::string> keys{"method", "setting", "basis"};
    if (!scenes.empty()) keys.emplace_back("scenes");
    keys.insert(keys.end(), more_keys.begin(), more_keys.end());
    if (!plain) expect_object(node, keys, {"method"});
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

std::vector<StudyMethod> read_methods(const JsonNode& node, bool is_detector, const std::vector<std::string>& scenes,
                                      const std::vector<std::string>& more_keys = {}) {
    std::vector<StudyMethod> methods;
    std::set<std::string> seen;
    for (const JsonNode& item : items_of(node)) {
        methods.push_back(read_method(item, is_detector, scenes, more_keys));
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

/// Checks a parameter of every method of the list by making the method with it.
void check_parameter(const JsonNode& node, const std::vector<StudyMethod>& methods, bool is_detector,
                     const std::string& key, const std::string& value) {
    for (const StudyMethod& method : methods) {
        if (method.absent_reason) continue;
        const MethodSpec spec = parse_method(with_parameter(method, key, value).text);
        try {
            if (is_detector) {
                const DetectorEntry& entry = registry().detector(spec.name);
                static_cast<void>(checked_values(entry, spec.parameters));
            } else {
                const ResponseEntry& entry = registry().response(spec.name);
                static_cast<void>(checked_values(entry, spec.parameters));
            }
        } catch (const InputError& error) {
            node.fail("a parameter and value of trocar list", error.what());
        }
    }
}

/// Name of a contact source of this build.
std::string read_source(const JsonNode& node) {
    std::vector<std::string> names;
    for (const SourceEntry& entry : registry().sources()) names.push_back(entry.name);
    return node.word(names);
}

/// As RunSpec::stepper has them, each once.
std::vector<std::string> read_steppers(const JsonNode& node) {
    std::vector<std::string> steppers;
    for (const JsonNode& item : items_of(node)) {
        std::string text;
        try {
            const MethodSpec spec = parse_method(item.text());
            make_stepper(spec.name, spec.parameters);
            const bool is_default = spec.name == registry().default_stepper().name && spec.parameters.empty();
            text = is_default ? std::string() : spec.text();
        } catch (const InputError& error) {
            item.fail("a stepper of trocar list", error.what());
        }
        if (std::find(steppers.begin(), steppers.end(), text) != steppers.end()) {
            item.fail("each stepper once", item.text() + " again");
        }
        steppers.push_back(text);
    }
    return steppers;
}

/// An object of settings, or the text of a command line. As RunSpec::device has it.
std::string read_device_of(const JsonNode& node) {
    const auto read = [](const JsonNode& place, const auto& given) {
        try {
            return read_device(given);
        } catch (const InputError& error) {
            place.fail("settings of a device of trocar list", error.what());
        }
    };
    if (node.is_text()) return text_of(read(node, node.text()));
    std::vector<std::string> known;
    for (const Parameter& parameter : device_parameters()) known.push_back(parameter.name);
    node.expect_keys(known);
    std::map<std::string, std::string> given;
    for (const std::string& key : node.keys()) {
        const JsonNode value = node.at(key);
        given[key] = value.is_text() ? value.text() : fmt::format("{}", value.number());
        static_cast<void>(read(value, std::map<std::string, std::string>{{key, given[key]}}));
    }
    return text_of(read_device(given));
}

/// What only a closed loop's lists know: which detectors run unjudged, and what each response runs with.
void read_choices(const JsonNode& node, ClosedLoopPart& part) {
    const std::vector<JsonNode> detectors = items_of(node.at("detectors"));
    for (std::size_t i = 0; i < detectors.size(); ++i) {
        if (!detectors[i].is_text() && detectors[i].has("judged"))
            part.detectors[i].judged = detectors[i].at("judged").flag();
    }
    std::vector<std::string> names;
    for (const StudyMethod& detector : part.detectors) names.push_back(detector.text);
    const std::vector<JsonNode> responses = items_of(node.at("responses"));
    for (std::size_t i = 0; i < responses.size(); ++i) {
        if (responses[i].is_text()) continue;
        StudyMethod& response = part.responses[i];
        if (const auto chosen = responses[i].find("detectors")) {
            for (const JsonNode& item : items_of(*chosen)) response.detectors.push_back(item.word(names));
        }
        if (const auto chosen = responses[i].find("contacts")) {
            for (const JsonNode& item : items_of(*chosen)) response.contacts.push_back(item.word(part.contacts));
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
        if (item.has("contacts")) sweep.contacts = read_source(item.at("contacts"));
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
                  {"scenes", "detector", "from", "switches"});
    AblationPart part;
    read_counts(node, repetitions, part);
    part.scenes = read_scenes(node.at("scenes"), file);
    part.detector = read_method(node.at("detector"), true);
    part.from = read_method(node.at("from"), false);
    if (node.has("to")) part.to = read_method(node.at("to"), false);
    std::vector<StudyMethod> ends{part.from};
    if (!part.to.text.empty()) ends.push_back(part.to);
    for (const JsonNode& item : items_of(node.at("switches"))) {
        expect_object(item, {"parameter", "from", "to", "scenes", "with", "silent"}, {"parameter", "to"});
        AblationPart::Switch one{.parameter = item.at("parameter").text(),
                                 .from = item.has("from") ? item.at("from").text() : std::string(),
                                 .to = item.at("to").text(),
                                 .scenes = {},
                                 .with = item.has("with") ? item.at("with").text() : std::string(),
                                 .silent_from = {},
                                 .silent_to = {}};
        if (item.has("with")) {
            const JsonNode with = item.at("with");
            try {
                for (const auto& [key, value] : parse_method("method:" + one.with).parameters) {
                    check_parameter(with, ends, false, key, value);
                }
            } catch (const InputError& error) {
                with.fail("key=value,… of trocar list", error.what());
            }
        }
        if (one.parameter == source_switch) {
            (void)read_source(item.at("to"));
            if (item.has("from")) (void)read_source(item.at("from"));
        } else {
            check_parameter(item, {part.from}, false, one.parameter, one.to);
            if (ends.size() > 1)
                check_parameter(item, {part.to}, false, one.parameter, one.from.empty() ? one.to : one.from);
        }
        if (ends.size() < 2 && item.has("from"))
            item.at("from").fail("no such key: without 'to' all switches are options");
        if (const auto silent = item.find("silent")) {
            silent->expect_keys({"from", "to"});
            if (silent->has("from")) one.silent_from = silent->at("from").text();
            if (silent->has("to")) one.silent_to = silent->at("to").text();
        }
        if (item.has("scenes")) {
            for (const JsonNode& scene : items_of(item.at("scenes"))) one.scenes.push_back(scene.word(part.scenes));
        }
        part.switches.push_back(std::move(one));
    }
    return part;
}

HardCasesPart read_hard_cases_part(const JsonNode& node, const std::filesystem::path& file) {
    expect_object(node, {"folder", "families", "detectors", "responses", "truth_stride"}, {"folder", "detectors"});
    HardCasesPart part;
    if (node.has("truth_stride")) part.truth_stride = count_of(node.at("truth_stride"));
    part.folder = node.at("folder").text();
    part.cases = read_hard_cases(file.parent_path() / part.folder);
    for (const HardCase& one : part.cases) {
        if (one.scene.empty() || std::filesystem::is_regular_file(one.file.parent_path() / one.scene)) continue;
        node.at("folder").fail("cases whose scenes exist", (one.file.parent_path() / one.scene).string());
    }
    if (node.has("families")) {
        for (const JsonNode& item : items_of(node.at("families"))) {
            part.families.push_back(item.text());
            if (part.families.back().rfind("data:", 0) != 0) item.fail("data:PATH");
        }
    }
    part.detectors = read_methods(node.at("detectors"), true, {});
    if (node.has("responses")) part.responses = read_methods(node.at("responses"), false, {});
    return part;
}

LoopPart read_certificate(const JsonNode& node, const std::filesystem::path& file) {
    expect_object(node, {"scenes", "detectors", "responses", "ticks", "repetitions"}, {"scenes", "detectors"});
    LoopPart part;
    read_counts(node, 2, part);
    if (part.repetitions < 2) {
        node.at("repetitions").fail("at least 2: a fresh process is one of the things asked");
    }
    part.scenes = read_scenes(node.at("scenes"), file);
    part.detectors = read_methods(node.at("detectors"), true, part.scenes);
    if (node.has("responses")) part.responses = read_methods(node.at("responses"), false, part.scenes);
    return part;
}

}  // namespace

Study read_study(const std::filesystem::path& file) {
    const std::string file_name = file.string();
    const Json document = parse_json(read_whole(file, "a study file"), file_name);
    const JsonNode root(document, file_name);
    expect_object(root,
                  {"format", "name", "seed", "repetitions", "time_limit_s", "device", "reference", "ours", "replay",
                   "closed_loop", "triangle_pair", "work_precision", "ablation", "paced", "hard_cases", "certificate"},
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
    study.device = root.has("device") ? read_device_of(root.at("device")) : text_of({});

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
        expect_object(node,
                      {"scenes", "detectors", "responses", "contacts", "steppers", "ticks", "repetitions",
                       "truth_stride", "detail_stride"},
                      {"scenes", "detectors", "responses"});
        ClosedLoopPart part;
        part.scenes = read_scenes(node.at("scenes"), file);
        part.detectors = read_methods(node.at("detectors"), true, part.scenes, {"judged"});
        part.responses = read_methods(node.at("responses"), false, part.scenes, {"detectors", "contacts"});
        if (node.has("contacts")) {
            for (const JsonNode& item : items_of(node.at("contacts"))) {
                const std::string contacts = read_source(item);
                if (std::find(part.contacts.begin(), part.contacts.end(), contacts) != part.contacts.end()) {
                    item.fail("each contact source once", contacts + " again");
                }
                part.contacts.push_back(contacts);
            }
        } else {
            part.contacts = {"canonical"};
        }
        if (node.has("steppers")) part.steppers = read_steppers(node.at("steppers"));
        read_choices(node, part);
        if (node.has("detail_stride")) part.detail_stride = count_of(node.at("detail_stride"));
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
        LoopPart part;
        part.scenes = read_scenes(node.at("scenes"), file);
        part.detectors = read_methods(node.at("detectors"), true, part.scenes);
        part.responses = read_methods(node.at("responses"), false, part.scenes);
        read_counts(node, repetitions, part);
        study.paced = std::move(part);
    }
    if (root.has("hard_cases")) study.hard_cases = read_hard_cases_part(root.at("hard_cases"), file);
    if (root.has("certificate")) study.certificate = read_certificate(root.at("certificate"), file);
    if (!study.replay && !study.closed_loop && !study.triangle_pair && !study.work_precision && !study.ablation &&
        !study.paced && !study.hard_cases && !study.certificate) {
        root.fail(
            "at least one of the keys replay, closed_loop, triangle_pair, work_precision, ablation, paced, hard_cases, "
            "certificate",
            "none of them");
    }
    if (root.has("ours")) {
        study.ours = read_method(root.at("ours"), false).text;
        const auto& part = study.closed_loop;
        if (!part || std::none_of(part->responses.begin(), part->responses.end(),
                                  [&study](const StudyMethod& m) { return m.text == study.ours; })) {
            root.at("ours").fail("one of the closed loop's responses");
        }
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

}  // namespace trocar
