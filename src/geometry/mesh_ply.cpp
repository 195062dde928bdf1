// PLY, text and binary of both byte orders. Elements and properties other than vertex positions and faces are skipped
// by their declared types.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "geometry/binary_number.hpp"
#include "geometry/mesh_text.hpp"

namespace trocar::mesh_text {
namespace {

enum class Type : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

constexpr std::array<std::pair<std::string_view, Type>, 16> type_names{{{"char", Type::int8},
                                                                        {"uchar", Type::uint8},
                                                                        {"short", Type::int16},
                                                                        {"ushort", Type::uint16},
                                                                        {"int", Type::int32},
                                                                        {"uint", Type::uint32},
                                                                        {"float", Type::float32},
                                                                        {"double", Type::float64},
                                                                        {"int8", Type::int8},
                                                                        {"uint8", Type::uint8},
                                                                        {"int16", Type::int16},
                                                                        {"uint16", Type::uint16},
                                                                        {"int32", Type::int32},
                                                                        {"uint32", Type::uint32},
                                                                        {"float32", Type::float32},
                                                                        {"float64", Type::float64}}};

constexpr std::size_t size_of(Type type) {
    switch (type) {
        case Type::int8:
        case Type::uint8:
            return 1;
        case Type::int16:
        case Type::uint16:
            return 2;
        case Type::int32:
        case Type::uint32:
        case Type::float32:
            return 4;
        case Type::float64:
            return 8;
    }
    return 0;
}

constexpr bool is_whole(Type type) { return type != Type::float32 && type != Type::float64; }

struct Property {
    std::string name;
    bool is_list = false;
    Type count_type = Type::uint8;
    Type type = Type::float32;
};

struct Element {
    std::string name;
    std::int64_t count = 0;
    std::int64_t line = 0;  ///< of its header line
    std::vector<Property> properties;

    [[nodiscard]] int find(std::string_view property) const {
        for (std::size_t i = 0; i < properties.size(); ++i) {
            if (properties[i].name == property) return static_cast<int>(i);
        }
        return -1;
    }
};

enum class Encoding : std::uint8_t { text, little, big };

struct Header {
    Encoding encoding = Encoding::text;
    std::vector<Element> elements;
};

/// Reads the values of the body in order, as text or as bytes, and reports the position.
class Body {
public:
    Body(const Source& source, LineReader lines, Encoding encoding)
        : source_(source), lines_(lines), encoding_(encoding), byte_(lines.position()) {}

    /// Sets the place and the name of the row for messages.
    void begin_row(const Element& element, std::int64_t row) {
        element_ = &element;
        row_ = row;
        if (encoding_ != Encoding::text) return;
        do {
            if (!lines_.next(rest_)) fail(fmt::format("{} of {}", row_name(), element.count), "end of file");
        } while (rest_.find_first_not_of(" \t\v\f") == std::string_view::npos);
    }

    void end_row() {
        if (encoding_ != Encoding::text) return;
        if (const std::string_view more = next_token(rest_); !more.empty()) {
            fail(fmt::format("no more values for {}", row_name()), quoted(more));
        }
    }

    double number(Type type) {
        if (encoding_ == Encoding::text) {
            const std::string_view text = word();
            const std::optional<double> value = parse_double(text);
            if (!value) fail("a number", quoted(text));
            return *value;
        }
        if (type == Type::float64) return std::bit_cast<double>(bits(8));
        if (type == Type::float32) return double{std::bit_cast<float>(static_cast<std::uint32_t>(bits(4)))};
        return static_cast<double>(whole(type));
    }

    /// A finite coordinate.
    double coordinate(Type type) {
        const std::size_t at = byte_;
        const double value = number(type);
        if (!std::isfinite(value)) {
            if (encoding_ == Encoding::text)
                fail(fmt::format("a finite number ({})", row_name()), fmt::format("'{}'", value));
            fail_byte(source_, at, fmt::format("a finite number ({})", row_name()), fmt::format("{}", value));
        }
        return value;
    }

    std::int64_t whole(Type type) {
        if (encoding_ == Encoding::text) {
            const std::string_view text = word();
            const std::optional<std::int64_t> value = parse_integer(text);
            if (!value) fail("a whole number", quoted(text));
            return *value;
        }
        switch (type) {
            case Type::int8:
                return static_cast<std::int8_t>(bits(1));
            case Type::uint8:
                return static_cast<std::uint8_t>(bits(1));
            case Type::int16:
                return static_cast<std::int16_t>(bits(2));
            case Type::uint16:
                return static_cast<std::uint16_t>(bits(2));
            case Type::int32:
                return static_cast<std::int32_t>(bits(4));
            case Type::uint32:
                return static_cast<std::uint32_t>(bits(4));
            case Type::float32:
            case Type::float64:
                break;
        }
        return 0;
    }

    /// Number of entries of a list. Throws InputError when the rest of the file cannot hold them.
    std::int64_t list_size(const Property& property) {
        const std::int64_t size = whole(property.count_type);
        const std::size_t each = encoding_ == Encoding::text ? 1 : size_of(property.type);
        if (size < 0 || static_cast<std::uint64_t>(size) > bytes_left() / each) {
            fail(fmt::format("a list '{}' that fits into the file ({})", property.name, row_name()),
                 fmt::format("{} entries and {} bytes to the end of file", size, bytes_left()));
        }
        return size;
    }

    void skip(const Property& property) {
        const std::int64_t size = property.is_list ? list_size(property) : 1;
        for (std::int64_t i = 0; i < size; ++i) number(property.type);
    }

    void expect_end() {
        if (encoding_ == Encoding::text) {
            std::string_view line;
            while (lines_.next(line)) {
                if (line.find_first_not_of(" \t\v\f") != std::string_view::npos) {
                    fail("end of file after the rows that the header promises", quoted(line));
                }
            }
        } else if (byte_ != source_.text.size()) {
            fail("end of file after the rows that the header promises",
                 fmt::format("{} more bytes", source_.text.size() - byte_));
        }
    }

    [[nodiscard]] std::size_t bytes_left() const {
        return encoding_ == Encoding::text ? lines_.bytes_left() + rest_.size() : source_.text.size() - byte_;
    }

    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        if (encoding_ == Encoding::text) fail_line(source_, lines_.line_number(), expected, found);
        fail_byte(source_, byte_, expected, found);
    }

    [[nodiscard]] std::string row_name() const {
        return element_ == nullptr ? "the header" : fmt::format("{} {}", element_->name, row_);
    }

private:
    std::string_view word() {
        const std::string_view token = next_token(rest_);
        if (token.empty()) fail(fmt::format("more values for {}", row_name()), "end of line");
        return token;
    }

    std::uint64_t bits(std::size_t size) {
        if (source_.text.size() - byte_ < size) {
            fail(fmt::format("{} of {}", row_name(), element_->count),
                 fmt::format("end of file ({} bytes)", source_.text.size()));
        }
        const std::uint64_t value = word_of(source_.text.data() + byte_, size, encoding_ != Encoding::little);
        byte_ += size;
        return value;
    }

    const Source& source_;
    LineReader lines_;
    Encoding encoding_;
    std::size_t byte_;
    std::string_view rest_;
    const Element* element_ = nullptr;
    std::int64_t row_ = 0;
};

class PlyReader {
public:
    explicit PlyReader(const Source& source) : source_(source), lines_(source.text), builder_(source) {}

    Mesh read() {
        read_header();
        Body body(source_, lines_, header_.encoding);
        check_promises(body);
        for (const Element& element : header_.elements) {
            if (element.name == "vertex") {
                read_vertices(element, body);
            } else if (element.name == "face" || element.name == "tristrips") {
                read_faces(element, body);
            } else if (!element.properties.empty()) {
                for (std::int64_t row = 0; row < element.count; ++row) {
                    body.begin_row(element, row);
                    for (const Property& property : element.properties) body.skip(property);
                    body.end_row();
                }
            }
        }
        body.expect_end();
        return builder_.finish(header_.encoding == Encoding::text ? "ply-ascii" : "ply-binary");
    }

private:
    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        fail_line(source_, std::max<std::int64_t>(lines_.line_number(), 1), expected, found);
    }

    Type type_named(std::string_view name) const {
        for (const auto& [known, type] : type_names) {
            if (name == known) return type;
        }
        fail("a type (char uchar short ushort int uint float double, int8 … float64)", quoted(name));
    }

    void read_header() {
        std::string_view line;
        if (!lines_.next(line) || next_token(line) != "ply")
            fail("'ply'", lines_.line_number() == 0 ? "an empty file" : "another word");
        bool format_seen = false;
        for (;;) {
            if (!lines_.next(line)) fail("'end_header'", "end of file");
            const std::string_view keyword = next_token(line);
            if (keyword == "end_header") break;
            if (keyword.empty()) continue;
            if (keyword == "comment" || keyword == "obj_info") {
                builder_.read_unit(line);
            } else if (keyword == "format") {
                read_format(line);
                format_seen = true;
            } else if (keyword == "element") {
                read_element(line);
            } else if (keyword == "property") {
                read_property(line);
            } else {
                fail("'format', 'comment', 'element', 'property' or 'end_header'", quoted(keyword));
            }
        }
        if (!format_seen) fail("a line 'format …' in the header", "none");
        const bool has_vertices = std::any_of(header_.elements.begin(), header_.elements.end(),
                                              [](const Element& element) { return element.name == "vertex"; });
        if (!has_vertices) fail("an element 'vertex' in the header", "none");
    }

    void read_format(std::string_view rest) {
        const std::string_view name = next_token(rest);
        const std::string_view version = next_token(rest);
        if (name == "ascii") {
            header_.encoding = Encoding::text;
        } else if (name == "binary_little_endian") {
            header_.encoding = Encoding::little;
        } else if (name == "binary_big_endian") {
            header_.encoding = Encoding::big;
        } else {
            fail("'ascii', 'binary_little_endian' or 'binary_big_endian'", quoted(name));
        }
        if (version != "1.0") fail("version 1.0", quoted(version));
    }

    void read_element(std::string_view rest) {
        const std::string_view name = next_token(rest);
        const std::string_view count_word = next_token(rest);
        const std::optional<std::int64_t> count = parse_integer(count_word);
        if (name.empty()) fail("the name of an element", quoted(name));
        if (!count || *count < 0) fail(fmt::format("the number of rows of element '{}'", name), quoted(count_word));
        for (const Element& element : header_.elements) {
            if (element.name == name) fail("a new element", fmt::format("a second {}", quoted(name)));
        }
        header_.elements.push_back(
            {.name = std::string(name), .count = *count, .line = lines_.line_number(), .properties = {}});
    }

    void read_property(std::string_view rest) {
        if (header_.elements.empty()) fail("'element' before 'property'", "none");
        Property property;
        std::string_view word = next_token(rest);
        property.is_list = word == "list";
        if (property.is_list) {
            property.count_type = type_named(next_token(rest));
            if (!is_whole(property.count_type)) fail("a whole-number type for the length of a list", "a float type");
            word = next_token(rest);
        }
        property.type = type_named(word);
        property.name = std::string(next_token(rest));
        if (property.name.empty()) fail("the name of a property", "end of line");
        header_.elements.back().properties.push_back(std::move(property));
    }

    /// Refuses row counts that the file cannot hold before memory is taken.
    void check_promises(const Body& body) const {
        double least = header_.encoding == Encoding::text ? -1.0 : 0.0;  // the last line may lack its end
        for (const Element& element : header_.elements) {
            double row = 0.0;
            for (const Property& property : element.properties) {
                // A value and its separator; a list may be empty.
                row += header_.encoding == Encoding::text
                           ? 2.0
                           : static_cast<double>(size_of(property.is_list ? property.count_type : property.type));
            }
            least += row * static_cast<double>(element.count);
            if (least > static_cast<double>(body.bytes_left())) {
                fail_line(source_, element.line,
                          fmt::format("{} rows of element '{}' after the header", element.count, element.name),
                          fmt::format("only {} bytes", body.bytes_left()));
            }
            if (element.name == "vertex") {
                for (const char* axis : {"x", "y", "z"}) {
                    const int found = element.find(axis);
                    if (found < 0 || element.properties[static_cast<std::size_t>(found)].is_list) {
                        fail_line(source_, element.line, fmt::format("a property '{}' of element 'vertex'", axis),
                                  "none");
                    }
                }
            }
        }
    }

    void read_vertices(const Element& element, Body& body) {
        const std::array<int, 3> place{element.find("x"), element.find("y"), element.find("z")};
        builder_.reserve(static_cast<std::size_t>(element.count), 0);
        for (std::int64_t row = 0; row < element.count; ++row) {
            body.begin_row(element, row);
            std::array<double, 3> p{};
            for (std::size_t i = 0; i < element.properties.size(); ++i) {
                const Property& property = element.properties[i];
                const auto axis = std::find(place.begin(), place.end(), static_cast<int>(i));
                if (axis == place.end()) {
                    body.skip(property);
                } else {
                    p[static_cast<std::size_t>(axis - place.begin())] = body.coordinate(property.type);
                }
            }
            body.end_row();
            builder_.add_vertex(p[0], p[1], p[2]);
        }
    }

    void read_faces(const Element& element, Body& body) {
        const bool strips = element.name == "tristrips";
        int corners_at = element.find("vertex_indices");
        if (corners_at < 0) corners_at = element.find("vertex_index");
        if (corners_at < 0 && element.count == 0) return;
        const auto* corners_property =
            corners_at < 0 ? nullptr : &element.properties[static_cast<std::size_t>(corners_at)];
        if (corners_property == nullptr || !corners_property->is_list || !is_whole(corners_property->type)) {
            fail_line(
                source_, element.line,
                fmt::format("a list 'vertex_indices' or 'vertex_index' of whole numbers in element '{}'", element.name),
                "none");
        }
        for (std::int64_t row = 0; row < element.count; ++row) {
            body.begin_row(element, row);
            for (const Property& property : element.properties) {
                if (&property == corners_property) {
                    read_corners(property, body, strips);
                } else {
                    body.skip(property);
                }
            }
            body.end_row();
            if (!strips) builder_.add_polygon(corners_);
        }
    }

    void read_corners(const Property& property, Body& body, bool strips) {
        const std::int64_t vertices = vertex_total();
        const std::int64_t size = body.list_size(property);
        if (!strips && size < 3) {
            body.fail(fmt::format("at least 3 corners ({})", body.row_name()), std::to_string(size));
        }
        corners_.clear();
        for (std::int64_t i = 0; i < size; ++i) {
            const std::int64_t vertex = body.whole(property.type);
            if (strips && vertex == -1) {
                add_strip();
                continue;
            }
            if (vertex < 0 || vertex >= vertices) {
                body.fail(vertices == 0 ? std::string("no vertex number (the file has no vertices)")
                                        : fmt::format("a vertex number 0 to {} ({})", vertices - 1, body.row_name()),
                          std::to_string(vertex));
            }
            corners_.push_back(static_cast<Index>(vertex));
        }
        if (strips) add_strip();
    }

    /// Adds the triangles of one strip; every second one is turned to the orientation of the first.
    void add_strip() {
        for (std::size_t i = 2; i < corners_.size(); ++i) {
            const bool turned = i % 2 == 1;
            builder_.add_triangle(corners_[turned ? i - 1 : i - 2], corners_[turned ? i - 2 : i - 1], corners_[i]);
        }
        corners_.clear();
    }

    [[nodiscard]] std::int64_t vertex_total() const {
        for (const Element& element : header_.elements) {
            if (element.name == "vertex") return element.count;
        }
        return 0;
    }

    const Source& source_;
    LineReader lines_;
    MeshBuilder builder_;
    Header header_;
    std::vector<Index> corners_;
};

}  // namespace

Mesh read_ply(const Source& source) { return PlyReader(source).read(); }

}  // namespace trocar::mesh_text
