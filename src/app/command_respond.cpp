// `trocar respond`: contact laws on a file of cases (DESIGN §10), held against expected values where the file has them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "app/respond_laws.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

Json read_json(const std::filesystem::path& file) {
    return parse_ordered_json(read_whole(file, "a file of cases"), file.string());
}

bool is_number_list(const Json& json) {
    if (!json.is_array() || json.empty()) return false;
    for (const Json& entry : json) {
        if (!entry.is_number()) return false;
    }
    return true;
}

struct Tolerance {
    double rel = 1e-12;
    double abs = 1e-15;
};

/// The data's rule: pass when max(abs(got - want)) <= abs + rel * max(abs(want)), the maxima over one vector.
bool equal(const Json& want, const Json& got, const Tolerance& tolerance) {
    if (want.is_number() && got.is_number()) {
        const double w = want.get<double>();
        return std::abs(got.get<double>() - w) <= tolerance.abs + tolerance.rel * std::abs(w);
    }
    if (is_number_list(want) && is_number_list(got)) {
        if (want.size() != got.size()) return false;
        double difference = 0.0;
        double size = 0.0;
        for (std::size_t i = 0; i < want.size(); ++i) {
            const double w = want[i].get<double>();
            const double error = std::abs(got[i].get<double>() - w);
            if (!(error <= std::numeric_limits<double>::max())) return false;
            difference = std::max(difference, error);
            size = std::max(size, std::abs(w));
        }
        return difference <= tolerance.abs + tolerance.rel * size;
    }
    if (want.is_array() && got.is_array()) {
        if (want.size() != got.size()) return false;
        for (std::size_t i = 0; i < want.size(); ++i) {
            if (!equal(want[i], got[i], tolerance)) return false;
        }
        return true;
    }
    if (want.is_object() && got.is_object()) {
        for (const auto& [key, value] : want.items()) {
            if (!got.contains(key) || !equal(value, got[key], tolerance)) return false;
        }
        return true;
    }
    return want == got;
}

bool is_finite(const Json& json) {
    if (json.is_structured()) return std::all_of(json.begin(), json.end(), is_finite);
    return !json.is_number_float() || std::isfinite(json.get<double>());
}

bool meets(Rule rule, const Json& want, const Json& got, const Tolerance& tolerance) {
    if (rule == Rule::information) return true;
    if (rule == Rule::band) {
        if (!is_number_list(want) || !is_number_list(got) || want.size() != 2 || got.size() != 2) return false;
        return got[0].get<double>() >= want[0].get<double>() && got[1].get<double>() <= want[1].get<double>();
    }
    if (rule == Rule::equal || !want.is_number() || !got.is_number()) return equal(want, got, tolerance);
    const double slack = tolerance.abs + tolerance.rel * std::abs(want.get<double>());
    const double above = got.get<double>() - want.get<double>();
    return rule == Rule::lower_bound ? above >= -slack : above <= slack;
}

struct Totals {
    int passed = 0;
    int failed = 0;
    int failed_advisory = 0;
    int computed = 0;
    int unsupported = 0;
};

/// Fetches a member of the wanted type or says what is wrong with it.
template <typename IsType>
const Json* member(const Json& object, const char* key, const std::string& file, const std::string& pointer,
                   const char* type, const IsType& is_type) {
    const auto found = object.find(key);
    if (found == object.end()) return nullptr;
    if (!is_type(*found)) throw InputError(file, pointer + "/" + key, type, found->type_name());
    return &*found;
}

Tolerance read_tolerance(const Json& json, const std::string& file, const std::string& pointer) {
    Tolerance tolerance;
    for (const auto& [key, target] : {std::pair{"rel", &tolerance.rel}, std::pair{"abs", &tolerance.abs}}) {
        const Json* value = member(json, key, file, pointer, "a number", [](const Json& j) { return j.is_number(); });
        if (value == nullptr) continue;
        *target = value->get<double>();
        if (!(*target >= 0.0)) throw InputError(file, pointer + "/" + key, "a number >= 0", value->dump());
    }
    return tolerance;
}

Json judge(const Json& one, const std::string& file, const std::string& pointer, Totals& totals) {
    if (!one.is_object()) throw InputError(file, pointer, "an object", one.type_name());
    const auto is_text = [](const Json& j) { return j.is_string(); };
    const auto is_object = [](const Json& j) { return j.is_object(); };
    const Json* id = member(one, "id", file, pointer, "a text", is_text);
    if (id == nullptr) throw InputError(file, pointer + "/id", "a text", "nothing");
    const Json* input = member(one, "input", file, pointer, "an object", is_object);
    if (input == nullptr) throw InputError(file, pointer + "/input", "an object", "nothing");
    const Json* expected = member(one, "expected", file, pointer, "an object", is_object);
    const Json* status = member(one, "status", file, pointer, "a text", is_text);
    const bool advisory = status != nullptr && *status == "advisory";
    if (status != nullptr && !advisory && *status != "normative") {
        throw InputError(file, pointer + "/status", "normative or advisory", status->dump());
    }
    Tolerance tolerance;
    if (const Json* json = member(one, "tolerance", file, pointer, "an object", is_object)) {
        tolerance = read_tolerance(*json, file, pointer + "/tolerance");
    }

    const std::string name = id->get<std::string>();
    const std::string family = name.substr(0, name.find('-'));
    Json result{{"id", name}, {"result", ""}, {"got", Json::object()}, {"failed", Json::array()}, {"message", ""}};
    if (!known_family(family)) {
        result["result"] = "unsupported";
        result["message"] = fmt::format("no law for family '{}'", family);
        ++totals.unsupported;
        return result;
    }
    const LawAnswer answer =
        answer_case(family, *input, expected == nullptr ? Json() : *expected, file, pointer + "/input");
    result["message"] = answer.message;
    if (answer.message.empty() && !is_finite(answer.values)) {
        result["message"] = "not_finite: a result is beyond what a double can hold";
    }
    if (expected == nullptr) {
        result["result"] = "computed";
        result["got"] = answer.values;
        ++totals.computed;
        return result;
    }
    for (const auto& [key, want] : expected->items()) {
        const Json got = answer.values.contains(key) ? answer.values[key] : Json();
        const auto rule = answer.rules.find(key);
        result["got"][key] = got;
        if (!meets(rule == answer.rules.end() ? Rule::equal : rule->second, want, got, tolerance)) {
            result["failed"].push_back(key);
        }
    }
    const bool pass = result["failed"].empty() && answer.sound;
    result["result"] = pass ? "pass" : "fail";
    ++(pass ? totals.passed : advisory ? totals.failed_advisory : totals.failed);
    return result;
}

}  // namespace

int respond(const CommonOptions& common, const RespondOptions& options) {
    const std::string file = options.file.string();
    const Json document = read_json(options.file);
    if (!document.is_object()) throw InputError(file, "/", "an object with \"cases\"", document.type_name());
    if (document.contains("format") && document["format"] != "response-cases-1") {
        throw InputError(file, "/format", "\"response-cases-1\"", document["format"].dump());
    }
    const auto cases = document.find("cases");
    if (cases == document.end()) throw InputError(file, "/cases", "an array", "nothing");
    if (!cases->is_array()) throw InputError(file, "/cases", "an array", cases->type_name());

    Totals totals;
    Json results = Json::array();
    for (std::size_t i = 0; i < cases->size(); ++i) {
        results.push_back(judge((*cases)[i], file, fmt::format("/cases/{}", i), totals));
    }
    if (common.json) {
        const Json output{{"cases", results},
                          {"passed", totals.passed},
                          {"failed", totals.failed},
                          {"failed_advisory", totals.failed_advisory},
                          {"computed", totals.computed},
                          {"unsupported", totals.unsupported}};
        print_json_line(output);
    } else {
        for (const Json& result : results) {
            fmt::print("{:<24} {:<11}", printable_line(result["id"].get<std::string>()),
                       result["result"].get<std::string>());
            for (const Json& key : result["failed"]) {
                const std::string name = key.get<std::string>();
                fmt::print(" {}={}", name, result["got"][name].dump());
            }
            fmt::print(" {}\n", printable_line(result["message"].get<std::string>()));
            if (result["result"] == "computed") fmt::print("    {}\n", result["got"].dump());
        }
        fmt::print("{} passed, {} failed, {} advisory failed, {} computed, {} unsupported\n", totals.passed,
                   totals.failed, totals.failed_advisory, totals.computed, totals.unsupported);
    }
    return totals.failed > 0 ? comparison_failed : done;
}

}  // namespace trocar::app
