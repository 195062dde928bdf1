#include "scene/json_node.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "geometry/input_error.hpp"
#include "geometry/json_depth.hpp"
#include "geometry/size_limits.hpp"

namespace trocar {
namespace {

/// One line of printable text, at most 60 characters.
std::string shown(const Json& value) {
    std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    constexpr std::size_t longest = 60;
    if (text.size() > longest) {
        std::size_t end = longest - 3;
        while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) --end;  // keep UTF-8 whole
        text = text.substr(0, end) + "...";
    }
    return text;
}

std::string quoted(const std::string& text) {
    const std::string escaped = shown(Json(text));
    return "'" + escaped.substr(1, escaped.size() - 2) + "'";
}

std::string one_of(const std::vector<std::string>& words) {
    return fmt::format("{}{}", words.size() > 1 ? "one of " : "", fmt::join(words, ", "));
}

/// Last segment of a JSON pointer that is no index; empty at the root.
std::string_view nearest_key(std::string_view pointer) {
    while (true) {
        const std::size_t slash = pointer.rfind('/');
        if (slash == std::string_view::npos) return {};
        const std::string_view segment = pointer.substr(slash + 1);
        if (segment.find_first_not_of("0123456789") != std::string_view::npos) return segment;
        pointer = pointer.substr(0, slash);
    }
}

/// Line and column (from 1) of a byte offset.
std::string place_of(std::string_view text, std::size_t offset) {
    std::size_t line = 1;
    std::size_t column = 1;
    for (const char c : text.substr(0, std::min(offset, text.size()))) {
        if (c == '\n') {
            ++line;
            column = 1;
        } else if ((static_cast<unsigned char>(c) & 0xc0U) != 0x80U) {
            ++column;
        }
    }
    return fmt::format("line {}, column {}", line, column);
}

/// The JSON pointer of the value that a parser is about to read, and the keys of the objects that are open, from the
/// events that it has reported.
class Whereabouts {
public:
    void opens() { open_.emplace_back(); }
    void closes() {
        open_.pop_back();
        has_read();
    }
    /// False for a key that the object has had before.
    bool names(const std::string& key) {
        open_.back().key = key;
        return open_.back().keys.insert(key).second;
    }
    /// Of the object that is open.
    [[nodiscard]] std::size_t key_count() const { return open_.back().keys.size(); }
    void has_read() {
        if (!open_.empty()) ++open_.back().read;
    }
    [[nodiscard]] std::string pointer() const {
        std::string text;
        for (const Level& level : open_) text += "/" + (level.key ? *level.key : std::to_string(level.read));
        return text.empty() ? "/" : text;
    }

private:
    struct Level {
        std::optional<std::string> key;  ///< of an object; none: an array
        std::set<std::string> keys;      ///< that the object has had
        std::size_t read = 0;
    };
    std::vector<Level> open_;
};

/// Examines a text before anything is made of it. (The parser's own callback reads through a whole list at the end of
/// each of its items.)
template <typename AnyJson>
class Watch : public AnyJson::json_sax_t {
public:
    explicit Watch(const std::string& file) : file_(&file) {}
    [[nodiscard]] std::string pointer() const { return whereabouts_.pointer(); }

    bool null() override { return value(); }
    bool boolean(bool /*value*/) override { return value(); }
    bool number_integer(typename AnyJson::number_integer_t /*value*/) override { return value(); }
    bool number_unsigned(typename AnyJson::number_unsigned_t /*value*/) override { return value(); }
    bool number_float(typename AnyJson::number_float_t /*value*/, const std::string& /*text*/) override {
        return value();
    }
    bool string(std::string& /*value*/) override { return value(); }
    bool binary(typename AnyJson::binary_t& /*value*/) override { return value(); }
    bool start_object(std::size_t /*elements*/) override { return opens(); }
    bool start_array(std::size_t /*elements*/) override { return opens(); }
    bool end_object() override { return closes(); }
    bool end_array() override { return closes(); }
    bool key(std::string& name) override {
        expect_shallow();
        if (!whereabouts_.names(name)) {
            throw InputError(*file_, "", "every key once in an object",
                             fmt::format("the key {} twice", trocar::quoted(name)));
        }
        if (std::is_same_v<AnyJson, nlohmann::ordered_json> && are_sizes_limited() &&
            whereabouts_.key_count() > static_cast<std::size_t>(most_ordered_keys)) {
            throw InputError(*file_, whereabouts_.pointer(), limit_text(most_ordered_keys, "keys of an object"),
                             "more");
        }
        return true;
    }
    bool parse_error(std::size_t /*byte*/, const std::string& /*token*/,
                     const nlohmann::detail::exception& /*error*/) override {
        return false;  // the parser's to report
    }

private:
    void expect_shallow() const {
        if (depth_ <= deepest_json) return;
        throw InputError(*file_, whereabouts_.pointer(),
                         fmt::format("at most {} levels of lists and objects", deepest_json), "more");
    }
    bool value() {
        expect_shallow();
        whereabouts_.has_read();
        return true;
    }
    bool opens() {
        expect_shallow();
        whereabouts_.opens();
        ++depth_;
        return true;
    }
    bool closes() {
        whereabouts_.closes();
        --depth_;
        return true;
    }

    const std::string* file_;
    Whereabouts whereabouts_;
    int depth_ = 0;
};

template <typename AnyJson>
AnyJson parse(std::string_view text, const std::string& file) {
    if (are_sizes_limited() && text.size() > static_cast<std::size_t>(1'000'000 * most_json_megabytes)) {
        throw InputError(file, "", limit_text(most_json_megabytes, "MB of JSON"), fmt::format("{} bytes", text.size()));
    }
    Watch<AnyJson> watch(file);
    static_cast<void>(AnyJson::sax_parse(text.begin(), text.end(), &watch));
    try {
        return AnyJson::parse(text.begin(), text.end());
    } catch (const Json::parse_error& error) {
        const std::size_t offset = error.byte > 0 ? error.byte - 1 : 0;
        const std::string found =
            offset >= text.size() ? "the end of the file" : quoted(std::string(text.substr(offset, 1)));
        throw InputError(file, place_of(text, offset), "JSON", found + " where it cannot stand");
    } catch (const Json::out_of_range&) {
        throw InputError(file, watch.pointer(), "a number that a double can hold", "one beyond 1.8e308");
    }
}

}  // namespace

Json parse_json(std::string_view text, const std::string& file) { return parse<Json>(text, file); }

nlohmann::ordered_json parse_ordered_json(std::string_view text, const std::string& file) {
    return parse<nlohmann::ordered_json>(text, file);
}

void JsonNode::fail(std::string_view expected) const { fail(expected, shown(*value_)); }

void JsonNode::fail(std::string_view expected, std::string_view found) const {
    throw InputError(*file_, pointer_.empty() ? "/" : pointer_, expected, found);
}

JsonNode JsonNode::inside(const Json& value, std::string pointer) const {
    JsonNode node(value, *file_, std::move(pointer));
    node.key_kind_ = key_kind_;
    return node;
}

JsonNode JsonNode::with_key_kind(NameKind kind) const {
    JsonNode node = *this;
    node.key_kind_ = kind;
    return node;
}

void JsonNode::expect_keys(const std::vector<std::string>& known) const {
    if (!value_->is_object()) fail("an object");
    for (const auto& [key, unused] : value_->items()) {
        if (std::find(known.begin(), known.end(), key) != known.end()) continue;
        const std::string name = quoted(key);
        throw InputError(*file_, fmt::format("{}/{}", pointer_, name.substr(1, name.size() - 2)),
                         fmt::format("one of {}", fmt::join(known, ", ")),
                         key_kind_ ? with_replacement(name, *key_kind_, nearest_key(pointer_), key) : name);
    }
}

JsonNode JsonNode::at(const std::string& key) const {
    if (!value_->is_object()) fail("an object");
    const auto found = value_->find(key);
    if (found == value_->end()) fail(fmt::format("the key '{}'", key), "none");
    return inside(*found, fmt::format("{}/{}", pointer_, key));
}

std::optional<JsonNode> JsonNode::find(const std::string& key) const {
    if (!value_->is_object()) fail("an object");
    if (!value_->contains(key)) return std::nullopt;
    return at(key);
}

std::string JsonNode::any_text() const {
    if (!value_->is_string()) fail("a text");
    return value_->get<std::string>();
}

std::string JsonNode::text() const {
    if (!value_->is_string() || value_->get_ref<const std::string&>().empty()) fail("a text");
    // Names stand in messages and tables, on terminals too.
    const auto& text = value_->get_ref<const std::string&>();
    if (printable_line(text, std::string::npos) != text) fail("a text of printable characters");
    return text;
}

std::string JsonNode::word(const std::vector<std::string>& words) const {
    const std::string expected = one_of(words);
    if (!value_->is_string()) fail(expected);
    if (std::find(words.begin(), words.end(), value_->get<std::string>()) == words.end()) fail(expected);
    return value_->get<std::string>();
}

std::string JsonNode::word(const std::vector<std::string>& words, NameKind kind) const {
    if (value_->is_string() && std::find(words.begin(), words.end(), value_->get<std::string>()) == words.end()) {
        const std::string found = with_replacement(shown(*value_), kind, "", value_->get<std::string>());
        fail(one_of(words), found);
    }
    return word(words);
}

void JsonNode::expect_word(const std::string& word) const {
    if (!value_->is_string() || value_->get_ref<const std::string&>() != word) fail(word);
}

bool JsonNode::flag() const {
    if (!value_->is_boolean()) fail("true or false");
    return value_->get<bool>();
}

double JsonNode::number() const {
    if (!value_->is_number()) fail("a number");
    return value_->get<double>();
}

double JsonNode::positive() const {
    if (!value_->is_number() || !(value_->get<double>() > 0.0)) fail("a number > 0");
    return value_->get<double>();
}

double JsonNode::non_negative() const {
    if (!value_->is_number() || !(value_->get<double>() >= 0.0)) fail("a number >= 0");
    return value_->get<double>();
}

double JsonNode::number(double minimum, double maximum) const {
    const bool inside = value_->is_number() && value_->get<double>() >= minimum && value_->get<double>() <= maximum;
    if (!inside) fail(fmt::format("a number from {} to {}", minimum, maximum));
    return value_->get<double>();
}

std::int64_t JsonNode::integer(std::int64_t minimum, std::int64_t maximum) const {
    const bool too_large =
        value_->is_number_unsigned() &&
        value_->get<std::uint64_t>() > static_cast<std::uint64_t>(std::max<std::int64_t>(maximum, 0));
    const bool inside = value_->is_number_integer() && !too_large && value_->get<std::int64_t>() >= minimum &&
                        value_->get<std::int64_t>() <= maximum;
    if (!inside) fail(fmt::format("an integer from {} to {}", minimum, maximum));
    return value_->get<std::int64_t>();
}

std::uint64_t JsonNode::unsigned_integer() const {
    if (!value_->is_number_unsigned()) fail("an integer >= 0");
    return value_->get<std::uint64_t>();
}

std::vector<std::string> JsonNode::keys() const {
    if (!value_->is_object()) fail("an object");
    std::vector<std::string> names;
    for (const auto& [key, value] : value_->items()) names.push_back(key);
    return names;
}

std::vector<JsonNode> JsonNode::list() const {
    if (!value_->is_array()) fail("a list");
    std::vector<JsonNode> nodes;
    nodes.reserve(value_->size());
    for (std::size_t i = 0; i < value_->size(); ++i) {
        nodes.push_back(inside((*value_)[i], fmt::format("{}/{}", pointer_, i)));
    }
    return nodes;
}

std::vector<double> JsonNode::numbers(std::size_t count) const {
    if (!value_->is_array() || value_->size() != count) fail(fmt::format("a list of {} numbers", count));
    std::vector<double> values;
    for (const JsonNode& node : list()) values.push_back(node.number());
    return values;
}

Vector3 JsonNode::vector3() const {
    const std::vector<double> values = numbers(3);
    return {values[0], values[1], values[2]};
}

}  // namespace trocar
