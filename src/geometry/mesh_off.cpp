// OFF and its variants with colours, normals or texture coordinates, as text. Four-dimensional and binary variants are
// refused by name.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "geometry/mesh_text.hpp"

namespace trocar::mesh_text {
namespace {

class OffReader {
public:
    explicit OffReader(const Source& source) : source_(source), lines_(source.text), builder_(source) {}

    Mesh read() {
        std::string_view rest = content_line("'OFF'");
        std::string_view behind = rest;
        const std::string_view magic = next_token(behind);
        if (!parse_integer(magic)) {  // the keyword is optional, and the counts may follow it on the same line
            check_magic(magic);
            rest = behind;
            const std::string_view next = next_token(behind);
            if (next.empty()) rest = content_line("the counts of vertices and faces");
            if (next == "BINARY") fail("a text OFF file", "'BINARY'");
        }
        const std::int64_t vertices = count(rest, "the number of vertices");
        const std::int64_t faces = count(rest, "the number of faces");
        if (const std::string_view edges = next_token(rest); !edges.empty() && !parse_integer(edges)) {
            fail("the number of edges", quoted(edges));
        }
        if (const std::string_view more = next_token(rest); !more.empty()) fail("three counts", quoted(more));
        check_promise(vertices, faces);
        builder_.reserve(static_cast<std::size_t>(vertices), static_cast<std::size_t>(faces));
        for (std::int64_t i = 0; i < vertices; ++i) read_vertex(i, vertices);
        for (std::int64_t i = 0; i < faces; ++i) read_face(i, faces);
        std::string_view after;
        if (next_content(after)) {
            fail(fmt::format("nothing after the {} faces that the header promises", faces), quoted(after));
        }
        return builder_.finish("off");
    }

private:
    [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
        fail_line(source_, std::max<std::int64_t>(lines_.line_number(), 1), expected, found);
    }

    /// Next line with content; comments are cut off.
    bool next_content(std::string_view& line) {
        while (lines_.next(line)) {
            const std::size_t comment = line.find('#');
            if (comment != std::string_view::npos) {
                builder_.read_unit(line.substr(comment));
                line = line.substr(0, comment);
            }
            const std::size_t first = line.find_first_not_of(" \t\v\f");
            if (first == std::string_view::npos) continue;
            line.remove_prefix(first);
            return true;
        }
        return false;
    }

    std::string_view content_line(std::string_view expected) {
        std::string_view line;
        if (!next_content(line)) fail(expected, "end of file");
        return line;
    }

    void check_magic(std::string_view magic) const {
        std::string_view prefix = magic;
        if (!equal_without_case(magic.substr(magic.size() - std::min<std::size_t>(3, magic.size())), "OFF")) {
            fail("'OFF', 'COFF', 'NOFF', 'STOFF' or the counts", quoted(magic));
        }
        prefix.remove_suffix(3);
        if (prefix.find_first_of("4n") != std::string_view::npos) fail("OFF in three dimensions", quoted(magic));
        for (const std::string_view part : {"ST", "C", "N"}) {
            if (prefix.starts_with(part)) prefix.remove_prefix(part.size());
        }
        if (!prefix.empty()) fail("'OFF', 'COFF', 'NOFF', 'STOFF' or the counts", quoted(magic));
    }

    std::int64_t count(std::string_view& rest, std::string_view what) const {
        const std::string_view token = next_token(rest);
        const std::optional<std::int64_t> value = parse_integer(token);
        if (!value || *value < 0) fail(what, quoted(token));
        return *value;
    }

    /// Refuses counts that the remaining bytes cannot hold before memory is taken; shortest lines: "0 0 0\n", "3 0 1
    /// 2\n".
    void check_promise(std::int64_t vertices, std::int64_t faces) const {
        const double least = 6.0 * static_cast<double>(vertices) + 8.0 * static_cast<double>(faces) - 1.0;
        if (least > static_cast<double>(lines_.bytes_left())) {
            fail(fmt::format("{} vertices and {} faces after the header", vertices, faces),
                 fmt::format("only {} bytes", lines_.bytes_left()));
        }
    }

    void read_vertex(std::int64_t number, std::int64_t total) {
        std::string_view line;
        if (!next_content(line)) fail(fmt::format("vertex {} of {}", number, total), "end of file");
        std::array<double, 3> p{};
        for (double& coordinate : p) {
            const std::string_view token = next_token(line);
            if (token.empty()) fail(fmt::format("three coordinates of vertex {}", number), "fewer");
            coordinate = finite_number(source_, lines_.line_number(), token);
        }
        builder_.add_vertex(p[0], p[1], p[2]);
    }

    void read_face(std::int64_t number, std::int64_t total) {
        std::string_view line;
        if (!next_content(line)) fail(fmt::format("face {} of {}", number, total), "end of file");
        const std::string_view size_token = next_token(line);
        const std::optional<std::int64_t> size = parse_integer(size_token);
        if (!size) fail(fmt::format("the number of corners of face {}", number), quoted(size_token));
        if (*size < 3) fail(fmt::format("a face of at least 3 corners (face {})", number), std::to_string(*size));
        corners_.clear();
        for (std::int64_t i = 0; i < *size; ++i) {
            const std::string_view token = next_token(line);
            if (token.empty()) fail(fmt::format("{} corners of face {}", *size, number), std::to_string(i));
            const std::optional<std::int64_t> vertex = parse_integer(token);
            if (!vertex || *vertex < 0 || *vertex >= builder_.vertex_count()) {
                fail(builder_.vertex_count() == 0 ? "no vertex number (the file has no vertices)"
                                                  : fmt::format("a vertex number 0 to {}", builder_.vertex_count() - 1),
                     quoted(token));
            }
            corners_.push_back(static_cast<Index>(*vertex));
        }
        builder_.add_polygon(corners_);  // the rest of the line is a colour
    }

    const Source& source_;
    LineReader lines_;
    MeshBuilder builder_;
    std::vector<Index> corners_;
};

}  // namespace

Mesh read_off(const Source& source) { return OffReader(source).read(); }

}  // namespace trocar::mesh_text
