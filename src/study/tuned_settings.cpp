#include "study/tuned_settings.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <utility>

#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"
#include "study/study_items.hpp"
#include "study/tune.hpp"

namespace trocar {
namespace {

using MethodAndStepper = std::pair<std::string, std::string>;  // an empty stepper is the default one

struct Found {
    std::string setting;
    std::string contacts;
    std::string basis;
};

std::map<MethodAndStepper, Found> read_tuned(const std::filesystem::path& file, const std::string& as_named) {
    const std::string file_name = file.string();
    const Json document = parse_json(read_whole(file, "a file of tuned settings"), file_name);
    const JsonNode root(document, file_name);
    root.at("format").expect_word(tuned_format);
    std::map<MethodAndStepper, Found> all;
    for (const JsonNode& item : items_of(root.at("responses"))) {
        Found found{.setting = item.at("setting").text(), .contacts = item.at("contacts").text(), .basis = as_named};
        all[{item.at("method").text(), item.at("stepper").any_text()}] = std::move(found);
    }
    return all;
}

}  // namespace

void resolve_tuned(Json& study, const std::string& study_file) {
    const Json written = study;
    const JsonNode root(written, study_file);
    if (!root.has("experiments") || !root.at("experiments").is_list()) return;
    std::string as_named;
    std::map<MethodAndStepper, Found> all;
    if (root.has("tuned")) {
        as_named = root.at("tuned").text();
        all = read_tuned(std::filesystem::path(study_file).parent_path() / as_named, as_named);
    }
    const std::vector<JsonNode> experiments = root.at("experiments").list();
    for (std::size_t e = 0; e < experiments.size(); ++e) {
        const auto responses = experiments[e].find("responses");
        if (!responses || !responses->is_list()) continue;
        const std::vector<JsonNode> items = responses->list();
        for (std::size_t i = 0; i < items.size(); ++i) {
            const auto method = items[i].is_text() ? std::nullopt : items[i].find("tuned");
            if (!method) continue;
            if (items[i].has("method")) items[i].fail("either 'method' or 'tuned'");
            if (as_named.empty()) method->fail("a study with the key 'tuned': a file that trocar tune has written");
            std::string stepper;
            if (const auto steppers = items[i].find("steppers")) {
                const std::vector<std::string> named = read_steppers(*steppers);
                if (named.size() != 1) steppers->fail("one stepper beside 'tuned', whose setting is that of a stepper");
                stepper = named.front();
            }
            const auto found = all.find({method->text(), stepper});
            if (found == all.end()) {
                method->fail(fmt::format("a method of {} with {}", as_named,
                                         stepper.empty() ? "the default stepper" : "the stepper " + stepper));
            }
            Json& entry = study["experiments"][e]["responses"][i];
            const bool is_better = found->second.setting != method->text();
            entry["method"] = found->second.setting;
            if (!items[i].has("contacts")) entry["contacts"] = {found->second.contacts};
            if (is_better) entry["setting"] = "tuned";
            entry["basis"] = fmt::format("{} by `trocar tune` on scenes of another seed ({})",
                                         is_better ? "found" : "no better setting found", found->second.basis);
        }
    }
}

}  // namespace trocar
