#include "report/sections.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>

namespace trocar {

void add_environment(Draft& draft) {
    draft.heading(2, "Environment");
    Table table;
    table.columns = {{"fact", false}, {"value", false}};
    std::set<std::string> keys;
    for (const Record& record : draft.records) {
        for (const auto& [key, value] : record.environment) {
            const std::string head = key.substr(0, key.find('.'));
            const bool of_one_run = head == "detector" || head == "response" || head == "absent" || head == "run" ||
                                    head == "case" || key == "scene.references";
            if (!of_one_run) keys.insert(key);
        }
    }
    for (const std::string& key : keys) table.rows.push_back({.cells = {key, common_fact(draft.records, key)}});
    table.rows.push_back({.cells = {"processes per method", fmt::format("up to {}", draft.most_processes())}});
    table.rows.push_back(
        {.cells = {"noise floor (factor)",
                   std::isnan(draft.results.noise_floor())
                       ? "not known: one process per method"
                       : scaled(draft.results.noise_floor()) +
                             ": 95 % of the ratios between medians of processes of the same method on the same "
                             "scene (A/A)"}});
    draft.add(std::move(table));
}

namespace {

/// Whether the run turned a knob of its detector or response (kind): then its setting was nobody's choice.
bool is_turned(const RunSpec& spec, const std::string& kind) {
    return spec.mode == "work_precision" && spec.knob.starts_with(kind + ".");
}

}  // namespace

void add_fairness(Draft& draft) {
    draft.heading(2, "Fairness manifest");
    draft.paragraph(
        "Every method of this study with every setting it ran with. Methods run in an order shuffled by the seed, "
        "interleaved, each run in a fresh process, in one thread.");
    std::map<std::pair<std::string, std::string>, const Record*> methods;
    const auto take = [&methods](const Record& record, const std::string& kind, const std::string& text) {
        if (text.empty()) return;
        const Record*& known = methods[{kind, text}];
        // A run that chose the setting says more of it than one that passed by.
        if (known == nullptr || (is_turned(known->spec, kind) && !is_turned(record.spec, kind))) known = &record;
    };
    for (const Record& record : draft.records) {
        take(record, "detector", record.spec.detector);
        take(record, "response", record.spec.response);
    }
    Table table{.caption = "Methods and their settings"};
    using Settings = std::map<std::string, std::vector<std::string>>;  // by default, recommended, tuned
    std::map<std::pair<std::string, std::string>, Settings> by_name;
    for (const auto& [key, record] : methods) {
        const auto fact = [&prefix = key.first, from = record](const char* name) -> const std::string& {
            return fact_of(*from, prefix + "." + name);
        };
        const std::string setting = is_turned(record->spec, key.first) ? "turned by the study"
                                    : fact("setting").empty()          ? "default"
                                                                       : fact("setting");
        by_name[{key.first, method_name(key.second)}][setting].push_back(
            code(key.second) + (fact("basis").empty() ? "" : ": " + fact("basis")));
        table.rows.push_back({});
        add_cell(table, {"kind"}, key.first);
        add_cell(table, {"method"}, code(key.second));
        add_cell(table, {"library"},
                 fact("absent").empty() ? fact("library") + " " + fact("version") : "absent (" + fact("absent") + ")");
        add_cell(table, {"build of the library"}, fact("configuration"));
        add_cell(table, {"all settings in force"}, fact("settings").empty() ? "none declared" : fact("settings"));
        add_cell(table, {"setting"}, setting);
    }
    draft.add(std::move(table));
    Table columns{.caption = "Default, recommended and tuned settings"};
    for (const auto& [key, by_setting] : by_name) {
        const auto add = [&columns, &settings = by_setting](const char* header, const char* name, const char* none) {
            const auto found = settings.find(name);
            add_cell(columns, {header}, found == settings.end() ? none : joined(found->second, "; "));
        };
        columns.rows.push_back({});
        add_cell(columns, {"kind"}, key.first);
        add_cell(columns, {"method"}, code(key.second));
        add("default", "default", "not run");
        add("recommended", "recommended", "not run");
        add("tuned (search and budget)", "tuned", "not tuned");
    }
    draft.add(std::move(columns));
    std::map<std::pair<std::string, std::string>, std::string> reasons;
    for (const Record& record : draft.records) {
        for (const auto& [key, reason] : record.environment) {
            if (!key.starts_with("absent.")) continue;
            const std::size_t dot = key.find('.', 7);
            reasons[{key.substr(7, dot - 7), key.substr(dot + 1)}] = reason;
        }
    }
    Table absent{.caption = "Methods that this build lacks",
                 .columns = {{"kind", false}, {"method", false}, {"reason", false}}};
    for (const auto& [key, reason] : reasons) absent.rows.push_back({.cells = {key.first, code(key.second), reason}});
    if (absent.rows.empty()) draft.paragraph("No method known to this build is absent from it.");
    draft.add(std::move(absent));
}

void add_frames(Draft& draft) {
    const std::vector<std::string> scenes = draft.results.scenes("replay");
    if (scenes.empty()) return;
    draft.heading(2, "Frames");
    Table table{.caption = "Replayed scenes: every detector must have seen the same bits"};
    for (const std::string& scene : scenes) {
        std::set<std::string> hashes;
        std::set<std::string> scene_hashes;
        std::set<std::int64_t> ticks;
        for (const Record& record : draft.records) {
            if (record.spec.scene != scene || record.spec.mode != "replay") continue;
            if (!record.frames_hash.empty() && record.outcome.ok()) hashes.insert(record.frames_hash);
            if (!record.spec.scene_hash.empty()) scene_hashes.insert(record.spec.scene_hash);
            ticks.insert(record.spec.ticks);
        }
        const auto either = [](const auto& values) { return fmt::format("{}", fmt::join(values, " | ")); };
        const std::string& pair_class = draft.results.class_of(scene);
        table.rows.push_back({.style = hashes.size() > 1 ? TableRow::Style::failed : TableRow::Style::normal});
        add_cell(table, {"scene"}, scene);
        add_cell(table, {"class"}, pair_class.empty() ? unknown_text : pair_class);
        add_cell(table, {"ticks", true}, either(ticks));
        add_cell(table, {"scene hash"}, code(either(scene_hashes)));
        add_cell(table, {"frames hash"}, code(either(hashes)));
        add_cell(table, {"same for all detectors and processes"},
                 hashes.empty() ? unknown_text : yes_no(hashes.size() == 1));
    }
    draft.add(std::move(table));
}

}  // namespace trocar
