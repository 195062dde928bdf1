// What the benchmark measures, cell by cell, and the line that keeps a finished cell. A cell is one scene with all its
// methods; it runs in a process of its own, so that memory starts clean and a crash ends one cell only.
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
    query_distance,  ///< every method twice: meeting pairs, and all pairs within the query distance of closed loops
    local,           ///< a small part of the tissue moves and the frame says which
    order,           ///< vertex order as generated and shuffled
    settings,        ///< further settings: scalar code, common narrow phase, rebuilt trees …
    cell_size,       ///< sweep over the cell edge of ohc
    tuning,          ///< every setting of every library: default, recommended, best of a search
    bodies,          ///< sweep over the number of bodies
    bounded,         ///< the worst tick of a long run
    micro            ///< single stages by Google Benchmark
};
std::string_view name_of(Group group);

/// Ends the label of a method of group reach that is asked within it; the one without is asked for meeting pairs.
inline constexpr std::string_view within_query_distance = ", within the query distance";

struct CellSpec {
    std::string id;  ///< unique in a plan: "size: light 20k x 2k"
    Group group = Group::size;
    SceneSpec scene;
    Index bodies = 0;           ///< group bodies: how many
    std::string bounded_scene;  ///< group bounded: its name; known only to a plan
    bool quick = false;
    double budget_s = 0.5;
    std::int64_t most_steps = 160;  ///< group bounded: ticks with a pair of overlapping boxes
};

/// In the order in which they run and are reported.
std::vector<CellSpec> plan_cells(bool quick);

/// One stage measured alone.
struct MicroResult {
    std::string name;
    double ns = 0.0;         ///< per item
    std::int64_t items = 0;  ///< per call
};

struct CellRecord {
    CellSpec spec;
    std::string binary;
    std::map<std::string, std::string> environment;
    Outcome outcome;
    std::vector<std::string> set_aside;  ///< methods that crashed or hung an earlier attempt: "label: what happened"
    std::vector<Missing> missing;
    std::int64_t vertices = 0;
    std::int64_t triangles = 0;
    double tissue_edge = 0.0;     ///< m
    double query_distance = 0.0;  ///< m, group reach
    double load_after = 0.0;      ///< runnable processes, last minute, at the end of the cell
    CellMeasurement measurement;
    BoundedMeasurement bounded;  ///< group bounded
    std::vector<MicroResult> micro;
};

/// Measures. `without` are labels that shall not take part.
CellRecord run_cell(const CellSpec& spec, const std::vector<std::string>& without,
                    const std::function<void(const std::string&)>& now);

/// One JSON line without a newline.
std::string to_json_line(const CellRecord& record);
/// Throws InputError with file and line number.
CellRecord cell_from_json_line(const std::string& line, const std::string& file, std::int64_t line_number);

}  // namespace trocar::bench
