// A table of a report as data: the runs that it holds, its rows, and columns of metrics. docs/RECIPES.md has the recipe
// for a section.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "report/figures.hpp"
#include "report/sections.hpp"

namespace trocar {

/// How the processes of one run become one value.
enum class Processes : std::uint8_t {
    first,     ///< for metrics that no clock is in
    interval,  ///< median, with bounds (Estimate)
    highest
};

/// One column. It prints a metric, two metrics separated by " / ", or a text of its own.
struct MetricColumn {
    std::string header;  ///< with the unit
    Metric metric;       ///< also the tooltip of the header
    std::optional<Metric> second = {};
    Processes processes = Processes::first;
    double scale = 1.0;                                        ///< from the metric's unit to the header's
    bool count = false;                                        ///< whole numbers instead of three digits
    const char* unknown = "n/a";                               ///< in place of a first metric that is not known
    std::function<std::string(const SceneResult&)> text = {};  ///< instead of the metrics
};

struct MetricTable {
    enum class Rows : std::uint8_t {
        scene_and_method,
        motion  ///< methods on one scene that move alike, bit by bit, stand in one row
    };
    std::string caption;
    std::string mode;  ///< RunSpec::mode of its runs
    Rows rows = Rows::scene_and_method;
    std::vector<MetricColumn> columns;
    std::string note = {};
    bool folded = true;
    /// Runs that have a row among those that ended well; empty: all.
    std::function<bool(const SceneResult&)> keep = {};
};

/// Text of a column that reads the first process alone.
std::function<std::string(const SceneResult&)> of_first(std::string (*text)(const RunFigures&));

/// "3 of 1100": ticks that a metric counts among the timed ones, over all processes.
MetricColumn misses_column(const std::string& header, Metric metric);

/// Largest work of a tick over a median of the work.
MetricColumn work_ratio_column(const std::string& header, Metric usual = Metric::work_median);

/// Adds the note on undecided sides to a table of the closed loop where a run of the study has such samples.
void note_undecided(const Draft& draft, Table& table);

/// Rows by scene in alphabetical order (motions: by class first), then by method. A run that did not end well has its
/// outcome in place of figures; a run that is not applicable has no row.
Table table_of(const Draft& draft, const MetricTable& content);

}  // namespace trocar
