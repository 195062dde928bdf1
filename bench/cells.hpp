// Cells of the benchmark and the JSON line that stores a finished cell. A cell is one scene with all its methods. It
// has its own process, for clean memory and isolated crashes.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bounded.hpp"
#include "measurement.hpp"
#include "scenes.hpp"

namespace trocar::bench {

enum class Group : std::uint8_t {
    size,            ///< light and deep over N and M
    motion,          ///< near, far, rotating, strain
    multi,           ///< several tissues and instruments
    query_distance,  ///< every method twice: intersecting pairs only, and pairs within the query distance of closed
                     ///< loops
    local,           ///< a small part of the tissue moves; the frame lists the moved ranges
    order,           ///< vertex order as generated and shuffled
    settings,        ///< further settings: scalar code, common narrow phase, rebuilt trees …
    cell_size,       ///< sweep over the cell edge of ohc
    tuning,          ///< every setting of every library: default, recommended, best of a search
    bodies,          ///< sweep over the number of bodies
    bounded          ///< the slowest tick of a long run
};
std::string_view name_of(Group group);

/// Suffix of labels of group `query_distance` that are queried with a query distance; the others find intersecting
/// pairs only.
inline constexpr std::string_view within_query_distance = ", within the query distance";

struct CellSpec {
    std::string id;  ///< unique in a plan: "size: light 20k x 2k"
    Group group = Group::size;
    SceneSpec scene;
    Index bodies = 0;           ///< group bodies: number of bodies
    std::string bounded_scene;  ///< group bounded: scene name, used by the plan only
    bool quick = false;
    double budget_s = 0.5;
    std::int64_t most_steps = 160;  ///< group bounded: number of ticks with a pair of overlapping boxes
};

/// Cells in execution and report order.
std::vector<CellSpec> plan_cells(bool quick);

struct CellRecord {
    CellSpec spec;
    std::string binary;
    std::map<std::string, std::string> environment;
    Outcome outcome;
    std::vector<std::string> set_aside;  ///< methods that crashed or hung an earlier attempt: "label: reason"
    std::vector<Missing> missing;
    std::int64_t vertices = 0;
    std::int64_t triangles = 0;
    double tissue_edge = 0.0;     ///< m
    double query_distance = 0.0;  ///< query distance, m, for group `query_distance`
    double load_after = 0.0;      ///< load average of the last minute at the end of the cell
    CellMeasurement measurement;
    BoundedMeasurement bounded;  ///< group bounded
};

/// Measures the cell. `without`: labels to exclude. `now`: called with each label before it runs.
CellRecord run_cell(const CellSpec& spec, const std::vector<std::string>& without,
                    const std::function<void(const std::string&)>& now);

/// One JSON line without a newline.
std::string to_json_line(const CellRecord& record);
/// Throws InputError with file and line number.
CellRecord cell_from_json_line(const std::string& line, const std::string& file, std::int64_t line_number);

}  // namespace trocar::bench
