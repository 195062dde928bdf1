// Facts of scenes and methods that a plan and a record keep, so that a report needs nothing else.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "method/registry.hpp"
#include "reference/reference.hpp"
#include "simulate/resolution.hpp"
#include "study/study.hpp"

namespace trocar {
namespace {

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
void add_entry_facts(const std::string& prefix, const Entry& entry, const Level& method,
                     std::map<std::string, std::string>& facts) {
    facts[prefix + "library"] = entry.library;
    facts[prefix + "version"] = entry.version;
    facts[prefix + "configuration"] = entry.configuration;
    facts[prefix + "own"] = entry.own ? "yes" : "no";
    if (entry.control) facts[prefix + "control"] = "yes";
    facts[prefix + "settings"] = settings_text(entry.parameters, parse_method(method.text).parameters, entry.name);
}

void add_method_facts(const std::string& prefix, const Level& method, std::map<std::string, std::string>& facts) {
    facts[prefix + "setting"] = method.setting;
    facts[prefix + "basis"] = method.basis;
    if (!method.reading_of.empty()) facts[prefix + "reading_of"] = method.reading_of;
    if (method.absent_reason) facts[prefix + "absent"] = *method.absent_reason;
}

}  // namespace

SceneFacts facts_of(const Scene& scene) {
    SceneFacts facts;
    facts.name = scene.name;
    facts.hash = fmt::format("{:016x}", scene.hash);
    if (!scene.file.empty()) facts.references = hash_of_references(scene.file);
    facts.ticks = scene.ticks;
    facts.dt = scene.dt;
    facts.triangles = scene.topology.triangle_count();
    facts.bodies = scene.topology.body_count();
    facts.has_resolution_window = has_resolution_window(scene);
    facts.motions = std::count_if(scene.bodies.begin(), scene.bodies.end(),
                                  [](const SceneBody& body) { return body.motion.has_value(); });
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

std::map<std::string, std::string> method_facts(const Study& study, const PlannedRun& run) {
    std::map<std::string, std::string> facts = run.facts;
    const bool outside = study.file.is_absolute() || study.file.generic_string().rfind("..", 0) == 0;
    facts["study.file"] = (outside ? study.file.filename() : study.file).generic_string();
    if (!study.changes.empty()) facts["study.changes"] = study.changes;
    facts["study.device"] = study.device;
    facts["study.reference"] = study.reference;
    if (!study.ours.empty()) facts["study.ours"] = study.ours;
    if (!study.quotes.empty()) facts["study.quotes"] = study.quotes;
    if (!study.quoted_reports.empty())
        facts["study.quoted_reports"] = fmt::format("{}", fmt::join(study.quoted_reports, ","));
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
            if (!entry.without_tissue.empty()) facts["response.without_tissue"] = entry.without_tissue;
        }
    }
    return facts;
}

}  // namespace trocar
