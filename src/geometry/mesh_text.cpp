#include "geometry/mesh_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>

#include "geometry/input_error.hpp"
#include "geometry/number_text.hpp"
#include "geometry/size_limits.hpp"

namespace trocar::mesh_text {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Value of a number that from_chars found out of range: zero when its first digit is below the smallest double.
double out_of_range_value(std::string_view number) {
    const bool negative = !number.empty() && number.front() == '-';
    const std::size_t exponent_at = number.find_first_of("eE");
    const std::string_view mantissa = number.substr(0, exponent_at);
    double exponent = 0.0;
    if (exponent_at != std::string_view::npos) {
        bool below = false;
        for (const char c : number.substr(exponent_at + 1)) {
            if (c == '-') below = true;
            if (is_digit(c)) exponent = exponent * 10.0 + (c - '0');
        }
        if (below) exponent = -exponent;
    }
    double place = 0.0;  // power of ten of the first digit that is not zero
    bool behind_point = false;
    bool seen = false;
    for (const char c : mantissa) {
        if (c == '.') behind_point = true;
        if (!is_digit(c)) continue;
        if (seen && !behind_point) place += 1.0;
        if (!seen && behind_point) place -= 1.0;
        seen = seen || c != '0';
    }
    const double magnitude = exponent + place < 0.0 ? 0.0 : std::numeric_limits<double>::infinity();
    return negative ? -magnitude : magnitude;
}

struct UnitWord {
    std::string_view word;
    std::string_view unit;
};
constexpr std::array<UnitWord, 18> unit_words{{{"mm", "mm"},
                                               {"millimeter", "mm"},
                                               {"millimeters", "mm"},
                                               {"millimetre", "mm"},
                                               {"millimetres", "mm"},
                                               {"cm", "cm"},
                                               {"centimeter", "cm"},
                                               {"centimeters", "cm"},
                                               {"centimetre", "cm"},
                                               {"centimetres", "cm"},
                                               {"m", "m"},
                                               {"meter", "m"},
                                               {"meters", "m"},
                                               {"metre", "m"},
                                               {"metres", "m"},
                                               {"in", "in"},
                                               {"inch", "in"},
                                               {"inches", "in"}}};

}  // namespace

std::string quoted(std::string_view token) {
    if (token.empty()) return "end of line";
    constexpr std::size_t longest = 40;
    std::string text = "'";
    for (const char c : token.substr(0, longest)) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte >= 0x7f) {
            text += fmt::format("\\x{:02x}", byte);
        } else {
            text += c;
        }
    }
    return text + (token.size() > longest ? "…'" : "'");
}

void fail_line(const Source& source, std::int64_t line, std::string_view expected, std::string_view found) {
    throw InputError(source.name, fmt::format("line {}", line), expected, found);
}

void fail_byte(const Source& source, std::size_t byte, std::string_view expected, std::string_view found) {
    throw InputError(source.name, fmt::format("byte {}", byte), expected, found);
}

bool LineReader::next(std::string_view& line) {
    if (position_ >= text_.size()) return false;
    ++line_number_;
    const std::size_t end = text_.find_first_of("\r\n", position_);
    if (end == std::string_view::npos) {
        line = text_.substr(position_);
        position_ = text_.size();
        return true;
    }
    line = text_.substr(position_, end - position_);
    position_ = end + 1;
    if (text_[end] == '\r' && position_ < text_.size() && text_[position_] == '\n') ++position_;
    return true;
}

std::string_view next_token(std::string_view& rest) {
    const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; };
    std::size_t first = 0;
    while (first < rest.size() && is_blank(rest[first])) ++first;
    std::size_t end = first;
    while (end < rest.size() && !is_blank(rest[end])) ++end;
    const std::string_view token = rest.substr(first, end - first);
    rest.remove_prefix(end);
    return token;
}

std::optional<double> parse_double(std::string_view token) {
    if (token.size() > 1 && token.front() == '+' && token[1] != '-' && token[1] != '+') token.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
    if (error == std::errc::invalid_argument || end != token.data() + token.size()) return std::nullopt;
    if (error == std::errc::result_out_of_range) return out_of_range_value(token);
    return value;
}

std::optional<std::int64_t> parse_integer(std::string_view token) {
    if (token.size() > 1 && token.front() == '+' && token[1] != '-' && token[1] != '+') token.remove_prefix(1);
    return number_of_text<std::int64_t>(token);
}

double finite_number(const Source& source, std::int64_t line, std::string_view token) {
    const std::optional<double> value = parse_double(token);
    if (!value) fail_line(source, line, "a number", quoted(token));
    if (!std::isfinite(*value)) fail_line(source, line, "a finite number", quoted(token));
    return *value;
}

bool equal_without_case(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return lower(x) == lower(y); });
}

std::string stated_unit(std::string_view comment) {
    std::string text(comment);
    std::transform(text.begin(), text.end(), text.begin(), lower);
    for (std::size_t at = text.find("unit"); at != std::string::npos; at = text.find("unit", at + 1)) {
        std::size_t p = at + 4;
        if (at > 0 && std::isalpha(static_cast<unsigned char>(text[at - 1])) != 0) continue;
        if (p < text.size() && text[p] == 's') ++p;
        while (p < text.size() && text[p] == ' ') ++p;
        if (p >= text.size() || (text[p] != ':' && text[p] != '=')) continue;
        ++p;
        while (p < text.size() && (text[p] == ' ' || text[p] == '\t' || text[p] == '"')) ++p;
        std::size_t end = p;
        while (end < text.size() && std::isalpha(static_cast<unsigned char>(text[end])) != 0) ++end;
        for (const UnitWord& entry : unit_words) {
            if (text.compare(p, end - p, entry.word) == 0) return std::string(entry.unit);
        }
    }
    return {};
}

MeshBuilder::MeshBuilder(const Source& source) : source_(source) {
    constexpr auto index_end = static_cast<std::size_t>(std::numeric_limits<Index>::max());
    const bool limited = are_sizes_limited();
    most_coordinates_ = 3 * (limited ? static_cast<std::size_t>(most_vertices) : index_end);
    most_corners_ = 3 * (limited ? static_cast<std::size_t>(most_triangles) : index_end);
}

void MeshBuilder::refuse_size() const {
    if (are_sizes_limited()) {
        throw InputError(
            source_.name, "",
            limit_text(most_triangles, "triangles and " + std::to_string(most_vertices) + " vertices in a mesh"),
            "more");
    }
    throw InputError(source_.name, "", "at most 2147483647 vertices and triangles", "more");
}

void MeshBuilder::reserve(std::size_t vertices, std::size_t triangles) {
    if (3 * vertices > most_coordinates_ || 3 * triangles > most_corners_) refuse_size();
    coordinates_.reserve(3 * vertices);
    corners_.reserve(3 * triangles);
}

void MeshBuilder::add_vertex(double x, double y, double z) {
    if (coordinates_.size() >= most_coordinates_) refuse_size();
    coordinates_.push_back(x);
    coordinates_.push_back(y);
    coordinates_.push_back(z);
}

void MeshBuilder::add_polygon(std::span<const Index> corners) {
    if (corners.size() > static_cast<std::size_t>(most_corners) && are_sizes_limited()) {
        throw InputError(source_.name, "", limit_text(most_corners, "corners of a face"),
                         std::to_string(corners.size()));
    }
    for (std::size_t i = 2; i < corners.size(); ++i) add_triangle(corners[0], corners[i - 1], corners[i]);
}

void MeshBuilder::add_triangle(Index a, Index b, Index c) {
    if (corners_.size() >= most_corners_) refuse_size();
    corners_.push_back(a);
    corners_.push_back(b);
    corners_.push_back(c);
}

void MeshBuilder::read_unit(std::string_view comment) {
    if (unit_.empty()) unit_ = stated_unit(comment);
}

Mesh MeshBuilder::finish(std::string format) {
    Mesh mesh;
    mesh.format = std::move(format);
    mesh.vertices = Eigen::Map<const Matrix3X>(coordinates_.data(), 3, vertex_count());
    mesh.triangles = Eigen::Map<const Triangles>(corners_.data(), 3, triangle_count());
    mesh.vertices_stored = static_cast<Index>(vertex_count());
    mesh.stated_unit = std::move(unit_);
    return mesh;
}

}  // namespace trocar::mesh_text
