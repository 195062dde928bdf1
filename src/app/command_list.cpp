// `trocar list`: every method with its parameters, absent ones with the reason. Prints from the registry alone.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "app/commands.hpp"
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

void print_parameters(const std::vector<Parameter>& parameters) {
    for (const Parameter& p : parameters) {
        fmt::print("      {}={}  [{}{}{}]  {}\n", p.name, p.default_value, p.range(),
                   p.unit.empty() || p.unit == "1" ? "" : ", ", p.unit == "1" ? "" : p.unit, p.meaning);
    }
}

template <typename Entry>
void print_section(const char* title, const std::vector<Entry>& present, const std::vector<AbsentMethod>& absent) {
    fmt::print("{}\n", title);
    for (const Entry& entry : present) {
        std::string line = fmt::format("  {:<16} {} {}", entry.name, entry.library, entry.version);
        if constexpr (requires { entry.table_row; }) line += fmt::format("  (Table 2.1: {})", entry.table_row);
        if constexpr (requires { entry.query_distance; })
            line += entry.query_distance ? "  (answers within a query distance)" : "";
        if constexpr (requires { entry.is_default; }) line += entry.is_default ? "  (default)" : "";
        fmt::print("{}\n", line);
        if constexpr (requires { entry.meaning; }) fmt::print("      {}\n", entry.meaning);
        if constexpr (requires { entry.without_tissue; }) {
            for (const std::string& elsewhere : {entry.without_tissue, entry.same_as}) {
                if (!elsewhere.empty()) fmt::print("      {}\n", elsewhere);
            }
        }
        print_parameters(entry.parameters);
    }
    for (const AbsentMethod& entry : absent) fmt::print("  {:<16} absent ({})\n", entry.name, entry.reason);
}

}  // namespace

int list(const CommonOptions& common, const ListOptions& /*options*/) {
    const Registry& all = registry();
    if (!common.json) {
        print_section("Detectors", all.detectors(), all.absent_detectors());
        print_section("Contact generators", all.contact_generators(), {});
        print_section("Responses", all.responses(), all.absent_responses());
        print_section("Steppers", all.steppers(), {});
        fmt::print("Generated scenes (of a study)\n");
        for (const GeneratedSceneEntry& entry : generated_scenes()) {
            fmt::print("  {}\n      {}\n", entry.name, entry.meaning);
            print_parameters(entry.parameters);
        }
        fmt::print("Device (of a run, the same for every response)\n");
        print_parameters(device_parameters());
        return done;
    }
    Json detectors = Json::array();
    Json responses = Json::array();
    for (const DetectorEntry& entry : all.detectors()) detectors.push_back(present_json(entry));
    for (const AbsentMethod& entry : all.absent_detectors()) detectors.push_back(absent_json(entry, true));
    for (const ResponseEntry& entry : all.responses()) responses.push_back(present_json(entry));
    for (const AbsentMethod& entry : all.absent_responses()) responses.push_back(absent_json(entry, false));
    Json contact_generators = Json::array();
    Json steppers = Json::array();
    for (const ContactGeneratorEntry& entry : all.contact_generators())
        contact_generators.push_back(present_json(entry));
    for (const StepperEntry& entry : all.steppers()) steppers.push_back(present_json(entry));
    Json generated = Json::array();
    for (const GeneratedSceneEntry& entry : generated_scenes()) {
        generated.push_back(
            {{"name", entry.name}, {"meaning", entry.meaning}, {"parameters", parameters_json(entry.parameters)}});
    }
    const Json document{{"detectors", detectors},
                        {"responses", responses},
                        {"contact_generators", contact_generators},
                        {"steppers", steppers},
                        {"generated_scenes", generated},
                        {"device", {{"parameters", parameters_json(device_parameters())}}}};
    fmt::print("{}\n", document.dump());
    return done;
}

}  // namespace trocar::app
