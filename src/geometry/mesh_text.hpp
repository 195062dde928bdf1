// Shared parts of the mesh readers: iteration over lines, parsing of numbers without locale, messages of one line,
// construction of the mesh. Callers that want a mesh use mesh_file.hpp.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/mesh_file.hpp"

namespace trocar::mesh_text {

/// A file in memory. `text` is without a UTF-8 byte order mark.
struct Source {
    std::string name;       ///< as the user wrote it, for messages
    std::string_view text;  ///< all bytes
};

/// Token in quotes for a message: at most 40 characters, control characters escaped, "end of line" when empty.
std::string quoted(std::string_view token);

[[noreturn]] void fail_line(const Source& source, std::int64_t line, std::string_view expected, std::string_view found);
[[noreturn]] void fail_byte(const Source& source, std::size_t byte, std::string_view expected, std::string_view found);

/// Iterates over lines that end in LF, CRLF or CR; the last one may lack its end.
class LineReader {
public:
    explicit LineReader(std::string_view text) : text_(text) {}
    /// False at the end of the text.
    bool next(std::string_view& line);
    [[nodiscard]] std::int64_t line_number() const { return line_number_; }  ///< of the last line, from 1
    [[nodiscard]] std::size_t position() const { return position_; }         ///< byte behind the last line's end
    [[nodiscard]] std::size_t bytes_left() const { return text_.size() - position_; }

private:
    std::string_view text_;
    std::size_t position_ = 0;
    std::int64_t line_number_ = 0;
};

/// Removes and returns the next token of `rest` (separated by blanks and tabs); empty when there is none.
std::string_view next_token(std::string_view& rest);

/// The whole token as a decimal number, else empty. A + in front is allowed, overflow gives infinity, underflow zero.
std::optional<double> parse_double(std::string_view token);
std::optional<std::int64_t> parse_integer(std::string_view token);

/// The token as a finite number. Throws InputError with the line.
double finite_number(const Source& source, std::int64_t line, std::string_view token);

/// Equality that ignores the case of A to Z.
bool equal_without_case(std::string_view a, std::string_view b);

/// Unit in a text such as "units: mm" or "File units = meters"; empty when there is none.
std::string stated_unit(std::string_view comment);

/// Vertices and triangles in file order while the file is read. Throws InputError at the first vertex or triangle
/// beyond the limit (geometry/size_limits.hpp, and the range of Index).
class MeshBuilder {
public:
    explicit MeshBuilder(const Source& source);
    void reserve(std::size_t vertices, std::size_t triangles);
    void add_vertex(double x, double y, double z);
    /// Splits into a fan, in order. Precondition: at least three corners.
    void add_polygon(std::span<const Index> corners);
    void add_triangle(Index a, Index b, Index c);
    void read_unit(std::string_view comment);
    [[nodiscard]] std::int64_t vertex_count() const { return static_cast<std::int64_t>(coordinates_.size() / 3); }
    [[nodiscard]] std::int64_t triangle_count() const { return static_cast<std::int64_t>(corners_.size() / 3); }
    /// Moves the mesh out.
    Mesh finish(std::string format);

private:
    [[noreturn]] void refuse_size() const;

    const Source& source_;
    std::size_t most_coordinates_;  ///< larger sizes are refused at once
    std::size_t most_corners_;
    std::vector<double> coordinates_;
    std::vector<Index> corners_;
    std::string unit_;
};

Mesh read_obj(const Source& source);
Mesh read_stl(const Source& source);
Mesh read_ply(const Source& source);
Mesh read_off(const Source& source);
Mesh read_vrml(const Source& source);
Mesh read_vtk(const Source& source);
Mesh read_vtp(const Source& source);

}  // namespace trocar::mesh_text
