// `trocar list`: every method with its parameters, absent ones with the reason. Prints from the registry alone.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "method/device.hpp"
#include "method/registry.hpp"
#include "simulate/generated_scene.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

Json parameters_json(const std::vector<Parameter>& parameters) {
    Json list = Json::array();
    for (const Parameter& p : parameters) {
        list.push_back({{"name", p.name},
                        {"unit", p.unit},
                        {"default", p.default_value},
                        {"range", p.range()},
                        {"meaning", p.meaning}});
    }
    return list;
}

template <typename Entry>
Json present_json(const Entry& entry) {
    Json json{{"name", entry.name},
              {"library", entry.library},
              {"version", entry.version},
              {"available", true},
              {"reason", ""}};
    if constexpr (requires { entry.claims_exact; }) json["claims_exact"] = entry.claims_exact;
    if constexpr (requires { entry.query_distance; }) json["query_distance"] = entry.query_distance;
    if constexpr (requires { entry.control; }) json["control"] = entry.control;
    if constexpr (requires { entry.table_row; }) json["table_row"] = entry.table_row;
    if constexpr (requires { entry.meaning; }) json["meaning"] = entry.meaning;
    if constexpr (requires { entry.wants_query_distance; }) json["wants_query_distance"] = entry.wants_query_distance;
    if constexpr (requires { entry.wants_native; }) json["wants_native"] = entry.wants_native;
    if constexpr (requires { entry.takes_contact_force_laws; }) {
        json["default"] = entry.is_default;
        json["takes_contact_force_laws"] = entry.takes_contact_force_laws;
        json["takes_solved_contacts"] = entry.takes_solved_contacts;
        json["takes_position_corrections"] = entry.takes_position_corrections;
        json["takes_held_forces"] = entry.takes_held_forces;
    }
    if constexpr (requires { entry.without_tissue; }) json["without_tissue"] = entry.without_tissue;
    if constexpr (requires { entry.same_as; }) json["same_as"] = entry.same_as;
    json["parameters"] = parameters_json(entry.parameters);
    return json;
}

Json absent_json(const AbsentMethod& absent, bool detector) {
    Json json{{"name", absent.name}, {"library", ""}, {"version", ""}, {"available", false}, {"reason", absent.reason}};
    if (detector) json["claims_exact"] = false;
    if (detector) json["query_distance"] = false;
    json["parameters"] = Json::array();
    return json;
}

template <typename Entry>
Json section_json(const std::vector<Entry>& present, const std::vector<AbsentMethod>& absent = {}) {
    Json list = Json::array();
    for (const Entry& entry : present) list.push_back(present_json(entry));
    for (const AbsentMethod& entry : absent) {
        list.push_back(absent_json(entry, std::is_same_v<Entry, DetectorEntry>));
    }
    return list;
}

std::string text_in(const Json& json, const char* key) { return json.value(key, std::string()); }

void print_parameters(const Json& parameters) {
    for (const Json& p : parameters) {
        const std::string unit = text_in(p, "unit") == "1" ? "" : text_in(p, "unit");
        fmt::print("      {}={}  [{}{}{}]  {}\n", text_in(p, "name"), text_in(p, "default"), text_in(p, "range"),
                   unit.empty() ? "" : ", ", unit, text_in(p, "meaning"));
    }
}

void print_section(const char* title, const Json& methods) {
    fmt::print("{}\n", title);
    for (const Json& method : methods) {
        if (!method.at("available").get<bool>()) {
            fmt::print("  {:<16} absent ({})\n", text_in(method, "name"), text_in(method, "reason"));
            continue;
        }
        std::string line = fmt::format("  {:<16} {} {}", text_in(method, "name"), text_in(method, "library"),
                                       text_in(method, "version"));
        if (method.contains("table_row")) line += fmt::format("  (Table 2.1: {})", text_in(method, "table_row"));
        if (method.value("query_distance", false)) line += "  (answers within a query distance)";
        if (method.value("default", false)) line += "  (default)";
        fmt::print("{}\n", line);
        for (const char* words : {"meaning", "without_tissue", "same_as"}) {
            if (!text_in(method, words).empty()) fmt::print("      {}\n", text_in(method, words));
        }
        print_parameters(method.at("parameters"));
    }
}

}  // namespace

int list(const CommonOptions& common, const ListOptions& /*options*/) {
    const Registry& all = registry();
    Json generated = Json::array();
    for (const GeneratedSceneEntry& entry : generated_scenes()) {
        generated.push_back(
            {{"name", entry.name}, {"meaning", entry.meaning}, {"parameters", parameters_json(entry.parameters)}});
    }
    const Json document{{"detectors", section_json(all.detectors(), all.absent_detectors())},
                        {"responses", section_json(all.responses(), all.absent_responses())},
                        {"contact_generators", section_json(all.contact_generators())},
                        {"steppers", section_json(all.steppers())},
                        {"generated_scenes", generated},
                        {"device", {{"parameters", parameters_json(device_parameters())}}}};
    if (common.json) {
        print_json_line(document);
        return done;
    }
    print_section("Detectors", document["detectors"]);
    print_section("Contact generators", document["contact_generators"]);
    print_section("Responses", document["responses"]);
    print_section("Steppers", document["steppers"]);
    fmt::print("Generated scenes (of a study)\n");
    for (const Json& scene : generated) {
        fmt::print("  {}\n      {}\n", text_in(scene, "name"), text_in(scene, "meaning"));
        print_parameters(scene["parameters"]);
    }
    fmt::print("Device (of a run, the same for every response)\n");
    print_parameters(document["device"]["parameters"]);
    return done;
}

}  // namespace trocar::app
