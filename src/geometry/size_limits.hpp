// Limits on sizes that an input file may request, far above all measured workloads. A larger request is refused with
// its size before memory is allocated, unless the user lifts the limits.
#pragma once

#include <cstdint>
#include <string>

namespace trocar {

/// Per mesh file, scene (meshes and generated shapes together) and recording.
inline constexpr std::int64_t most_triangles = 2'000'000;
/// Per mesh file; three per triangle when no corners are shared.
inline constexpr std::int64_t most_vertices = 3 * most_triangles;
/// Per face of a mesh file.
inline constexpr std::int64_t most_corners = 100'000;
/// Per scene and recording: every pair of them may be examined.
inline constexpr std::int64_t most_bodies = 1000;
/// Per body: each may be a file.
inline constexpr std::int64_t most_parts = 10'000;
/// Per study.
inline constexpr std::int64_t most_runs = 100'000;
/// Per run that is kept as a record, which has a row per tick.
inline constexpr std::int64_t most_record_ticks = 400'000;
/// Sum over all records of a file, which are read as a whole.
inline constexpr std::int64_t most_records_ticks = 1'000'000;
/// Per file that is read as a whole, and per JSON file, whose values take up to 36 times their text.
inline constexpr std::int64_t most_megabytes = 400;
inline constexpr std::int64_t most_json_megabytes = 24;
/// Per JSON object whose keys keep their order: each key is compared with all before it.
inline constexpr std::int64_t most_ordered_keys = 1000;
/// Per line of a file that is read line by line; most of them are JSON.
inline constexpr std::int64_t most_line_megabytes = most_json_megabytes;

/// False once `lift_size_limits` was called in this process or its parent, or where TROCAR_LARGE=1 is set.
bool are_sizes_limited();
/// Option `--large`; applies to this process and those that it starts.
void lift_size_limits();
/// "at most 1000 bodies (--large lifts this)".
std::string limit_text(std::int64_t most, const std::string& of_what);

}  // namespace trocar
