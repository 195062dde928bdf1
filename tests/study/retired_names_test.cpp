#include "scene/retired_names.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "method/device.hpp"
#include "method/registry.hpp"
#include "scene/scene.hpp"
#include "study/study.hpp"

namespace trocar {
namespace {

/// Properties of a JSON Schema, each with the nearest enclosing property or definition.
void collect_keys(const nlohmann::json& schema, const std::string& scope,
                  std::set<std::pair<std::string, std::string>>& keys) {
    for (const auto& [name, part] : schema.items()) {
        const bool has_names = schema.is_object() && part.is_object() && (name == "properties" || name == "$defs");
        if (!has_names) {
            if (part.is_structured()) collect_keys(part, scope, keys);
            continue;
        }
        for (const auto& [key, value] : part.items()) {
            if (name == "properties") keys.emplace(scope, key);
            collect_keys(value, key, keys);
        }
    }
}

bool is_key(const std::string& schema, std::string_view scope, std::string_view name) {
    std::set<std::pair<std::string, std::string>> keys;
    collect_keys(nlohmann::json::parse(schema), "", keys);
    return std::any_of(keys.begin(), keys.end(),
                       [&](const auto& key) { return key.second == name && (scope.empty() || key.first == scope); });
}

bool has_entry(const auto& entries, std::string_view name) {
    return std::any_of(entries.begin(), entries.end(), [&](const auto& entry) { return entry.name == name; });
}

/// `name` is a parameter, or PARAMETER=VALUE.
bool declares(const std::vector<Parameter>& parameters, std::string_view name) {
    const std::size_t equals = name.find('=');
    return std::any_of(parameters.begin(), parameters.end(), [&](const Parameter& parameter) {
        if (parameter.name != name.substr(0, equals)) return false;
        if (equals == std::string_view::npos) return true;
        const std::string value(name.substr(equals + 1));
        return std::count(parameter.choices.begin(), parameter.choices.end(), value) +
                   std::count(parameter.words.begin(), parameter.words.end(), value) >
               0;
    });
}

bool is_declared(std::string_view scope, std::string_view name) {
    const auto among = [&](const auto& entries) {
        return std::any_of(entries.begin(), entries.end(), [&](const auto& entry) {
            return (scope.empty() || entry.name == scope) && declares(entry.parameters, name);
        });
    };
    return among(registry().detectors()) || among(registry().contact_generators()) || among(registry().responses()) ||
           among(registry().steppers()) || (scope == "device" && declares(device_parameters(), name));
}

bool is_in_use(NameKind kind, std::string_view scope, std::string_view name) {
    switch (kind) {
        case NameKind::detector:
            return has_entry(registry().detectors(), name) || has_entry(registry().absent_detectors(), name);
        case NameKind::contact_generator:
            return has_entry(registry().contact_generators(), name);
        case NameKind::response:
            return has_entry(registry().responses(), name) || has_entry(registry().absent_responses(), name);
        case NameKind::stepper:
            return has_entry(registry().steppers(), name);
        case NameKind::parameter:
            return is_declared(scope, name);
        case NameKind::scene_key:
            return is_key(scene_schema(), scope, name);
        case NameKind::study_key:
            return is_key(study_schema(), scope, name);
    }
    return false;
}

TEST(RetiredNames, AreNotInUse) {
    for (const RetiredName& row : retired_names()) {
        EXPECT_FALSE(is_in_use(row.kind, row.scope, row.name)) << row.scope << ' ' << row.name;
    }
}

TEST(RetiredNames, AreRenamedToNamesInUse) {
    const std::string_view start = "renamed to '";
    for (const RetiredName& row : retired_names()) {
        if (!row.use.starts_with(start)) continue;
        ASSERT_TRUE(row.use.ends_with("'")) << row.use;
        std::string name(row.use.substr(start.size(), row.use.size() - start.size() - 1));
        const std::size_t equals = row.name.find('=');
        if (equals != std::string_view::npos) name = std::string(row.name.substr(0, equals + 1)) + name;
        EXPECT_TRUE(is_in_use(row.kind, row.scope, name)) << row.scope << ' ' << row.name << ": " << row.use;
    }
}

TEST(RetiredNames, HaveOneRowOfOneShortLineEach) {
    std::set<std::tuple<NameKind, std::string_view, std::string_view>> once;
    for (const RetiredName& row : retired_names()) {
        EXPECT_TRUE(once.emplace(row.kind, row.scope, row.name).second) << row.scope << ' ' << row.name;
        EXPECT_FALSE(row.name.empty() || row.use.empty()) << row.name << row.use;
        EXPECT_LE(row.name.size() + row.use.size(), 120U) << row.name << ": " << row.use;
        EXPECT_EQ(row.use.find('\n'), std::string_view::npos) << row.use;
    }
}

TEST(RetiredNames, AreFoundByKindAndScope) {
    EXPECT_EQ(replacement_of(NameKind::response, "", "hold"), "renamed to 'unilateral'");
    EXPECT_EQ(replacement_of(NameKind::detector, "", "hold"), "");
    EXPECT_EQ(replacement_of(NameKind::parameter, "unilateral", "skin"), "renamed to 'contact_offset'");
    EXPECT_EQ(replacement_of(NameKind::parameter, "penalty", "skin"), "");
    EXPECT_NE(replacement_of(NameKind::parameter, "penalty", "tip_rate"), "") << "its row is for every method";
    EXPECT_EQ(with_replacement("'near'", NameKind::contact_generator, "", "near"), "'near': renamed to 'proximity'");
    EXPECT_EQ(with_replacement("'far'", NameKind::contact_generator, "", "far"), "'far'");
}

}  // namespace
}  // namespace trocar
