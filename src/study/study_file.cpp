// Reading a study file, strictly: every fault is reported with its place in the file.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "method/device.hpp"
#include "method/registry.hpp"
#include "scene/json_node.hpp"
#include "simulate/generated_scene.hpp"
#include "simulate/hard_case.hpp"
#include "simulate/overrides.hpp"
#include "study/study.hpp"
#include "study/study_items.hpp"
#include "study/tuned_settings.hpp"

namespace trocar {
namespace {

constexpr const char* study_format = "trocar-study-3";

constexpr auto replay = Experiment::Frames::replay;
constexpr auto closed_loop = Experiment::Frames::closed_loop;

/// What a response runs with instead of the experiment's lists.
MoreKeys choices_of_response(const Experiment& experiment) {
    std::vector<std::string> detectors;
    for (const Level& detector : experiment.detectors) detectors.push_back(detector.text);
    return {
        {"detectors",
         [detectors](const JsonNode& node, Level& response) {
             for (const JsonNode& item : items_of(node))
                 response.only["detectors"].push_back(item.word(detectors, NameKind::detector));
         }},
        {"contacts",
         [](const JsonNode& node, Level& response) { response.only["contacts"] = read_contact_generators(node); }},
        {"steppers", [](const JsonNode& node, Level& response) { response.only["steppers"] = read_steppers(node); }},
        {"tuned", [](const JsonNode&, Level&) {}},  // resolve_tuned has read it
        {"reading_of", [](const JsonNode& node, Level& response) {
             if (response.setting != "default") node.fail("no 'setting' beside it", response.setting);
             response.reading_of = node.text();
             response.setting = "reading";
         }}};
}

/// The twin, or the text of a stepper, whatever the default is.
std::string read_against(const JsonNode& node, const Experiment& experiment) {
    for (const Input& input : experiment.inputs) {
        if (input.kind != Input::Kind::scene) node.fail("nothing to run against on cases", node.text());
    }
    if (node.text() == twin) return twin;
    const std::string text = read_stepper(node);
    return text.empty() ? registry().default_stepper().name : text;
}

Sweep read_sweep(const JsonNode& node, const Experiment& experiment) {
    expect_object(node, {"knob", "values"}, {"knob", "values"});
    Sweep sweep;
    const JsonNode knob = node.at("knob");
    sweep.knob = knob.text();
    const bool of_detector = sweep.knob.rfind("detector.", 0) == 0;
    const bool of_response = sweep.knob.rfind("response.", 0) == 0;
    const auto& knobs = scene_knobs();
    const bool of_scene =
        std::any_of(knobs.begin(), knobs.end(), [&sweep](const SceneKnob& one) { return one.name == sweep.knob; });
    if (!of_detector && !of_response && !of_scene) {
        knob.fail("dt, k, substeps, detector.KEY or response.KEY", "'" + sweep.knob + "'");
    }
    if (!of_detector && experiment.frames == replay) {
        knob.fail("detector.KEY in a replay: this knob acts in the closed loop only", "'" + sweep.knob + "'");
    }
    for (const JsonNode& value : items_of(node.at("values"))) {
        sweep.values.push_back(value.is_text() ? value.text() : fmt::format("{}", value.number()));
        const std::string& text = sweep.values.back();
        const std::string key = sweep.knob.substr(sweep.knob.find('.') + 1);
        if (of_detector) check_parameter(value, experiment.detectors, true, key, text);
        if (of_response) check_parameter(value, experiment.responses, false, key, text);
        if (!of_scene) continue;
        try {
            (void)override_value(sweep.knob + "=" + text, sweep.knob);
        } catch (const InputError& error) {
            value.fail("a value of the knob " + sweep.knob, error.what());
        }
    }
    return sweep;
}

/// What the record keeps of a case, so that the report needs no other file.
std::map<std::string, std::string> facts_of(const HardCase& hard_case) {
    std::map<std::string, std::string> facts{{"case.of", hard_case.of},
                                             {"case.reason", hard_case.reason},
                                             {"case.outcome", std::string(name_of(hard_case.outcome))}};
    if (hard_case.pairs) {
        facts["case.expected"] = fmt::format("{} {}, {} touching", hard_case.pairs->size(),
                                             hard_case.pairs->size() == 1 ? "pair" : "pairs", hard_case.touch.size());
    }
    for (const auto& [figure, most] : hard_case.at_most) facts["case.at_most." + figure] = fmt::format("{}", most);
    return facts;
}

/// Cases of the folder that fit the experiment: meshes for a replay, scenes for a closed loop.
void add_cases(const JsonNode& node, const std::filesystem::path& study, Experiment& experiment) {
    const std::filesystem::path folder = node.text();
    if (!std::filesystem::is_directory(study.parent_path() / folder)) node.fail("a folder of cases");
    for (const HardCase& one : read_hard_cases(study.parent_path() / folder)) {
        if (one.pairs.has_value() != (experiment.frames == replay)) continue;
        Input input;
        input.name = one.name;
        input.facts = facts_of(one);
        if (one.pairs) {
            input.kind = Input::Kind::mesh_case;
            input.file = (folder / one.name / "expected.json").generic_string();
            input.ticks = 1;
        } else {
            if (!std::filesystem::is_regular_file(one.file.parent_path() / one.scene)) {
                node.fail("cases whose scenes exist", (one.file.parent_path() / one.scene).string());
            }
            input.kind = Input::Kind::scene_case;
            input.file = (folder / one.name / one.scene).lexically_normal().generic_string();
            input.ticks = one.ticks;
        }
        experiment.inputs.push_back(std::move(input));
    }
}

void add_pair_files(const JsonNode& node, Experiment& experiment) {
    for (const JsonNode& item : items_of(node)) {
        const std::string file = item.text();
        if (file.rfind("data:", 0) != 0) item.fail("data:PATH");
        experiment.inputs.push_back({.kind = Input::Kind::pair_file,
                                     .file = file,
                                     .name = std::filesystem::path(file).stem().string(),
                                     .ticks = 1});
    }
}

void add_generated_scenes(const JsonNode& node, Experiment& experiment) {
    for (const JsonNode& item : items_of(node)) {
        Input input{.kind = Input::Kind::generated};
        try {
            const GeneratedSceneFacts facts = generated_scene_facts(item.text());
            input.file = "generated:" + facts.text;
            input.name = facts.name;
            input.triangles = facts.triangles;
        } catch (const InputError& error) {
            item.fail("a generated scene of trocar list", error.what());
        }
        for (const Input& other : experiment.inputs) {
            if (other.name == input.name) item.fail("each scene once", item.text() + " again");
        }
        experiment.inputs.push_back(std::move(input));
    }
}

void add_external(const JsonNode& node, Experiment& experiment) {
    expect_object(node, {"format", "files", "source", "licence", "reference"},
                  {"format", "files", "source", "licence"});
    const std::string format = node.at("format").word(external_formats);
    for (const JsonNode& item : items_of(node.at("files"))) {
        constexpr std::string_view prefix = "data:";
        const std::string file = item.text();
        if (!file.starts_with(prefix)) item.fail("data:PATH");
        const std::string path = file.substr(prefix.size());
        experiment.inputs.push_back({.kind = Input::Kind::external,
                                     .file = external_file(format, path),
                                     .name = external_name(path),
                                     .facts = {{"case.format", format},
                                               {"case.path", path},
                                               {"case.source", node.at("source").text()},
                                               {"case.licence", node.at("licence").text()}}});
        if (node.has("reference")) {
            experiment.inputs.back().facts["case.reference"] = read_method(node.at("reference"), true).text;
        }
    }
}

void read_inputs(const JsonNode& node, const SceneFiles& files, Experiment& experiment) {
    if (node.has("scenes")) {
        for (const std::string& scene : read_scenes(node.at("scenes"), files)) {
            experiment.inputs.push_back({.kind = Input::Kind::scene, .file = scene});
        }
    }
    if (node.has("cases")) add_cases(node.at("cases"), files.study, experiment);
    if (node.has("pair_files")) add_pair_files(node.at("pair_files"), experiment);
    if (node.has("generated")) {
        // Frames of other inputs follow one another, so that detectors cannot take turns on them.
        if (!experiment.inputs.empty()) node.at("generated").fail("generated scenes alone", "other inputs beside them");
        add_generated_scenes(node.at("generated"), experiment);
    }
    if (node.has("external")) {
        if (!experiment.inputs.empty()) node.at("external").fail("external data alone", "other inputs beside them");
        add_external(node.at("external"), experiment);
    }
    if (experiment.inputs.empty()) {
        node.fail("inputs: one of the keys scenes, cases, pair_files, generated, external", "none");
    }
}

/// Keys that have a meaning beside the frames, the clock and the perturbations that the experiment names.
std::vector<std::string> keys_of(const Experiment& experiment) {
    std::vector<std::string> keys{"frames", "clock", "perturbed", "scenes", "detectors", "ticks", "repetitions"};
    const auto add = [&keys](std::initializer_list<const char*> more) {
        keys.insert(keys.end(), more.begin(), more.end());
    };
    const bool paced = experiment.clock == Experiment::Clock::paced;
    if (experiment.frames == closed_loop) add({"responses", "contacts", "steppers"});
    if (paced) add({"dither"});
    if (paced || experiment.perturbed) return keys;
    add({"cases", "sweep", "truth_stride"});
    if (experiment.frames == replay)
        add({"pair_files", "between_ticks", "generated", "external", "contacts", "cycles"});
    if (experiment.frames == closed_loop) add({"detail_stride", "against"});
    return keys;
}

/// True when a method of that text is among the experiment's detectors or responses.
bool names(const std::vector<Level>& levels, const std::string& text) {
    return std::any_of(levels.begin(), levels.end(), [&text](const Level& one) { return one.text == text; });
}

Experiment read_experiment(const JsonNode& node, const SceneFiles& files, std::int64_t repetitions) {
    Experiment experiment;
    const std::string frames = node.at("frames").word({"replay", "closed_loop"});
    if (frames == "closed_loop") experiment.frames = closed_loop;
    if (node.has("perturbed")) experiment.perturbed = node.at("perturbed").flag();
    const bool generated = node.has("generated");
    const bool paced = node.has("clock") && node.at("clock").word({"back_to_back", "paced"}) == "paced";
    if (paced) experiment.clock = Experiment::Clock::paced;
    if (paced && experiment.frames == replay) node.at("clock").fail("back_to_back: a replay is not paced");
    if (paced && experiment.perturbed) node.at("clock").fail("back_to_back: perturbed runs are not paced");
    expect_object(node, keys_of(experiment), {"detectors"});

    read_inputs(node, files, experiment);
    std::vector<std::string> inputs;
    for (const Input& input : experiment.inputs) inputs.push_back(input.file);
    const bool is_loop = experiment.frames == closed_loop;
    MoreKeys of_detector;
    if (is_loop) of_detector["judged"] = [](const JsonNode& value, Level& one) { one.judged = value.flag(); };
    if (generated) {
        of_detector["most_triangles"] = [](const JsonNode& value, Level& one) { one.most_triangles = count_of(value); };
    }
    experiment.detectors = read_methods(node.at("detectors"), true, inputs, of_detector);
    if (is_loop) {
        experiment.responses = read_methods(node.at("responses"), false, inputs, choices_of_response(experiment));
    }
    if (!is_loop && !generated && node.has("contacts")) {
        node.at("contacts").fail("no contact generators in a replay, but on generated scenes", "a list");
    }
    if (generated) {
        for (const char* key : {"cycles", "truth_stride", "between_ticks", "repetitions"}) {
            if (node.has(key)) node.at(key).fail("a key of scenes that are no generated ones", key);
        }
    }
    if (node.has("external")) {
        for (const char* key : {"cycles", "truth_stride", "between_ticks", "repetitions", "sweep"}) {
            if (node.has(key)) node.at(key).fail("no such key beside external data", key);
        }
        if (const auto reference = node.at("external").find("reference");
            reference && !names(experiment.detectors, read_method(*reference, true).text)) {
            reference->fail("one of the experiment's detectors");
        }
    }
    if (node.has("dither")) experiment.dither = node.at("dither").positive();
    if (node.has("cycles")) experiment.cycles = node.at("cycles").integer(1, 1000);
    if (node.has("contacts")) experiment.contacts = read_contact_generators(node.at("contacts"));
    if (node.has("against")) experiment.against = read_against(node.at("against"), experiment);
    if (node.has("steppers")) experiment.steppers = read_steppers(node.at("steppers"));
    if (node.has("sweep")) experiment.sweep = read_sweep(node.at("sweep"), experiment);
    if (node.has("ticks")) experiment.ticks = count_of(node.at("ticks"));
    if (node.has("truth_stride")) experiment.truth_stride = count_of(node.at("truth_stride"), 0);
    if (node.has("detail_stride")) experiment.detail_stride = count_of(node.at("detail_stride"));
    if (node.has("between_ticks")) experiment.between_ticks = node.at("between_ticks").flag();
    experiment.repetitions = experiment.perturbed ? 2 : repetitions;
    if (node.has("repetitions")) experiment.repetitions = count_of(node.at("repetitions"));
    if (experiment.against == twin && experiment.truth_stride != 1) {
        node.at("truth_stride")
            .fail("1: against a twin every tick is judged", fmt::format("{}", experiment.truth_stride));
    }
    if (experiment.perturbed && experiment.repetitions < 2) {
        node.at("repetitions").fail("at least 2: a fresh process is one of the perturbations");
    }
    return experiment;
}

/// Puts `scenes` in place of every list of scenes. They are paths and patterns from the working directory, or names as
/// in a study. A method's own choice among the former scenes is void.
void replace_scenes(const std::vector<std::string>& scenes, const std::vector<std::filesystem::path>& shipped,
                    Json& study) {
    const Json given = scenes;
    const std::string flag = "--scenes";
    Json list = Json::array();
    for (const std::string& file : read_scenes(JsonNode(given, flag), {"", shipped, "the working directory"})) {
        list.push_back(std::filesystem::absolute(file).lexically_normal().string());
    }
    bool taken = false;
    if (!study.contains("experiments") || !study["experiments"].is_array()) return;
    for (Json& experiment : study["experiments"]) {
        if (!experiment.is_object() || !experiment.contains("scenes")) continue;
        experiment["scenes"] = list;
        taken = true;
        for (const char* methods : {"detectors", "responses"}) {
            if (!experiment.contains(methods) || !experiment[methods].is_array()) continue;
            for (Json& method : experiment[methods]) {
                if (method.is_object()) method.erase("scenes");
            }
        }
    }
    if (!taken) throw InputError(flag, "", "a study with scenes", "one without");
}

/// A text that names a folder.
std::string folder_name(const JsonNode& node) {
    std::string name = node.text();
    if (name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") !=
        std::string::npos) {
        node.fail("a name of letters, digits, _ and - (it names a folder)");
    }
    return name;
}

void read_quotes(const JsonNode& list, Study& study) {
    for (const JsonNode& item : items_of(list)) {
        if (item.is_text()) {
            study.quotes += (study.quotes.empty() ? "" : " ") + item.text();
            continue;
        }
        expect_object(item, {"report"}, {"report"});
        study.quoted_reports.push_back(folder_name(item.at("report")));
    }
}

}  // namespace

Study read_study(const std::filesystem::path& file, const std::vector<std::string>& with,
                 const std::vector<std::filesystem::path>& shipped, const std::vector<std::string>& scenes) {
    const SceneFiles files{file, shipped};
    const std::string file_name = file.string();
    Json document = parse_json(read_whole(file, "a study file"), file_name);
    resolve_tuned(document, file_name);
    if (!scenes.empty()) replace_scenes(scenes, shipped, document);
    const JsonNode root = JsonNode(document, file_name).with_key_kind(NameKind::study_key);
    expect_object(root,
                  {"format", "name", "seed", "repetitions", "time_limit_s", "device", "reference", "ours", "quotes",
                   "tuned", "experiments"},
                  {"format", "name", "experiments"});
    root.at("format").expect_word(study_format);

    Study study;
    study.file = file;
    study.name = folder_name(root.at("name"));
    if (root.has("seed")) study.seed = root.at("seed").unsigned_integer();
    const std::int64_t repetitions = root.has("repetitions") ? count_of(root.at("repetitions")) : 1;
    if (root.has("time_limit_s")) study.time_limit_s = root.at("time_limit_s").positive();
    if (root.has("quotes")) read_quotes(root.at("quotes"), study);
    study.device = root.has("device") ? read_device_of(root.at("device")) : text_of(TipSettings{});

    for (const JsonNode& item : items_of(root.at("experiments"))) {
        study.experiments.push_back(read_experiment(item, files, repetitions));
    }
    for (const std::string& method : with) add_method(method, study);
    const auto is_named = [&study](const std::string& text, std::vector<Level> Experiment::*levels) {
        return std::any_of(study.experiments.begin(), study.experiments.end(),
                           [&](const Experiment& one) { return names(one.*levels, text); });
    };
    for (const Experiment& experiment : study.experiments) {
        for (const Level& response : experiment.responses) {
            if (response.reading_of.empty()) continue;
            const bool stands = std::any_of(study.experiments.begin(), study.experiments.end(), [&](const auto& any) {
                return std::any_of(any.responses.begin(), any.responses.end(), [&response](const Level& one) {
                    return one.text == response.reading_of && one.reading_of.empty();
                });
            });
            if (!stands)
                root.at("experiments").fail("as reading_of a response of the study that is none", response.reading_of);
        }
    }
    if (root.has("ours")) {
        study.ours = read_method(root.at("ours"), false).text;
        if (!is_named(study.ours, &Experiment::responses)) root.at("ours").fail("one of the study's responses");
    }
    if (root.has("reference")) {
        study.reference = read_method(root.at("reference"), true).text;
        if (!is_named(study.reference, &Experiment::detectors))
            root.at("reference").fail("one of the study's detectors");
    }
    return study;
}

std::vector<std::string> reference_notes(const Study& study) {
    std::vector<std::string> notes;
    if (study.reference.empty()) return notes;
    const bool any_replay = std::any_of(study.experiments.begin(), study.experiments.end(),
                                        [](const Experiment& one) { return one.frames == replay; });
    std::int64_t number = -1;
    for (const Experiment& experiment : study.experiments) {
        ++number;
        // Ratios of times are taken on replays, else on judged closed loops.
        if (experiment.sweep || experiment.perturbed || experiment.cycles > 0 || experiment.truth_stride == 0) continue;
        const Input::Kind kind = experiment.inputs.front().kind;
        if (experiment.clock == Experiment::Clock::paced ||
            (kind != Input::Kind::scene && kind != Input::Kind::generated))
            continue;
        if (any_replay != (experiment.frames == replay)) continue;
        const auto found = std::find_if(experiment.detectors.begin(), experiment.detectors.end(),
                                        [&study](const Level& one) { return one.text == study.reference; });
        std::string what;
        if (found == experiment.detectors.end()) {
            what = "is not among the detectors";
        } else if (found->absent_reason) {
            what = "is absent from this build (" + *found->absent_reason + ")";
        } else if (found->only.contains("inputs") && found->only.at("inputs").size() < experiment.inputs.size()) {
            what = "runs on some scenes only";
        }
        if (what.empty()) continue;
        notes.push_back(fmt::format("/experiments/{}: {}, which times are set against, {}: no ratios {}", number,
                                    study.reference, what, what.starts_with("runs") ? "on the others" : "there"));
    }
    return notes;
}

}  // namespace trocar
