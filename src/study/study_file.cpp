// Reading a study file, strictly: every fault is reported with its place in the file.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "method/device.hpp"
#include "scene/json_node.hpp"
#include "simulate/overrides.hpp"
#include "study/study.hpp"
#include "study/study_items.hpp"

namespace trocar {
namespace {

constexpr const char* study_format = "trocar-study-2";

/// What only a closed loop's lists know: which detectors run unjudged, and what each response runs with.
void read_choices(const JsonNode& node, ClosedLoopPart& part) {
    const auto items = [](const JsonNode& list) { return names_all(list) ? std::vector<JsonNode>() : items_of(list); };
    const std::vector<JsonNode> detectors = items(node.at("detectors"));
    for (std::size_t i = 0; i < detectors.size(); ++i) {
        if (!detectors[i].is_text() && detectors[i].has("judged"))
            part.detectors[i].judged = detectors[i].at("judged").flag();
    }
    std::vector<std::string> names;
    for (const StudyMethod& detector : part.detectors) names.push_back(detector.text);
    const std::vector<JsonNode> responses = items(node.at("responses"));
    for (std::size_t i = 0; i < responses.size(); ++i) {
        if (responses[i].is_text()) continue;
        StudyMethod& response = part.responses[i];
        if (const auto chosen = responses[i].find("detectors")) {
            for (const JsonNode& item : items_of(*chosen))
                response.detectors.push_back(item.word(names, NameKind::detector));
        }
        if (const auto chosen = responses[i].find("contacts")) {
            for (const JsonNode& item : items_of(*chosen))
                response.contacts.push_back(item.word(part.contacts, NameKind::contact_generator));
        }
        if (const auto chosen = responses[i].find("steppers")) response.steppers = read_steppers(*chosen);
    }
}

WorkPrecisionPart read_sweeps(const JsonNode& node, const SceneFiles& files, std::int64_t repetitions) {
    expect_object(node, {"sweeps", "ticks", "repetitions", "truth_stride"}, {"sweeps"});
    WorkPrecisionPart part;
    read_counts(node, repetitions, part);
    for (const JsonNode& item : items_of(node.at("sweeps"))) {
        expect_object(item, {"scenes", "detectors", "responses", "contacts", "knob", "values"},
                      {"scenes", "detectors", "knob", "values"});
        WorkPrecisionPart::Sweep sweep;
        sweep.scenes = read_scenes(item.at("scenes"), files);
        sweep.detectors = read_methods(item.at("detectors"), true, sweep.scenes);
        if (item.has("responses")) sweep.responses = read_methods(item.at("responses"), false, sweep.scenes);
        if (item.has("contacts")) sweep.contacts = read_contact_generator(item.at("contacts"));
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

/// Loops that nobody judges: paced, or timed back to back.
LoopPart read_loop(const JsonNode& node, std::int64_t repetitions, const SceneFiles& files) {
    expect_object(node, {"scenes", "detectors", "responses", "steppers", "ticks", "repetitions"},
                  {"scenes", "detectors", "responses"});
    LoopPart part;
    part.scenes = read_scenes(node.at("scenes"), files);
    part.detectors = read_methods(node.at("detectors"), true, part.scenes);
    part.responses = read_methods(node.at("responses"), false, part.scenes);
    if (node.has("steppers")) part.steppers = read_steppers(node.at("steppers"));
    read_counts(node, repetitions, part);
    return part;
}

LoopPart read_metamorphic(const JsonNode& node, const SceneFiles& files) {
    expect_object(node, {"scenes", "detectors", "responses", "ticks", "repetitions"}, {"scenes", "detectors"});
    LoopPart part;
    read_counts(node, 2, part);
    if (part.repetitions < 2) {
        node.at("repetitions").fail("at least 2: a fresh process is one of the things asked");
    }
    part.scenes = read_scenes(node.at("scenes"), files);
    part.detectors = read_methods(node.at("detectors"), true, part.scenes);
    if (node.has("responses")) part.responses = read_methods(node.at("responses"), false, part.scenes);
    return part;
}

}  // namespace

Study read_study(const std::filesystem::path& file, const std::vector<std::string>& with,
                 const std::vector<std::filesystem::path>& shipped) {
    const SceneFiles files{file, shipped};
    const std::string file_name = file.string();
    const Json document = parse_json(read_whole(file, "a study file"), file_name);
    const JsonNode root = JsonNode(document, file_name).with_key_kind(NameKind::study_key);
    expect_object(root,
                  {"format", "name", "seed", "repetitions", "time_limit_s", "device", "reference", "ours", "quotes",
                   "replay", "closed_loop", "work_precision", "paced", "cost_by_size", "hard_cases", "metamorphic"},
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
    if (root.has("quotes")) study.quotes = root.at("quotes").text();
    study.device = root.has("device") ? read_device_of(root.at("device")) : text_of({});

    if (root.has("replay")) {
        const JsonNode node = root.at("replay");
        expect_object(node, {"scenes", "detectors", "ticks", "repetitions", "truth_stride", "between_ticks"},
                      {"scenes", "detectors"});
        ReplayPart part;
        part.scenes = read_scenes(node.at("scenes"), files);
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
        part.scenes = read_scenes(node.at("scenes"), files);
        part.detectors = read_methods(node.at("detectors"), true, part.scenes, {"judged"});
        part.responses = read_methods(node.at("responses"), false, part.scenes, {"detectors", "contacts", "steppers"});
        if (node.has("contacts")) {
            for (const JsonNode& item : items_of(node.at("contacts"))) {
                const std::string contacts = read_contact_generator(item);
                if (std::find(part.contacts.begin(), part.contacts.end(), contacts) != part.contacts.end()) {
                    item.fail("each contact generator once", contacts + " again");
                }
                part.contacts.push_back(contacts);
            }
        } else {
            part.contacts = {"tracked_proximity"};
            for (StudyMethod& response : part.responses) serve(part.contacts, response);
        }
        if (node.has("steppers")) part.steppers = read_steppers(node.at("steppers"));
        read_choices(node, part);
        if (node.has("detail_stride")) part.detail_stride = count_of(node.at("detail_stride"));
        read_counts(node, repetitions, part);
        study.closed_loop = std::move(part);
    }
    if (root.has("work_precision")) study.work_precision = read_sweeps(root.at("work_precision"), files, repetitions);
    if (root.has("paced")) study.paced = read_loop(root.at("paced"), repetitions, files);
    if (root.has("cost_by_size")) study.cost_by_size = read_loop(root.at("cost_by_size"), repetitions, files);
    if (root.has("hard_cases")) study.hard_cases = read_hard_cases_part(root.at("hard_cases"), file);
    if (root.has("metamorphic")) study.metamorphic = read_metamorphic(root.at("metamorphic"), files);
    if (!study.replay && !study.closed_loop && !study.work_precision && !study.paced && !study.cost_by_size &&
        !study.hard_cases && !study.metamorphic) {
        root.fail(
            "at least one of the keys replay, closed_loop, work_precision, paced, cost_by_size, "
            "hard_cases, metamorphic",
            "none of them");
    }
    for (const std::string& method : with) add_method(method, study);
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
        if (!named(study.replay) && !named(study.closed_loop) && !named(study.paced)) {
            root.at("reference").fail("one of the study's detectors");
        }
    }
    return study;
}

std::vector<std::string> reference_notes(const Study& study) {
    std::vector<std::string> notes;
    const auto search = [&](const auto& part, const char* name) {
        if (!part) return;
        const auto found = std::find_if(part->detectors.begin(), part->detectors.end(),
                                        [&study](const StudyMethod& one) { return one.text == study.reference; });
        const std::string what = found == part->detectors.end() ? "is not among the detectors"
                                 : found->absent_reason ? "is absent from this build (" + *found->absent_reason + ")"
                                 : !found->scenes.empty() && found->scenes.size() < part->scenes.size()
                                     ? "runs on some scenes only"
                                     : "";
        if (what.empty()) return;
        notes.push_back(fmt::format("{}: {}, which times are set against, {}: no ratios {}", name, study.reference,
                                    what, what.starts_with("runs") ? "on the others" : "there"));
    };
    if (study.reference.empty()) return notes;
    search(study.replay, "replay");
    if (!study.replay) search(study.closed_loop, "closed_loop");
    return notes;
}

}  // namespace trocar
