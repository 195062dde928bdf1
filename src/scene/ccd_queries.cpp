// Reads Sample-Queries of the continuous-collision-detection benchmark (Wang et al. 2021): 8 rows a query, each with
// three quotients and the answer.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include "geometry/input_error.hpp"
#include "geometry/mesh_text.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/whole_file.hpp"
#include "scene/external_frames.hpp"

namespace trocar {
namespace {

/// Rows of a query: four points at the start, the same four at the end.
constexpr std::size_t rows_of_query = 8;

struct QueryRow {
    Vector3 point = Vector3::Zero();
    bool collides = false;
};

QueryRow query_row(const mesh_text::Source& source, std::int64_t line, std::string_view text) {
    std::array<double, 7> numbers{};
    std::size_t count = 0;
    for (std::size_t begin = 0; begin <= text.size(); ++count) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        const double number = mesh_text::finite_number(source, line, text.substr(begin, end - begin));
        if (count < numbers.size()) numbers.at(count) = number;
        begin = end + 1;
    }
    if (count != numbers.size()) mesh_text::fail_line(source, line, "7 numbers", fmt::format("{}", count));
    QueryRow row;
    for (std::size_t i = 0; i < 3; ++i) {
        // Numerators are doubles times a power of two, so that the division is exact.
        row.point[static_cast<Eigen::Index>(i)] = numbers.at(2 * i) / numbers.at(2 * i + 1);
    }
    if (!row.point.allFinite()) mesh_text::fail_line(source, line, "finite quotients", mesh_text::quoted(text));
    if (numbers[6] != 0.0 && numbers[6] != 1.0) {
        mesh_text::fail_line(source, line, "0 or 1 as the answer", mesh_text::quoted(text));
    }
    row.collides = numbers[6] == 1.0;
    return row;
}

/// Points first to last as one triangle; the last one is repeated where there are fewer than three.
Mesh triangle_of(const Matrix3X& points, Index first, Index count) {
    Mesh mesh;
    mesh.vertices = points.middleCols(first, count);
    mesh.triangles.resize(3, 1);
    for (Index k = 0; k < 3; ++k) mesh.triangles(k, 0) = std::min(k, count - 1);
    return mesh;
}

}  // namespace

std::vector<ContinuousQuery> read_ccd_queries(const std::filesystem::path& file) {
    const std::string text = read_whole(file, "a file of continuous queries");
    const mesh_text::Source source{file.string(), text};
    const Index of_first = file.parent_path().filename() == "edge-edge" ? 2 : 1;
    std::vector<ContinuousQuery> queries;
    Matrix3X start(3, 4);
    Matrix3X end(3, 4);
    std::size_t row = 0;
    mesh_text::LineReader lines(source.text);
    for (std::string_view line; lines.next(line);) {
        if (line.empty()) continue;
        const QueryRow read = query_row(source, lines.line_number(), line);
        const auto point = static_cast<Eigen::Index>(row % 4);
        (row < 4 ? start : end).col(point) = read.point;
        if (++row < rows_of_query) continue;
        row = 0;
        ContinuousQuery query{
            .start = make_mesh_pair(triangle_of(start, 0, of_first), triangle_of(start, of_first, 4 - of_first)),
            .end = {},
            .collides = read.collides};
        query.end = query.start.frame;
        query.end.previous = query.end.position;
        query.end.position = end;
        query.end.velocity = end - query.end.previous;
        query.end.tick = 1;
        query.end.time = 1.0;
        if (are_sizes_limited() && queries.size() >= static_cast<std::size_t>(most_runs)) {
            throw InputError(source.name, "", limit_text(most_runs, "queries"), "more");
        }
        queries.push_back(std::move(query));
    }
    if (row != 0) throw InputError(source.name, "", "8 rows for each query", fmt::format("{} left over", row));
    return queries;
}

}  // namespace trocar
