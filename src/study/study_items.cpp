#include "study/study_items.hpp"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <map>
#include <set>

#include "geometry/input_error.hpp"
#include "method/device.hpp"
#include "method/registry.hpp"

namespace trocar {
namespace {

/// What `use` makes of the entries of one kind, of those that this build lacks, and of the look-up by name.
auto of_kind(bool is_detector, const auto& use) {
    const Registry& all = registry();
    if (is_detector) {
        return use(all.detectors(), all.absent_detectors(),
                   [&all](const std::string& name) -> const DetectorEntry& { return all.detector(name); });
    }
    return use(all.responses(), all.absent_responses(),
               [&all](const std::string& name) -> const ResponseEntry& { return all.response(name); });
}

/// Checks a method text against the registry; the registry's own complaint is passed on with the place in the file.
Level check_method(const JsonNode& node, bool is_detector) {
    Level method;
    try {
        const MethodSpec spec = parse_method(node.text());
        method.text = spec.text();
        of_kind(is_detector, [&](const auto&, const std::vector<AbsentMethod>& absent, const auto& look_up) {
            for (const AbsentMethod& one : absent) {
                if (one.name == spec.name) method.absent_reason = one.reason;
            }
            if (!method.absent_reason) static_cast<void>(checked_values(look_up(spec.name), spec.parameters));
        });
    } catch (const InputError& error) {
        node.fail("a method of trocar list", error.what());
    }
    return method;
}

/// The entry of `scenes` that the item gives, as path or as bare name.
std::string scene_of(const JsonNode& item, const std::vector<std::string>& scenes) {
    const std::filesystem::path given = item.text();
    const bool as_it_stands = std::find(scenes.begin(), scenes.end(), item.text()) != scenes.end();
    if (!as_it_stands && !given.has_parent_path()) {
        for (const std::string& scene : scenes) {
            if (std::filesystem::path(scene).stem() == given.stem()) return scene;
        }
    }
    return item.word(scenes);
}

}  // namespace

void expect_object(const JsonNode& node, const std::vector<std::string>& known,
                   const std::vector<std::string>& required) {
    node.expect_keys(known);
    for (const std::string& key : required) (void)node.at(key);
}

std::vector<JsonNode> items_of(const JsonNode& node) {
    std::vector<JsonNode> items = node.list();
    if (items.empty()) node.fail("a list that is not empty");
    return items;
}

std::int64_t count_of(const JsonNode& node, std::int64_t least) { return node.integer(least, 1'000'000'000'000); }

Level read_method(const JsonNode& node, bool is_detector, const std::vector<std::string>& inputs,
                  const MoreKeys& more_keys) {
    const bool plain = node.is_text();
    std::vector<std::string> keys{"method", "setting", "basis"};
    if (!inputs.empty()) keys.emplace_back("scenes");
    for (const auto& [key, read] : more_keys) keys.push_back(key);
    if (!plain) expect_object(node, keys, {"method"});
    Level method = check_method(plain ? node : node.at("method"), is_detector);
    if (plain) return method;
    if (node.has("setting")) {
        method.setting = node.at("setting").word({"default", "recommended", "tuned"});
    }
    if (node.has("scenes")) {
        for (const JsonNode& item : items_of(node.at("scenes")))
            method.only["inputs"].push_back(scene_of(item, inputs));
    }
    if (node.has("basis")) method.basis = node.at("basis").text();
    if (method.setting != "default" && method.basis.empty()) {
        node.fail("the key 'basis' (who recommends the setting, or the search and its budget)", "none");
    }
    for (const auto& [key, read] : more_keys) {
        if (node.has(key)) read(node.at(key), method);
    }
    return method;
}

namespace {

bool knows(bool is_detector, const std::string& name) {
    return of_kind(is_detector, [&name](const auto& entries, const auto& absent, const auto&) {
        const auto is_it = [&name](const auto& entry) { return entry.name == name; };
        return std::any_of(entries.begin(), entries.end(), is_it) || std::any_of(absent.begin(), absent.end(), is_it);
    });
}

void add_once(const Level& method, std::vector<Level>& methods) {
    const auto is_it = [&method](const Level& one) { return one.text == method.text; };
    if (std::none_of(methods.begin(), methods.end(), is_it)) methods.push_back(method);
}

}  // namespace

void add_method(const std::string& text, Study& study) {
    const Json value(text);
    const std::string flag = "--with";
    const JsonNode node(value, flag);
    const std::string name = text.substr(0, text.find(':'));
    const bool is_detector = knows(true, name);
    if (!is_detector && !knows(false, name)) {
        const bool was_detector = !replacement_of(NameKind::detector, "", name).empty();
        throw InputError(
            flag, "", "a detector or response of trocar list",
            with_replacement("'" + text + "'", was_detector ? NameKind::detector : NameKind::response, "", name));
    }
    const Level method = read_method(node, is_detector);
    bool taken = false;
    for (Experiment& experiment : study.experiments) {
        const bool compares = !experiment.sweep && experiment.clock == Experiment::Clock::back_to_back &&
                              (experiment.truth_stride > 0 || experiment.perturbed);
        const bool is_loop = experiment.frames == Experiment::Frames::closed_loop;
        const bool of_response =
            is_loop && (experiment.perturbed || experiment.inputs.front().kind != Input::Kind::scene);
        if (!compares || (is_detector ? of_response : !is_loop)) continue;
        add_once(method, is_detector ? experiment.detectors : experiment.responses);
        taken = true;
    }
    if (!taken) {
        throw InputError(
            flag, "",
            is_detector ? "a study with a judged experiment on detectors" : "a study with a judged closed loop",
            study.file.string());
    }
}

std::vector<Level> read_methods(const JsonNode& node, bool is_detector, const std::vector<std::string>& inputs,
                                const MoreKeys& more_keys) {
    std::vector<Level> methods;
    if (node.is_text() && node.text() == "all") {
        of_kind(is_detector, [&methods](const auto& entries, const auto& absent, const auto&) {
            for (const auto& entry : entries) {
                if (!entry.control) methods.push_back({.text = entry.name});
            }
            for (const AbsentMethod& one : absent) {
                methods.push_back({.text = one.name, .absent_reason = one.reason});
            }
        });
        return methods;
    }
    std::set<std::string> seen;
    for (const JsonNode& item : items_of(node)) {
        methods.push_back(read_method(item, is_detector, inputs, more_keys));
        // A search names a method once per stepper, and where it finds nothing better, the method as it comes.
        const bool is_tuned = !item.is_text() && item.has("tuned");
        if (!is_tuned && !seen.insert(methods.back().text).second) {
            item.fail("each method once", methods.back().text + " again");
        }
    }
    return methods;
}

namespace {

/// "." for a study that is named without a folder.
std::filesystem::path folder_of(const SceneFiles& files) {
    const std::filesystem::path folder = files.study.parent_path();
    return folder.empty() ? std::filesystem::path(".") : folder;
}

/// From the study's folder.
std::string path_to(const std::filesystem::path& scene, const SceneFiles& files) {
    return std::filesystem::proximate(scene, folder_of(files)).generic_string();
}

/// Files whose names fit the shell's pattern behind the last slash, by name: those of its folder; of a pattern without
/// a folder that nothing beside the study fits, the shipped scenes.
std::vector<std::string> scenes_like(const JsonNode& item, const SceneFiles& files) {
    const std::filesystem::path pattern = item.text();
    const std::filesystem::path folder = pattern.parent_path();
    const auto fits = [&pattern](const std::string& name) {
        return fnmatch(pattern.filename().c_str(), name.c_str(), FNM_PERIOD) == 0;
    };
    std::vector<std::string> scenes;
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder_of(files) / folder, none)) {
        const std::string name = entry.path().filename().string();
        if (entry.is_regular_file() && fits(name)) scenes.push_back((folder / name).generic_string());
    }
    if (scenes.empty() && folder.empty()) {
        for (const std::filesystem::path& file : files.shipped) {
            if (fits(file.filename().string())) scenes.push_back(path_to(file, files));
        }
    }
    if (scenes.empty()) {
        item.fail("a pattern of scene files, relative to " + files.start + ", or of names that `trocar scenes` lists",
                  "'" + item.text() + "', which none fits");
    }
    std::sort(scenes.begin(), scenes.end());
    return scenes;
}

std::string scene_named(const JsonNode& item, const SceneFiles& files) {
    const std::filesystem::path given = item.text();
    if (std::filesystem::is_regular_file(folder_of(files) / given)) return item.text();
    if (!given.has_parent_path() && (!given.has_extension() || given.extension() == ".json")) {
        for (const std::filesystem::path& file : files.shipped) {
            if (file.stem() == given.stem()) return path_to(file, files);
        }
    }
    item.fail("a scene file, relative to " + files.start + ", or a name that `trocar scenes` lists",
              fmt::format("'{}' (no such file)", item.text()));
}

}  // namespace

std::vector<std::string> read_scenes(const JsonNode& node, const SceneFiles& files) {
    std::vector<std::string> scenes;
    std::set<std::string> seen;
    for (const JsonNode& item : items_of(node)) {
        if (item.text().find_first_of("*?[") != std::string::npos) {
            for (std::string& scene : scenes_like(item, files)) {
                if (seen.insert(scene).second) scenes.push_back(std::move(scene));
            }
            continue;
        }
        scenes.push_back(scene_named(item, files));
        if (!seen.insert(scenes.back()).second) item.fail("each scene once", item.text() + " again");
    }
    return scenes;
}

void check_parameter(const JsonNode& node, const std::vector<Level>& methods, bool is_detector, const std::string& key,
                     const std::string& value) {
    for (const Level& method : methods) {
        if (method.absent_reason) continue;
        const MethodSpec spec = parse_method(with_parameter(method, key, value).text);
        try {
            of_kind(is_detector, [&spec](const auto&, const auto&, const auto& look_up) {
                static_cast<void>(checked_values(look_up(spec.name), spec.parameters));
            });
        } catch (const InputError& error) {
            node.fail("a parameter and value of trocar list", error.what());
        }
    }
}

std::string read_contact_generator(const JsonNode& node) {
    std::vector<std::string> names;
    for (const ContactGeneratorEntry& entry : registry().contact_generators()) names.push_back(entry.name);
    return node.word(names, NameKind::contact_generator);
}

std::vector<std::string> read_contact_generators(const JsonNode& node) {
    std::vector<std::string> generators;
    for (const JsonNode& item : items_of(node)) {
        generators.push_back(read_contact_generator(item));
        if (std::count(generators.begin(), generators.end(), generators.back()) > 1) {
            item.fail("each contact generator once", generators.back() + " again");
        }
    }
    return generators;
}

std::string read_stepper(const JsonNode& node) {
    try {
        return stepper_text(node.text());
    } catch (const InputError& error) {
        node.fail("a stepper of trocar list", error.what());
    }
}

std::vector<std::string> read_steppers(const JsonNode& node) {
    std::vector<std::string> steppers;
    for (const JsonNode& item : items_of(node)) {
        std::string text = read_stepper(item);
        if (std::find(steppers.begin(), steppers.end(), text) != steppers.end()) {
            item.fail("each stepper once", item.text() + " again");
        }
        steppers.push_back(text);
    }
    return steppers;
}

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
    node.with_key_kind(NameKind::parameter).expect_keys(known);
    std::map<std::string, std::string> given;
    for (const std::string& key : node.keys()) {
        const JsonNode value = node.at(key);
        given[key] = value.is_text() ? value.text() : fmt::format("{}", value.number());
        static_cast<void>(read(value, std::map<std::string, std::string>{{key, given[key]}}));
    }
    return text_of(read_device(given));
}

}  // namespace trocar
