// How large what a file asks for may be. A short file can ask for more than any machine holds; above these sizes, which
// leave room above everything that trocar is measured on, it is refused with the figure before memory is taken, unless
// its user says that he means it.
#pragma once

#include <cstdint>
#include <string>

namespace trocar {

/// Of a mesh file, of a scene (meshes and generated shapes together) and of a recording.
inline constexpr std::int64_t most_triangles = 2'000'000;
/// Of a mesh file; one without shared corners has three a triangle.
inline constexpr std::int64_t most_vertices = 3 * most_triangles;
/// Of a face of a mesh file.
inline constexpr std::int64_t most_corners = 100'000;
/// Of a scene and of a recording: every two of them may have to be examined.
inline constexpr std::int64_t most_bodies = 1000;
/// Of a body: each may be a file.
inline constexpr std::int64_t most_parts = 10'000;
/// Of a study.
inline constexpr std::int64_t most_runs = 100'000;
/// Of a run that is kept as a record, which has a row for each.
inline constexpr std::int64_t most_record_ticks = 400'000;
/// Of all records of a file together, which are read as a whole.
inline constexpr std::int64_t most_records_ticks = 1'000'000;
/// Of a file that is read as a whole, and of one in JSON, whose values take up to 36 times their text.
inline constexpr std::int64_t most_megabytes = 400;
inline constexpr std::int64_t most_json_megabytes = 24;
/// Of an object of JSON whose keys are kept in their order: each is compared with all before it.
inline constexpr std::int64_t most_ordered_keys = 1000;
/// Of a line of a file that is read line by line; most of them are JSON.
inline constexpr std::int64_t most_line_megabytes = most_json_megabytes;

/// False once `lift_size_limits` was called in this process or one that started it, or where TROCAR_LARGE=1 is set.
bool are_sizes_limited();
/// `--large`; for this process and those that it starts.
void lift_size_limits();
/// "at most 1000 bodies (--large lifts this)".
std::string limit_text(std::int64_t most, const std::string& of_what);

}  // namespace trocar
