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
            if (head != "detector" && head != "response" && head != "absent" && head != "run" && head != "case")
                keys.insert(key);
        }
    }
    for (const std::string& key : keys) table.rows.push_back({.cells = {key, common_fact(draft.records, key)}});
    table.rows.push_back({.cells = {"processes per method", fmt::format("up to {}", draft.most_processes())}});
    table.rows.push_back(
        {.cells = {"noise floor (factor)",
                   std::isnan(draft.results.noise_floor())
                       ? "not known: one process per method"
                       : format_number(draft.results.noise_floor()) +
                             ": 95 % of the ratios between medians of processes of the same method on the same "
                             "scene (A/A)"}});
    draft.add(std::move(table));
}

namespace {

/// Whether the run turned a knob of its detector or response (kind): then its setting was nobody's choice.
bool is_turned(const RunSpec& spec, const std::string& kind) {
    return spec.mode == "work_precision" && spec.knob.rfind(kind + ".", 0) == 0;
}

}  // namespace

void add_fairness(Draft& draft) {
    draft.heading(2, "Fairness manifest");
    draft.paragraph(
        "Every method of this study with every setting it ran with. Methods run in an order shuffled by the seed, "
        "interleaved, each run in a fresh process, one thread but for a stepper whose parameters (`threads`, `factor`) "
        "start a second.");
    struct ListedMethod {
        std::string kind;
        std::string text;
        const Record* record = nullptr;
    };
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
    const auto fact = [](const Record& record, const std::string& key) {
        const auto found = record.environment.find(key);
        return found == record.environment.end() ? std::string() : found->second;
    };
    Table table;
    table.caption = "Methods and their settings";
    table.columns = {{"kind", false},
                     {"method", false},
                     {"library", false},
                     {"build of the library", false},
                     {"all settings in force", false},
                     {"setting", false}};
    std::map<std::pair<std::string, std::string>, std::map<std::string, std::vector<std::string>>> by_name;
    for (const auto& [key, record] : methods) {
        const std::string prefix = key.first + ".";
        const std::string absent = fact(*record, prefix + "absent");
        const std::string chosen = fact(*record, prefix + "setting");
        const std::string setting = is_turned(record->spec, key.first) ? "turned by the study"
                                    : chosen.empty()                   ? "default"
                                                                       : chosen;
        const std::string basis = fact(*record, prefix + "basis");
        by_name[{key.first, method_name(key.second)}][setting].push_back(code(key.second) +
                                                                         (basis.empty() ? "" : ": " + basis));
        const std::string library = fact(*record, prefix + "library") + " " + fact(*record, prefix + "version");
        const std::string settings = fact(*record, prefix + "settings");
        table.rows.push_back(
            {.cells = {key.first, code(key.second), absent.empty() ? library : "absent (" + absent + ")",
                       fact(*record, prefix + "configuration"), settings.empty() ? "none declared" : settings,
                       setting}});
    }
    draft.add(std::move(table));
    Table columns;
    columns.caption = "Default, recommended and tuned settings";
    columns.columns = {{"kind", false},
                       {"method", false},
                       {"default", false},
                       {"recommended", false},
                       {"tuned (search and budget)", false}};
    for (const auto& [key, by_setting] : by_name) {
        const auto cell = [&settings = by_setting](const std::string& name, const char* none) {
            const auto found = settings.find(name);
            return found == settings.end() ? std::string(none) : fmt::format("{}", fmt::join(found->second, "; "));
        };
        columns.rows.push_back({.cells = {key.first, code(key.second), cell("default", "not run"),
                                          cell("recommended", "not run"), cell("tuned", "not tuned")}});
    }
    draft.add(std::move(columns));
    Table absent;
    absent.caption = "Methods that this build lacks";
    absent.columns = {{"kind", false}, {"method", false}, {"reason", false}};
    std::map<std::pair<std::string, std::string>, std::string> reasons;
    for (const Record& record : draft.records) {
        for (const auto& [key, reason] : record.environment) {
            if (key.rfind("absent.", 0) != 0) continue;
            const std::size_t dot = key.find('.', 7);
            reasons[{key.substr(7, dot - 7), key.substr(dot + 1)}] = reason;
        }
    }
    for (const auto& [key, reason] : reasons) {
        absent.rows.push_back({.cells = {key.first, code(key.second), reason}});
    }
    if (absent.rows.empty()) draft.paragraph("No method known to this build is absent from it.");
    draft.add(std::move(absent));
}

void add_frames(Draft& draft) {
    const std::vector<std::string> scenes = draft.results.scenes("replay");
    if (scenes.empty()) return;
    draft.heading(2, "Frames");
    Table table;
    table.caption = "Replayed scenes: every detector must have seen the same bits";
    table.columns = {{"scene", false},      {"class", false},       {"ticks", true},
                     {"scene hash", false}, {"frames hash", false}, {"same for all detectors and processes", false}};
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
        table.rows.push_back(
            {.cells = {scene, draft.results.class_of(scene).empty() ? "n/a" : draft.results.class_of(scene),
                       fmt::format("{}", fmt::join(ticks, " | ")),
                       code(fmt::format("{}", fmt::join(scene_hashes, " | "))),
                       code(fmt::format("{}", fmt::join(hashes, " | "))),
                       hashes.empty() ? "n/a" : yes_no(hashes.size() == 1)}});
        if (hashes.size() > 1) table.rows.back().style = TableRow::Style::failed;
    }
    draft.add(std::move(table));
}

}  // namespace trocar
