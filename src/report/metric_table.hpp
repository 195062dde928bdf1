// A table of a report as data: the runs that it holds, its rows, and columns of metrics. docs/RECIPES.md has the recipe
// for a section.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "report/over_scenes.hpp"
#include "report/sections.hpp"

namespace trocar {

/// One column. It prints a metric, two metrics separated by " / ", or a text of its own.
struct MetricColumn {
    std::string header;                 ///< with the unit
    std::optional<Metric> metric = {};  ///< also the tooltip of the header
    std::optional<Metric> second = {};
    Processes processes = Processes::first;
    Over over = Over::largest;                               ///< scenes, and processes that stay apart
    double scale = 1.0;                                      ///< from the metric's unit to the header's
    bool count = false;                                      ///< whole numbers instead of three digits
    const char* unknown = unknown_text;                      ///< in place of a first metric that is not known
    std::function<std::string(const ResultSet&)> text = {};  ///< instead of the metrics
    bool words = false;                                      ///< of the text, left-aligned
};

/// One row, of one scene or several.
struct MetricRow {
    std::vector<std::string> names;  ///< its first cells
    ResultSet results = {};
    const Outcome* failure = nullptr;  ///< in place of figures
    bool no_figures = false;           ///< the names say why
    TableRow::Style style = TableRow::Style::normal;
    std::string command = {};
};

/// Appends the columns and rows to a table that has the columns of the names.
Table table_of(Table names, const std::vector<MetricColumn>& columns, const std::vector<MetricRow>& rows);

struct MetricTable {
    enum class Rows : std::uint8_t {
        scene_and_method,
        motion  ///< methods on one scene that move alike, bit by bit, stand in one row
    };
    std::string caption;
    std::string mode;  ///< RunSpec::mode of its runs
    Rows rows = Rows::scene_and_method;
    std::vector<MetricColumn> columns = {};
    std::string note = {};  ///< the order of the rows follows it
    bool folded = true;
    /// Runs that have a row among those that ended well; empty: all.
    std::function<bool(const RunFigures&)> keep = {};
};

/// Rows by scene in alphabetical order (motions: by class first), then by method. A run that did not end well has its
/// outcome in place of figures; a run that is not applicable has no row.
Table table_of(const Draft& draft, const MetricTable& content);

/// "3 of 1100": ticks that a metric counts among the timed ones, over all processes; n/a without a timed tick.
std::string misses_text(const ResultSet& results, Metric metric);

/// Median tick in µs; in its place the outcome of a run that failed.
std::string tick_text(const SceneResult& result);

// Columns, as they are common.
MetricColumn misses_column(const std::string& header, Metric metric);
/// In µs.
MetricColumn time_column(const std::string& header, Metric metric, Processes processes = Processes::interval,
                         const char* unknown = unknown_text);
/// Whole numbers.
MetricColumn count_column(const std::string& header, Metric metric, Processes processes = Processes::first,
                          Over over = Over::largest);
/// One metric of the first process.
MetricColumn value_column(const std::string& header, Metric metric, double scale = 1.0, Over over = Over::largest);
/// "a / b" of the first process.
MetricColumn two_column(const std::string& header, Metric metric, Metric second, const char* unknown = unknown_text);
/// A text on the first process of the row's first scene.
MetricColumn text_column(const std::string& header, Metric metric, std::string (*text)(const RunFigures&));
/// A text that no single metric is behind.
MetricColumn text_column(const std::string& header, std::function<std::string(const ResultSet&)> text,
                         bool words = false);

/// Adds the note on undecided sides to a table of the closed loop where a run of the study has such samples.
void note_undecided(const Draft& draft, Table& table);

}  // namespace trocar
