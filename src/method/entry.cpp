#include "method/entry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/number_text.hpp"
#include "scene/retired_names.hpp"

namespace trocar {
namespace {

std::optional<double> parse_number(std::string_view text) {
    const std::optional<double> value = number_of_text<double>(text);
    return value && std::isfinite(*value) ? value : std::nullopt;
}

bool contains(const std::vector<std::string>& list, std::string_view word) {
    return std::find(list.begin(), list.end(), word) != list.end();
}

void check(std::string_view method, const Parameter& parameter, const std::string& value) {
    if (contains(parameter.words, value)) return;
    bool good = false;
    if (parameter.type == Parameter::Type::choice) {
        good = contains(parameter.choices, value);
    } else if (const auto number = parse_number(value)) {
        good = *number >= parameter.minimum && *number <= parameter.maximum &&
               (parameter.type == Parameter::Type::number || *number == std::floor(*number));
    }
    if (!good) {
        throw InputError(method, fmt::format("parameter '{}'", parameter.name), parameter.range(),
                         with_replacement(fmt::format("'{}'", value), NameKind::parameter, method,
                                          fmt::format("{}={}", parameter.name, value)));
    }
}

}  // namespace

std::string Parameter::range() const {
    std::string text;
    if (type == Type::choice) {
        text = fmt::format("{}", fmt::join(choices, "|"));
    } else {
        const std::string kind = type == Type::integer ? "integer" : "number";
        const bool low = std::isfinite(minimum);
        const bool high = std::isfinite(maximum);
        if (low && high) {
            text = fmt::format("{} {} to {}", kind, minimum, maximum);
        } else if (low) {
            text = fmt::format("{} >= {}", kind, minimum);
        } else if (high) {
            text = fmt::format("{} <= {}", kind, maximum);
        } else {
            text = kind;
        }
    }
    for (const std::string& word : words) text += "|" + word;
    return text;
}

Parameter number_parameter(const std::string& name, const std::string& unit, const std::string& default_value,
                           double low, double high, const std::string& meaning, std::vector<std::string> words) {
    return {.name = name,
            .unit = unit,
            .default_value = default_value,
            .minimum = low,
            .maximum = high,
            .meaning = meaning,
            .words = std::move(words)};
}

Parameter integer_parameter(const std::string& name, const std::string& default_value, double low, double high,
                            const std::string& meaning, std::vector<std::string> words) {
    Parameter parameter = number_parameter(name, "1", default_value, low, high, meaning, std::move(words));
    parameter.type = Parameter::Type::integer;
    return parameter;
}

Parameter choice_parameter(const std::string& name, const std::string& default_value, std::vector<std::string> choices,
                           const std::string& meaning) {
    return {.name = name,
            .type = Parameter::Type::choice,
            .default_value = default_value,
            .choices = std::move(choices),
            .meaning = meaning};
}

ParameterValues::ParameterValues(std::string_view method, const std::vector<Parameter>& declared,
                                 const std::map<std::string, std::string>& given) {
    for (const Parameter& parameter : declared) {
        const auto found = given.find(parameter.name);
        const std::string& value = found == given.end() ? parameter.default_value : found->second;
        check(method, parameter, value);
        values_.emplace(parameter.name, value);
    }
    for (const auto& [key, value] : given) {
        if (values_.contains(key)) continue;
        std::vector<std::string> known;
        known.reserve(declared.size());
        for (const Parameter& parameter : declared) known.push_back(parameter.name);
        throw InputError(
            method, fmt::format("parameter '{}'", key),
            known.empty() ? std::string("no parameters") : fmt::format("one of {}", fmt::join(known, ", ")),
            with_replacement(fmt::format("'{}'", key), NameKind::parameter, method, key));
    }
}

const std::string& ParameterValues::text(std::string_view name) const {
    const auto found = values_.find(name);
    if (found == values_.end()) throw std::logic_error("undeclared parameter " + std::string(name));
    return found->second;
}

double ParameterValues::number(std::string_view name) const {
    return parse_number(text(name)).value_or(std::numeric_limits<double>::quiet_NaN());
}

std::int64_t ParameterValues::integer(std::string_view name) const { return static_cast<std::int64_t>(number(name)); }

std::string why_unreported(const DetectorEntry& detector, const ContactGeneratorEntry& generator) {
    if (generator.wants_native && !detector.native_contacts) return detector.name + " has no native contacts";
    if (generator.wants_query_distance && !detector.query_distance) {
        return fmt::format("{} finds pairs that meet, and contacts '{}' are made from pairs within a query distance",
                           detector.name, generator.name);
    }
    return {};
}

std::string why_not_taken(const StepperEntry& stepper, const Topology& topology, const ResponseOutput& output) {
    const auto pushes_tissue = [&topology](const ContactForceLaw& contact) {
        const auto is_tissue = [&topology](Index vertex) {
            const auto body = static_cast<std::size_t>(vertex < 0 ? 0 : topology.body_of_vertex(vertex));
            return vertex >= 0 && topology.bodies[body].kind == BodyKind::tissue;
        };
        return is_tissue(any_vertex(contact.vertices)) || is_tissue(any_vertex(contact.reaction_vertices));
    };
    const auto pushes_as = [&](bool solved) {
        return std::any_of(output.contacts.begin(), output.contacts.end(), [&](const ContactForceLaw& contact) {
            return (contact.role == ContactRole::solved) == solved && pushes_tissue(contact);
        });
    };
    const char* what = nullptr;
    if (!stepper.takes_contact_force_laws && pushes_as(false)) {
        what = "contact force laws";
    } else if (!stepper.takes_solved_contacts && pushes_as(true)) {
        what = "contacts whose impulses the response finds in each sub-step";
    } else if (!stepper.takes_position_corrections && !output.position_corrections.empty()) {
        what = "position corrections";
    } else if (!stepper.takes_held_forces && !output.held_force.isZero(0.0)) {
        what = "forces held over the tick";
    }
    return what == nullptr ? std::string()
                           : fmt::format("{} does not take {}, which the response asks for", stepper.name, what);
}

}  // namespace trocar
