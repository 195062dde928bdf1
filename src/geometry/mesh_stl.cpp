// STL, binary and text. A binary file may begin with "solid" like a text file. Its size decides, since the facet count
// in the header determines it to the byte.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "geometry/binary_number.hpp"
#include "geometry/mesh_text.hpp"

namespace trocar::mesh_text {
namespace {

constexpr std::size_t header_bytes = 84;
constexpr std::size_t facet_bytes = 50;

std::uint32_t little_endian_u32(const char* bytes) { return static_cast<std::uint32_t>(word_of(bytes, 4, false)); }

/// Welds the facets read, which have three vertices each.
Mesh welded(MeshBuilder& builder, std::string format) {
    Mesh mesh = builder.finish(std::move(format));
    weld(mesh.vertices, mesh.triangles);
    return mesh;
}

Mesh read_binary(const Source& source) {
    const std::string_view text = source.text;
    if (text.size() < header_bytes) {
        fail_byte(source, text.size(), "an STL file: 'solid …' or at least 84 bytes",
                  fmt::format("{} bytes", text.size()));
    }
    const std::uint32_t facets = little_endian_u32(text.data() + 80);
    const std::uint64_t expected = header_bytes + facet_bytes * std::uint64_t{facets};
    if (text.size() != expected) {
        fail_byte(source, 80, fmt::format("{} bytes for the {} facets that the header promises", expected, facets),
                  fmt::format("{} bytes", text.size()));
    }
    MeshBuilder builder(source);
    builder.read_unit(text.substr(0, 80));
    builder.reserve(3 * std::size_t{facets}, facets);
    for (std::size_t facet = 0; facet < facets; ++facet) {
        const std::size_t corners_at = header_bytes + facet_bytes * facet + 12;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            std::array<double, 3> p{};
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const std::size_t at = corners_at + 12 * corner + 4 * axis;
                p[axis] = double{std::bit_cast<float>(little_endian_u32(text.data() + at))};
                if (!std::isfinite(p[axis])) {
                    fail_byte(source, at, fmt::format("a finite number (facet {}, corner {})", facet, corner),
                              fmt::format("{}", p[axis]));
                }
            }
            builder.add_vertex(p[0], p[1], p[2]);
        }
        const auto first = static_cast<Index>(3 * facet);
        builder.add_triangle(first, first + 1, first + 2);
    }
    return welded(builder, "stl-binary");
}

class TextReader {
public:
    explicit TextReader(const Source& source) : source_(source), lines_(source.text), builder_(source) {}

    Mesh read() {
        std::string_view word = token();
        do {
            if (!equal_without_case(word, "solid")) fail("'solid'", word);
            builder_.read_unit(rest_);
            rest_ = {};  // the name may contain any words
            for (word = token(); !equal_without_case(word, "endsolid"); word = token()) {
                if (equal_without_case(word, "end")) {  // some programs write it in two words
                    word = token();
                    if (!equal_without_case(word, "solid")) fail("'end solid'", word);
                    break;
                }
                if (!equal_without_case(word, "facet")) fail("'facet' or 'endsolid'", word);
                read_facet();
            }
            rest_ = {};
            word = token();
        } while (!word.empty());
        return welded(builder_, "stl-ascii");
    }

private:
    /// Next word of the file, empty at its end.
    std::string_view token() {
        for (;;) {
            const std::string_view word = next_token(rest_);
            if (!word.empty()) return word;
            if (!lines_.next(rest_)) return {};
        }
    }

    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        fail_line(source_, std::max<std::int64_t>(lines_.line_number(), 1), expected,
                  found.empty() ? std::string("end of file") : quoted(found));
    }

    void expect(std::string_view keyword) {
        const std::string_view word = token();
        if (!equal_without_case(word, keyword)) fail(fmt::format("'{}'", keyword), word);
    }

    double number() {
        const std::string_view word = token();
        const std::optional<double> value = parse_double(word);
        if (!value) fail("a number", word);
        return *value;
    }

    void read_facet() {
        expect("normal");
        // Redundant and therefore unused: exporters write nan for a facet without area.
        for (int axis = 0; axis < 3; ++axis) number();
        expect("outer");
        expect("loop");
        for (int corner = 0; corner < 3; ++corner) {
            expect("vertex");
            std::array<double, 3> p{};
            for (double& coordinate : p) {
                coordinate = number();
                if (!std::isfinite(coordinate)) {
                    fail_line(source_, lines_.line_number(), "a finite number", fmt::format("'{}'", coordinate));
                }
            }
            builder_.add_vertex(p[0], p[1], p[2]);
        }
        expect("endloop");
        expect("endfacet");
        const auto end = static_cast<Index>(builder_.vertex_count());
        builder_.add_triangle(end - 3, end - 2, end - 1);
    }

    const Source& source_;
    LineReader lines_;
    MeshBuilder builder_;
    std::string_view rest_;
};

bool size_matches_binary(std::string_view text) {
    return text.size() >= header_bytes &&
           text.size() == header_bytes + facet_bytes * std::uint64_t{little_endian_u32(text.data() + 80)};
}

bool resembles_text(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos || !equal_without_case(text.substr(first, 5), "solid")) return false;
    // Text has no control characters; the facet count and the floats of a binary file do.
    const std::string_view start = text.substr(0, 4096);
    return std::none_of(start.begin(), start.end(), [](char c) {
        return static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\n' && c != '\r' && c != '\v' && c != '\f';
    });
}

}  // namespace

Mesh read_stl(const Source& source) {
    if (!size_matches_binary(source.text) && resembles_text(source.text)) return TextReader(source).read();
    return read_binary(source);
}

}  // namespace trocar::mesh_text
