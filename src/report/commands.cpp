// The command that makes a row's numbers again, found by the method and the scene that the row names.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "report/inline_text.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

/// From the folder that the study's file is named from: "scenes/i2t_poke.json".
std::string scene_path(const Record& record) {
    const std::string& study = fact_of(record, "study.file");
    if (study.empty() || record.spec.scene_file.starts_with("data:")) return record.spec.scene_file;
    return (std::filesystem::path(study).parent_path() / record.spec.scene_file).lexically_normal().string();
}

/// What follows the scene on the command line.
std::string options_of(const RunSpec& spec) {
    std::string text = fmt::format(" --detector {} --response {} --contacts {} --ticks {}", spec.detector,
                                   spec.response, spec.contacts, spec.ticks);
    if (!spec.stepper.empty()) text += " --stepper " + spec.stepper;
    if (!spec.device.empty()) text += " --device " + spec.device;
    return text;
}

bool names_method(const std::string& header) {
    return header.starts_with("detector") || header.starts_with("method") || header.starts_with("response") ||
           header.starts_with("row");
}

}  // namespace

std::string study_command(const std::vector<Record>& records) {
    const std::string file = common_fact(records, "study.file");
    if (file.empty()) return {};
    const std::string changes = common_fact(records, "study.changes");
    return "trocar study " + file + (changes.empty() ? "" : " " + changes);
}

std::string run_command(const Draft& draft, const Method& method, const std::vector<std::string>& scenes) {
    std::vector<std::string> files;
    std::set<std::string> options;
    for (const std::string& scene : scenes) {
        const SceneResult* result = draft.results.find(method, scene);
        if (result == nullptr || result->runs.empty()) continue;
        const Record& record = *result->runs.front().record;
        if (!record.spec.overrides.empty()) return {};
        files.push_back(scene_path(record));
        options.insert(options_of(record.spec));
    }
    if (files.empty() || options.size() != 1) return {};
    if (files.size() == 1) return "trocar run " + files.front() + *options.begin();
    return fmt::format("for scene in {}; do trocar run $scene{}; done", fmt::join(files, " "), *options.begin());
}

std::string run_command(const Draft& draft, const Method& method) {
    return run_command(draft, method, draft.results.scenes(method.mode));
}

void add_commands(Draft& draft) {
    std::map<std::string, Method> by_label;
    for (const Method& method : draft.results.methods("closed_loop")) {
        if (!method.response.empty()) by_label[method.label()] = method;
    }
    const std::vector<std::string> all = draft.results.scenes("closed_loop");
    for (Block& block : draft.document.blocks) {
        auto* table = std::get_if<Table>(&block);
        if (table == nullptr) continue;
        for (TableRow& row : table->rows) {
            if (!row.command.empty()) continue;
            const Method* method = nullptr;
            std::vector<std::string> scenes = all;
            for (std::size_t i = 0; i < std::min(row.cells.size(), table->columns.size()); ++i) {
                const std::string cell = without_code(row.cells[i]);
                const std::string& header = table->columns[i].header;
                if (method == nullptr && names_method(header)) {
                    const auto found = by_label.find(cell.substr(0, cell.find(", moving alike")));
                    if (found != by_label.end()) method = &found->second;
                } else if (header == "scene") {
                    std::erase_if(scenes, [&cell](const std::string& scene) { return scene != cell; });
                }
            }
            if (method != nullptr) row.command = run_command(draft, *method, scenes);
        }
    }
}

}  // namespace trocar
