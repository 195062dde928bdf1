// A JSON value with its file and JSON pointer, so that every error names file, pointer, expected and found value.
// Included only by .cpp files that read JSON.
#pragma once

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/types.hpp"
#include "scene/retired_names.hpp"

namespace trocar {

using Json = nlohmann::json;

/// Throws InputError with line and column for a syntax error or a duplicate key.
Json parse_json(std::string_view text, const std::string& file);
/// As above, keeping the file's order of keys.
nlohmann::ordered_json parse_ordered_json(std::string_view text, const std::string& file);

/// Refers to document and file name; both outlive it.
class JsonNode {
public:
    JsonNode(const Json& value, const std::string& file, std::string pointer = "")
        : value_(&value), file_(&file), pointer_(std::move(pointer)) {}
    JsonNode(const Json& value, std::string&& file, std::string pointer = "") = delete;
    JsonNode(Json&& value, const std::string& file, std::string pointer = "") = delete;

    /// Throws InputError "file: pointer: expected …, got <this value>".
    [[noreturn]] void fail(std::string_view expected) const;
    [[noreturn]] void fail(std::string_view expected, std::string_view found) const;

    /// The JSON pointer, for messages that are not errors.
    [[nodiscard]] const std::string& place() const { return pointer_; }

    /// The same value; an unknown key in it, or in what it holds, is reported with its replacement where it is a
    /// retired name of that kind. Scope: the nearest enclosing key.
    [[nodiscard]] JsonNode with_key_kind(NameKind kind) const;
    /// Throws unless this is an object that holds only keys of `known`.
    void expect_keys(const std::vector<std::string>& known) const;
    [[nodiscard]] bool has(const std::string& key) const { return value_->contains(key); }
    /// All keys of an object; throws unless this is one.
    [[nodiscard]] std::vector<std::string> keys() const;
    /// The value of a required key.
    [[nodiscard]] JsonNode at(const std::string& key) const;
    /// The value of an optional key.
    [[nodiscard]] std::optional<JsonNode> find(const std::string& key) const;

    [[nodiscard]] bool is_text() const { return value_->is_string(); }
    [[nodiscard]] bool is_null() const { return value_->is_null(); }
    [[nodiscard]] bool is_list() const { return value_->is_array(); }
    /// A text, maybe an empty one.
    [[nodiscard]] std::string any_text() const;
    /// A text of at least one printable character.
    [[nodiscard]] std::string text() const;
    /// One of `words`.
    [[nodiscard]] std::string word(const std::vector<std::string>& words) const;
    /// One of `words`, which are names of that kind: a retired one is reported with its replacement.
    [[nodiscard]] std::string word(const std::vector<std::string>& words, NameKind kind) const;
    /// Throws unless this is exactly `word`.
    void expect_word(const std::string& word) const;
    [[nodiscard]] bool flag() const;
    [[nodiscard]] double number() const;
    [[nodiscard]] double positive() const;      ///< > 0
    [[nodiscard]] double non_negative() const;  ///< >= 0
    [[nodiscard]] double number(double minimum, double maximum) const;
    [[nodiscard]] std::int64_t integer(std::int64_t minimum, std::int64_t maximum) const;
    [[nodiscard]] std::uint64_t unsigned_integer() const;
    [[nodiscard]] std::vector<JsonNode> list() const;
    /// Exactly `count` finite numbers.
    [[nodiscard]] std::vector<double> numbers(std::size_t count) const;
    [[nodiscard]] Vector3 vector3() const;

private:
    [[nodiscard]] JsonNode inside(const Json& value, std::string pointer) const;

    const Json* value_;
    const std::string* file_;
    std::string pointer_;
    std::optional<NameKind> key_kind_;
};

}  // namespace trocar
