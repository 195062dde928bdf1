// VTK polydata: legacy files (text and binary) and XML files (.vtp: text, base64 and raw, plain or zlib). Polygons and
// triangle strips are read; vertices, lines and data arrays are passed over.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "geometry/binary_number.hpp"
#include "geometry/mesh_text.hpp"

namespace trocar::mesh_text {
namespace {

constexpr std::array<std::pair<std::string_view, BinaryType>, 26> vtk_types{{
    {"float", {4, 'f'}},        {"double", {8, 'f'}},         {"char", {1, 'i'}},          {"unsigned_char", {1, 'u'}},
    {"short", {2, 'i'}},        {"unsigned_short", {2, 'u'}}, {"int", {4, 'i'}},           {"unsigned_int", {4, 'u'}},
    {"long", {8, 'i'}},         {"unsigned_long", {8, 'u'}},  {"vtkIdType", {4, 'i'}},     {"vtktypeint32", {4, 'i'}},
    {"vtktypeint64", {8, 'i'}}, {"vtktypeuint32", {4, 'u'}},  {"vtktypeuint64", {8, 'u'}}, {"signed_char", {1, 'i'}},
    {"Float32", {4, 'f'}},      {"Float64", {8, 'f'}},        {"Int8", {1, 'i'}},          {"UInt8", {1, 'u'}},
    {"Int16", {2, 'i'}},        {"UInt16", {2, 'u'}},         {"Int32", {4, 'i'}},         {"UInt32", {4, 'u'}},
    {"Int64", {8, 'i'}},        {"UInt64", {8, 'u'}},
}};

/// Points and cells of both kinds of file.
class VtkReader {
public:
    explicit VtkReader(const Source& source) : source_(source), builder_(source) {}

protected:
    [[noreturn]] void fail(std::size_t byte, std::string_view expected, std::string_view found) const {
        fail_byte(source_, byte, expected, found);
    }
    [[nodiscard]] BinaryType type_named(std::string_view name, std::size_t byte) const {
        const auto found = std::find_if(vtk_types.begin(), vtk_types.end(),
                                        [name](const auto& one) { return equal_without_case(one.first, name); });
        if (found == vtk_types.end()) fail(byte, "a number type of VTK", quoted(name));
        return found->second;
    }
    void add_points(const std::vector<double>& numbers, std::size_t byte) {
        for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (!std::isfinite(numbers[i + axis])) {
                    fail(byte, fmt::format("finite coordinates (point {})", i / 3),
                         fmt::format("{}", numbers[i + axis]));
                }
            }
            builder_.add_vertex(numbers[i], numbers[i + 1], numbers[i + 2]);
        }
    }
    /// Cells that end at `ends` of the list of points, which are numbered from `first`.
    void add_cells(const std::vector<double>& points, const std::vector<double>& ends, bool strips, std::int64_t first,
                   std::size_t byte) {
        std::size_t begin = 0;
        for (std::size_t cell = 0; cell < ends.size(); ++cell) {
            const double end = ends[cell];
            if (!(end >= static_cast<double>(begin) && end <= static_cast<double>(points.size()))) {
                fail(byte, fmt::format("ascending ends of cells up to {}", points.size()), fmt::format("{}", end));
            }
            corners_.clear();
            for (; begin < static_cast<std::size_t>(end); ++begin) {
                const double number = points[begin];
                if (!(number >= 0.0 && number < static_cast<double>(builder_.vertex_count() - first))) {
                    fail(byte, fmt::format("point numbers 0 to {}", builder_.vertex_count() - first - 1),
                         fmt::format("{}", number));
                }
                corners_.push_back(static_cast<Index>(first + static_cast<std::int64_t>(number)));
            }
            if (corners_.size() < 3) {
                fail(byte, fmt::format("cells of at least 3 points (cell {})", cell), std::to_string(corners_.size()));
            }
            if (!strips) {
                builder_.add_polygon(corners_);
                continue;
            }
            for (std::size_t i = 2; i < corners_.size(); ++i) {
                const bool odd = i % 2 != 0;
                builder_.add_triangle(corners_[i - (odd ? 1 : 2)], corners_[i - (odd ? 2 : 1)], corners_[i]);
            }
        }
        if (begin != points.size()) fail(byte, fmt::format("cells of {} points", points.size()), std::to_string(begin));
    }

    const Source& source_;
    MeshBuilder builder_;

private:
    std::vector<Index> corners_;
};

// ---- legacy files ----

class LegacyVtkReader : VtkReader {
public:
    using VtkReader::VtkReader;

    Mesh read() {
        LineReader lines(source_.text);
        std::string_view line;
        if (!lines.next(line) || !line.starts_with("# vtk DataFile Version")) {
            fail(0, "'# vtk DataFile Version …'", quoted(line));
        }
        lines.next(line);  // the title
        if (lines.next(line)) at_ = lines.position() - line.size();
        const std::string_view encoding = next_token(line);
        binary_ = equal_without_case(encoding, "BINARY");
        if (!binary_ && !equal_without_case(encoding, "ASCII"))
            fail(lines.position(), "ASCII or BINARY", quoted(encoding));
        at_ = lines.position();
        for (std::string_view keyword = word(); !keyword.empty(); keyword = word()) {
            if (equal_without_case(keyword, "POINT_DATA") || equal_without_case(keyword, "CELL_DATA")) break;
            read_part(keyword);
        }
        if (!has_points_) fail(at_, "POINTS", "the end of the file");
        return builder_.finish(binary_ ? "vtk-binary" : "vtk-ascii");
    }

private:
    void read_part(std::string_view keyword) {
        const auto is = [keyword](std::string_view name) { return equal_without_case(keyword, name); };
        if (is("DATASET")) {
            if (const std::string_view kind = word(); !equal_without_case(kind, "POLYDATA")) {
                fail(at_, "DATASET POLYDATA", quoted(kind));
            }
        } else if (is("POINTS")) {
            const std::size_t count = size_of_part("points");
            const BinaryType type = type_named(word(), at_);
            has_points_ = true;
            const std::size_t begin = at_;
            add_points(numbers(3 * count, type), begin);
        } else if (is("POLYGONS") || is("TRIANGLE_STRIPS")) {
            read_cells(is("TRIANGLE_STRIPS"), true);
        } else if (is("VERTICES") || is("LINES")) {
            read_cells(false, false);
        } else if (is("METADATA")) {
            skip_metadata();
        } else if (is("FIELD")) {
            word();
            const std::size_t arrays = size_of_part("arrays");
            for (std::size_t i = 0; i < arrays; ++i) {
                std::string_view name = word();
                if (equal_without_case(name, "METADATA")) {
                    skip_metadata();
                    name = word();
                }
                const std::size_t components = size_of_part("components");
                const std::size_t tuples = size_of_part("tuples");
                numbers(components * tuples, type_named(word(), at_));
            }
        } else {
            fail(at_, "POINTS, POLYGONS, TRIANGLE_STRIPS, VERTICES, LINES, FIELD, POINT_DATA or CELL_DATA",
                 quoted(keyword));
        }
    }

    /// Old files have "cells numbers" and one list, in which the number of its points is before each cell; files from
    /// version 5 have "offsets points" and two lists.
    void read_cells(bool strips, bool wanted) {
        const std::size_t first = size_of_part("cells");
        const std::size_t second = size_of_part("numbers");
        const std::size_t begin = at_;
        std::vector<double> points;
        std::vector<double> ends;
        const std::size_t before = at_;
        if (equal_without_case(word(), "OFFSETS")) {
            ends = numbers(first, type_named(word(), at_));
            if (!ends.empty()) ends.erase(ends.begin());
            if (const std::string_view name = word(); !equal_without_case(name, "CONNECTIVITY")) {
                fail(at_, "CONNECTIVITY", quoted(name));
            }
            points = numbers(second, type_named(word(), at_));
        } else {
            at_ = before;
            const std::vector<double> list = numbers(second, type_named("int", at_));
            for (std::size_t i = 0; i < list.size();) {
                const double size = list[i++];
                if (!(size >= 0.0 && size <= static_cast<double>(list.size() - i))) {
                    fail(begin, "the number of a cell's points", fmt::format("{}", size));
                }
                for (const std::size_t end = i + static_cast<std::size_t>(size); i < end; ++i)
                    points.push_back(list[i]);
                ends.push_back(static_cast<double>(points.size()));
            }
            if (ends.size() != first) fail(begin, fmt::format("{} cells", first), std::to_string(ends.size()));
        }
        if (wanted) add_cells(points, ends, strips, 0, begin);
    }

    static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

    std::string_view word() {
        const std::string_view text = source_.text;
        while (at_ < text.size() && is_space(text[at_])) ++at_;
        const std::size_t begin = at_;
        while (at_ < text.size() && !is_space(text[at_])) ++at_;
        return text.substr(begin, at_ - begin);
    }

    std::size_t size_of_part(std::string_view what) {
        const std::string_view token = word();
        const std::optional<std::int64_t> count = parse_integer(token);
        // Every number takes a byte at least.
        if (!count || *count < 0 || *count > static_cast<std::int64_t>(source_.text.size())) {
            fail(at_, fmt::format("the number of {}, which the file can hold", what), quoted(token));
        }
        return static_cast<std::size_t>(*count);
    }

    std::vector<double> numbers(std::size_t count, BinaryType type) {
        std::vector<double> values;
        if (binary_) {
            const std::size_t line_end = source_.text.find('\n', at_);
            at_ = line_end == std::string_view::npos ? source_.text.size() : line_end + 1;
            if (count > (source_.text.size() - at_) / type.bytes) {
                fail(at_, fmt::format("{} numbers of {} bytes", count, type.bytes),
                     fmt::format("{} bytes", source_.text.size() - at_));
            }
            values.reserve(count);
            for (std::size_t i = 0; i < count; ++i, at_ += type.bytes) {
                values.push_back(real_of(source_.text.data() + at_, type, true));
            }
            return values;
        }
        values.reserve(std::min(count, source_.text.size()));
        for (std::size_t i = 0; i < count; ++i) {
            const std::string_view token = word();
            const std::optional<double> value = parse_double(token);
            if (!value)
                fail(at_, fmt::format("number {} of {}", i + 1, count),
                     token.empty() ? "the end of the file" : quoted(token));
            values.push_back(*value);
        }
        return values;
    }

    /// A block of text behind an array, up to an empty line.
    void skip_metadata() {
        LineReader lines(source_.text.substr(at_));
        std::string_view line;
        lines.next(line);
        while (lines.next(line) && !line.empty()) {
        }
        at_ += lines.position();
    }

    std::size_t at_ = 0;
    bool binary_ = false;
    bool has_points_ = false;
};

// ---- XML files ----

using Attributes = std::map<std::string, std::string, std::less<>>;

std::string attribute(const Attributes& attributes, std::string_view name) {
    const auto found = attributes.find(name);
    return found == attributes.end() ? std::string() : found->second;
}

struct XmlTag {
    std::string_view name;  ///< "/name" of an end
    Attributes attributes;
    std::size_t begin = 0;  ///< byte of '<'
    std::size_t end = 0;    ///< byte behind '>'
};

/// Bytes that a data array holds, unpacked from base64 where they are.
class EncodedBytes {
public:
    EncodedBytes(std::string_view text, bool base64) : text_(text), base64_(base64) {}
    /// The next `count` bytes; fewer at the end.
    std::string take(std::size_t count) {
        if (!base64_) {
            const std::string_view part = text_.substr(0, count);
            text_.remove_prefix(part.size());
            return std::string(part);
        }
        while (held_.size() < count && unpack_four()) {
        }
        std::string part = held_.substr(0, count);
        held_.erase(0, part.size());
        return part;
    }

private:
    static int digit(char c) {
        if (c >= 'A' && c <= 'Z') return c - 'A';
        if (c >= 'a' && c <= 'z') return c - 'a' + 26;
        if (c >= '0' && c <= '9') return c - '0' + 52;
        return c == '+' ? 62 : c == '/' ? 63 : -1;
    }
    /// Padding ends a part, not the whole: a header may be packed by itself.
    bool unpack_four() {
        std::uint32_t bits = 0;
        int digits = 0;
        int letters = 0;
        while (letters < 4 && !text_.empty()) {
            const char c = text_.front();
            const int value = digit(c);
            if (value < 0 && c != '=' && c != ' ' && c != '\n' && c != '\r' && c != '\t') return false;
            text_.remove_prefix(1);
            if (value < 0 && c != '=') continue;
            ++letters;
            bits = bits << 6U | static_cast<std::uint32_t>(std::max(value, 0));
            digits += value >= 0 ? 1 : 0;
        }
        if (letters < 4 || digits < 2) return false;
        for (int i = 0; i < digits - 1; ++i)
            held_ += static_cast<char>(bits >> (16U - 8U * static_cast<unsigned>(i)) & 255U);
        return true;
    }
    std::string_view text_;
    bool base64_;
    std::string held_;
};

class XmlVtkReader : VtkReader {
public:
    using VtkReader::VtkReader;

    Mesh read() {
        XmlTag tag;
        std::vector<Piece> pieces;
        std::string_view section;
        while (next(tag)) {
            if (tag.name == "VTKFile") {
                open(tag);
            } else if (tag.name == "Piece") {
                pieces.push_back({.points = count(tag, "NumberOfPoints"),
                                  .polygons = count(tag, "NumberOfPolys"),
                                  .strips = count(tag, "NumberOfStrips"),
                                  .arrays = {}});
            } else if (tag.name == "Points" || tag.name == "Polys" || tag.name == "Strips") {
                section = tag.name;
            } else if (tag.name == "AppendedData") {
                const std::size_t begin = source_.text.find('_', tag.end);
                if (begin == std::string_view::npos) fail(tag.end, "'_' before the appended data", "none");
                appended_ = source_.text.substr(begin + 1);
                appended_is_base64_ = attribute(tag.attributes, "encoding") == "base64";
                break;  // what follows may be any bytes
            } else if (tag.name == "DataArray" && !section.empty() && !pieces.empty()) {
                const std::string name = section == "Points" ? "points" : attribute(tag.attributes, "Name");
                pieces.back().arrays[std::string(section) + "/" + name] = tag;
            } else if (tag.name.starts_with('/') && tag.name.substr(1) == section) {
                section = {};
            }
        }
        if (!opened_) fail(0, "<VTKFile type=\"PolyData\">", "none");
        for (const Piece& piece : pieces) read_piece(piece);
        return builder_.finish("vtp");
    }

private:
    struct Piece {
        std::size_t points, polygons, strips;
        std::map<std::string, XmlTag> arrays;
    };

    void open(const XmlTag& tag) {
        opened_ = true;
        const auto expect = [&](std::string_view name, std::initializer_list<std::string_view> words) {
            std::string found = attribute(tag.attributes, name);
            if (std::find(words.begin(), words.end(), found) == words.end()) {
                fail(tag.begin, fmt::format("{}=\"{}\"", name, *words.begin()), mesh_text::quoted(found));
            }
            return found;
        };
        expect("type", {"PolyData"});
        big_endian_ = expect("byte_order", {"LittleEndian", "BigEndian"}) == "BigEndian";
        header_bytes_ = expect("header_type", {"UInt64", "UInt32", ""}) == "UInt64" ? 8 : 4;
        compressed_ = !expect("compressor", {"vtkZLibDataCompressor", ""}).empty();
    }

    void read_piece(const Piece& piece) {
        const std::int64_t first = builder_.vertex_count();
        builder_.reserve(static_cast<std::size_t>(first) + piece.points, 0);
        const auto array = [&](const std::string& name) -> const XmlTag& {
            const auto found = piece.arrays.find(name);
            if (found == piece.arrays.end()) fail(source_.text.size(), "a data array " + name, "none");
            return found->second;
        };
        if (piece.points > 0) {
            const XmlTag& points = array("Points/points");
            add_points(numbers(points, 3 * piece.points), points.begin);
        }
        for (const auto& [section, cells] : {std::pair{"Polys", piece.polygons}, std::pair{"Strips", piece.strips}}) {
            if (cells == 0) continue;
            const std::vector<double> ends = numbers(array(std::string(section) + "/offsets"), cells);
            const XmlTag& list = array(std::string(section) + "/connectivity");
            const double size = ends.back();
            if (!(size >= 0.0 && size <= static_cast<double>(most_connected))) {
                fail(list.begin, "a number of points of the cells", fmt::format("{}", size));
            }
            add_cells(numbers(list, static_cast<std::size_t>(size)), ends, section[0] == 'S', first, list.begin);
        }
    }

    std::size_t count(const XmlTag& tag, std::string_view name) const {
        const std::string text = attribute(tag.attributes, name);
        const std::optional<std::int64_t> value = text.empty() ? 0 : parse_integer(text);
        if (!value || *value < 0 || *value > most_connected) {
            fail(tag.begin, fmt::format("a count {}", name), mesh_text::quoted(text));
        }
        return static_cast<std::size_t>(*value);
    }

    /// The next start or end of an element; comments and declarations are passed over.
    bool next(XmlTag& tag) {
        const std::string_view text = source_.text;
        for (;;) {
            tag.begin = text.find('<', at_);
            if (tag.begin == std::string_view::npos) return false;
            const bool comment = text.substr(tag.begin).starts_with("<!--");
            const std::string_view closing = comment ? "-->" : ">";
            const std::size_t end = text.find(closing, tag.begin);
            if (end == std::string_view::npos) fail(tag.begin, "a whole element", "the end of the file");
            tag.end = at_ = end + closing.size();
            if (comment || text[tag.begin + 1] == '?' || text[tag.begin + 1] == '!') continue;
            std::string_view inside = text.substr(tag.begin + 1, end - tag.begin - 1);
            if (inside.ends_with('/')) inside.remove_suffix(1);
            const std::size_t name_end = std::min(inside.find_first_of(" \t\r\n"), inside.size());
            tag.name = inside.substr(0, name_end);
            tag.attributes.clear();
            inside.remove_prefix(name_end);
            for (std::size_t equals = inside.find('='); equals != std::string_view::npos; equals = inside.find('=')) {
                std::string_view name = inside.substr(0, equals);
                name.remove_prefix(std::min(name.find_first_not_of(" \t\r\n"), name.size()));
                const std::size_t begin = inside.find_first_of("\"'", equals);
                const std::size_t close =
                    begin == std::string_view::npos ? begin : inside.find(inside[begin], begin + 1);
                if (close == std::string_view::npos) fail(tag.begin, "attributes in quotes", quoted(inside));
                tag.attributes[std::string(name)] = std::string(inside.substr(begin + 1, close - begin - 1));
                inside.remove_prefix(close + 1);
            }
            return true;
        }
    }

    std::vector<double> numbers(const XmlTag& tag, std::size_t count) const {
        const BinaryType type = type_named(attribute(tag.attributes, "type"), tag.begin);
        const std::string format = attribute(tag.attributes, "format");
        std::vector<double> values;
        if (format == "appended") {
            const std::string offset = attribute(tag.attributes, "offset");
            const std::optional<std::int64_t> begin = parse_integer(offset);
            if (!begin || *begin < 0 || *begin > static_cast<std::int64_t>(appended_.size())) {
                fail(tag.begin, "an offset within the appended data", mesh_text::quoted(offset));
            }
            return decoded({appended_.substr(static_cast<std::size_t>(*begin)), appended_is_base64_}, tag, type, count);
        }
        const std::string_view text = source_.text.substr(tag.end, source_.text.find('<', tag.end) - tag.end);
        if (format == "binary") return decoded({text, true}, tag, type, count);
        LineReader lines(text);
        std::string_view line;
        while (lines.next(line)) {
            for (std::string_view token = next_token(line); !token.empty(); token = next_token(line)) {
                const std::optional<double> value = parse_double(token);
                if (!value) fail(tag.begin, "numbers", quoted(token));
                values.push_back(*value);
            }
        }
        if (values.size() != count) fail(tag.begin, fmt::format("{} numbers", count), std::to_string(values.size()));
        return values;
    }

    std::vector<double> decoded(EncodedBytes bytes, const XmlTag& tag, BinaryType type, std::size_t count) const {
        const std::size_t wanted = count * type.bytes;
        const auto word = [&] {
            const std::string text = bytes.take(header_bytes_);
            if (text.size() < header_bytes_) fail(tag.begin, "the whole array", "fewer bytes");
            return word_of(text.data(), header_bytes_, big_endian_);
        };
        const auto expect_size = [&](std::uint64_t size) {
            if (size != wanted) fail(tag.begin, fmt::format("{} bytes", wanted), std::to_string(size));
        };
        std::string data;
        if (!compressed_) {
            expect_size(word());
            data = bytes.take(wanted);
        } else if (const std::uint64_t blocks = word(); blocks > 0) {
            const std::uint64_t block = word();
            const std::uint64_t last = word();
            if (block > wanted + most_block || blocks > source_.text.size())
                fail(tag.begin, "the sizes of blocks", "larger ones");
            std::vector<std::uint64_t> packed(static_cast<std::size_t>(blocks));
            for (std::uint64_t& size : packed) size = word();
            expect_size((last > 0 ? blocks - 1 : blocks) * block + last);
            for (std::size_t i = 0; i < packed.size(); ++i) {
                const std::string part =
                    bytes.take(static_cast<std::size_t>(std::min<std::uint64_t>(packed[i], source_.text.size())));
                auto size = static_cast<uLongf>(i + 1 == packed.size() && last > 0 ? last : block);
                std::string unpacked(size, '\0');
                if (uncompress(reinterpret_cast<Bytef*>(unpacked.data()), &size,
                               reinterpret_cast<const Bytef*>(part.data()), part.size()) != Z_OK) {
                    fail(tag.begin, "zlib data", "a broken or truncated block");
                }
                unpacked.resize(size);
                data += unpacked;
            }
        }
        if (data.size() != wanted) {
            fail(tag.begin, fmt::format("{} bytes", wanted), std::to_string(data.size()));
        }
        std::vector<double> values;
        values.reserve(count);
        for (std::size_t i = 0; i < count; ++i)
            values.push_back(real_of(data.data() + i * type.bytes, type, big_endian_));
        return values;
    }

    static constexpr std::int64_t most_connected = std::int64_t{1} << 31;
    static constexpr std::uint64_t most_block = std::uint64_t{1} << 24;
    std::size_t at_ = 0;
    bool opened_ = false;
    bool big_endian_ = false;
    bool compressed_ = false;
    std::size_t header_bytes_ = 4;
    std::string_view appended_;
    bool appended_is_base64_ = false;
};

}  // namespace

Mesh read_vtk(const Source& source) { return LegacyVtkReader(source).read(); }

Mesh read_vtp(const Source& source) { return XmlVtkReader(source).read(); }

}  // namespace trocar::mesh_text
