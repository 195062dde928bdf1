// Which methods of the registry a test asks.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "method/registry.hpp"

namespace trocar::test {

/// Of `entries`, a list of the registry: libraries may be absent.
template <typename Entries>
bool is_registered(const Entries& entries, std::string_view name) {
    return std::any_of(entries.begin(), entries.end(), [name](const auto& entry) { return entry.name == name; });
}

/// An entry as it comes, and with every other choice of these parameters, as on a command line.
template <typename Entry>
std::vector<std::string> variants_of(const Entry& entry, std::initializer_list<std::string_view> parameters) {
    std::vector<std::string> methods{entry.name};
    for (const Parameter& parameter : entry.parameters) {
        if (std::find(parameters.begin(), parameters.end(), parameter.name) == parameters.end()) continue;
        for (const std::string& choice : parameter.choices) {
            if (choice != parameter.default_value) methods.push_back(entry.name + ":" + parameter.name + "=" + choice);
        }
    }
    return methods;
}

}  // namespace trocar::test
