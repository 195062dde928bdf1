#include "study/tuned_settings.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <optional>
#include <utility>
#include <vector>

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
};

struct TunedFile {
    std::map<MethodAndStepper, Found> responses;
    std::string search;  ///< in words: its name, seed, budget and file
};

TunedFile read_tuned(const std::filesystem::path& file) {
    const std::string file_name = file.string();
    const Json document = parse_json(read_whole(file, "a file of tuned settings"), file_name);
    const JsonNode root(document, file_name);
    root.at("format").expect_word(tuned_format);
    const JsonNode budget = root.at("budget");
    TunedFile tuned;
    tuned.search =
        fmt::format("`trocar tune`: search {} of seed {}, {} + {} + {} settings from each of {} starts ({})",
                    root.at("tune").text(), root.at("seed").unsigned_integer(), count_of(budget.at("first")),
                    count_of(budget.at("second")), count_of(budget.at("local")), tune_starts, file.filename().string());
    for (const JsonNode& item : items_of(root.at("responses"))) {
        (void)read_method(item.at("setting"), false);
        tuned.responses[{item.at("method").text(), item.at("stepper").any_text()}] = {
            .setting = item.at("setting").text(), .contacts = read_contact_generator(item.at("contacts"))};
    }
    return tuned;
}

/// The stepper of the search: the one that the response runs with, its own or the experiment's, if no other is named.
std::string stepper_of(const JsonNode& response, const JsonNode& experiment) {
    if (const auto named = response.find("searched_with")) return named->text();
    std::optional<JsonNode> steppers = response.find("steppers");
    if (!steppers) steppers = experiment.find("steppers");
    if (!steppers) return "";
    const std::vector<std::string> named = read_steppers(*steppers);
    if (named.size() != 1) steppers->fail("one stepper for 'tuned', or the key 'searched_with' beside it");
    return named.front();
}

}  // namespace

void resolve_tuned(Json& study, const std::string& study_file) {
    const Json written = study;
    const JsonNode root(written, study_file);
    std::optional<TunedFile> tuned;
    if (root.has("tuned"))
        tuned = read_tuned(std::filesystem::path(study_file).parent_path() / root.at("tuned").text());
    const auto experiments = root.find("experiments");
    if (!experiments || !experiments->is_list()) return;
    const std::vector<JsonNode> all = experiments->list();
    for (std::size_t e = 0; e < all.size(); ++e) {
        const auto responses = all[e].find("responses");
        if (!responses || !responses->is_list()) continue;
        const std::vector<JsonNode> items = responses->list();
        for (std::size_t i = 0; i < items.size(); ++i) {
            const auto method = items[i].is_text() ? std::nullopt : items[i].find("tuned");
            if (!method) continue;
            for (const char* key : {"method", "setting", "basis", "reading_of"}) {
                if (items[i].has(key)) items[i].at(key).fail("no such key beside 'tuned', which stands for it", key);
            }
            if (!tuned) method->fail("a study with the key 'tuned': a file that trocar tune has written");
            const std::string stepper = stepper_of(items[i], all[e]);
            const auto found = tuned->responses.find({method->text(), stepper});
            if (found == tuned->responses.end()) {
                method->fail("a method of the file of tuned settings with " +
                             (stepper.empty() ? "the default stepper" : "the stepper " + stepper));
            }
            Json& entry = study["experiments"][e]["responses"][i];
            const bool is_better = found->second.setting != method->text();
            entry["method"] = found->second.setting;
            if (!items[i].has("contacts")) entry["contacts"] = {found->second.contacts};
            if (is_better) entry["setting"] = "tuned";
            std::string basis = (is_better ? "" : "nothing better was found by ") + tuned->search;
            if (items[i].has("searched_with")) basis += fmt::format(", searched with the stepper `{}`", stepper);
            entry["basis"] = basis;
            entry.erase("searched_with");
        }
    }
}

}  // namespace trocar
