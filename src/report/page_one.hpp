// Page 1 of a report: a summary sentence, a table of detectors, a table of responses and a chart.
#pragma once

#include <string>
#include <vector>

#include "report/sections.hpp"

namespace trocar {

inline constexpr std::size_t page_one_rows = 10;
inline constexpr std::size_t page_one_columns = 8;

/// One response, with its settings, over all closed-loop scenes. Methods with bit-identical motion on every scene share
/// a row. The row shows the first one's name and times, and lists the others.
struct ResponseRow : VerdictRow {
    std::vector<Method> who;  ///< the first is shown
    std::string setting;      ///< "default", "recommended" or "tuned", as in the study
    int not_run = 0;          ///< scenes of the study where it was not planned or could not run
    /// The same response at other values that its author leaves open; these have no rows of their own.
    std::vector<ResponseRow> readings = {};
    [[nodiscard]] std::string response() const { return method_name(method.response); }
};

/// Rows over the closed-loop scenes with, or without, tissue; a study without tissue scenes uses all. Sorted by
/// response_order. Methods with a control detector are excluded.
std::vector<ResponseRow> response_rows(const Draft& draft, bool tissue = true);

/// Indices of the rows on page 1, ascending: the best setting of every response, then further rows, up to ten.
std::vector<std::size_t> rows_that_matter(const std::vector<ResponseRow>& rows);

/// The two rows of the summary sentence. `first` is the first row of `ours`; `other` is the first row of another
/// response that is no control, ran everywhere and never failed. Without `ours`, both are the first two such rows.
struct Headline {
    const ResponseRow* first = nullptr;
    const ResponseRow* other = nullptr;
    bool named = false;  ///< `first` is the study's `ours`
};
Headline headline_of(const std::vector<ResponseRow>& rows);

/// "Over N scenes `unilateral` left x mm at worst, the best other response y mm at z times the time; n failed."; empty
/// without a depth.
std::string response_sentence(const Draft& draft, const std::vector<ResponseRow>& rows);
/// Same for detectors on prescribed frames, in a study without responses.
std::string detector_sentence(const Verdict& verdict, const Draft& draft);

/// No rows when nothing was replayed.
Table detectors_table(const Draft& draft);
Table responses_table(const Draft& draft, const std::vector<ResponseRow>& rows, bool tissue = true);

/// The readings of all rows; no rows without any.
Table readings_table(const Draft& draft, const std::vector<ResponseRow>& rows);

/// "p99" or "p90".
const char* tail_name(Metric tail);
/// Tail of a tick against maximum depth, one line per method over its settings; failed rows are on a separate rail.
ScatterChart depth_against_time(const std::vector<ResponseRow>& rows, Metric tail = Metric::total_p99_ns);

/// Share of targets (scene and error limit) that the rows of page 1 meet over the time of a tick; no lines without a
/// target met. Error: residual penetration, max, on the judged scenes, over the tail of a tick
/// (Results::tail_metric); on prescribed frames the share of wrong pairs, over the median.
LineChart targets_over_time(const Draft& draft, const Verdict& overall);

/// The detector of most rows; a caption names it once.
std::string common_detector(const std::vector<ResponseRow>& rows);
/// The row in one word for a table: "`penalty:k=1000` (tracked_proximity)"; with its detector where `detector` is
/// another one.
std::string name_of_row(const ResponseRow& row, const std::string& detector);

}  // namespace trocar
