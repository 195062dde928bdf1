// Page 1 of a report: what a reader takes away in two minutes. One sentence, a table of detectors, a table of responses
// and a picture, each of at most ten rows and nine columns; everything else stands behind it.
#pragma once

#include <string>
#include <vector>

#include "report/sections.hpp"

namespace trocar {

inline constexpr std::size_t page_one_rows = 10;
inline constexpr std::size_t page_one_columns = 9;

/// One response, with its settings, over all scenes of the closed loop. Of several methods that moved alike, bit by
/// bit on every scene, the first is reported and names the others; times are the first one's.
struct ResponseRow {
    std::vector<Method> who;                      ///< the first is the one that is reported
    std::string setting;                          ///< "default", "recommended" or "tuned", as the study says
    bool ours = false;                            ///< the study names its response as `ours`
    bool control = false;                         ///< its response is there to hold the others to account
    double depth_median = not_known;              ///< m, median over scenes of the median over ticks
    double residual_penetration_max = not_known;  ///< m, of every scene and judged tick
    std::string worst_on;                         ///< scene of it
    double tears = not_known;                     ///< ruptures, summed over the scenes
    double force_without_touch_m = not_known;     ///< m, worst of every scene
    double force_error = not_known;               ///< N, against hard contact, RMS below 30 Hz, median over scenes
    double force_jump = not_known;                ///< N, worst of every scene, tick to tick
    double total_p99_ns = not_known;              ///< ns, of the slowest scene
    int runs = 0;
    int failed = 0;
    int not_run = 0;  ///< scenes of the study on which it was not planned, or could not be run
    [[nodiscard]] std::string method() const { return method_name(who.front().response); }
};

/// Over the closed-loop scenes with tissue, or over those without; where the study has none with tissue, both are the
/// latter. In response_order. Methods with a detector that is a control take no part.
std::vector<ResponseRow> response_rows(const Draft& draft, bool tissue = true);

/// Positions of the rows that page 1 shows, ascending: the best setting of every response, then the next rows, ten in
/// all.
std::vector<std::size_t> rows_that_matter(const std::vector<ResponseRow>& rows);

/// The two rows that the sentence speaks of. Where the study names a response as `ours`: its first row, and the first
/// row of another response that is no control, ran everywhere and failed nowhere. Else the first two such rows.
struct Headline {
    const ResponseRow* first = nullptr;
    const ResponseRow* other = nullptr;
    bool named = false;  ///< the study names the first one
};
Headline headline_of(const std::vector<ResponseRow>& rows);

/// "Over N scenes `unilateral` left x mm at worst, the best other response y mm at z times the time; n failed."; empty
/// without a depth.
std::string response_sentence(const Draft& draft, const std::vector<ResponseRow>& rows);
/// The same of detectors on replayed frames, for a study without responses.
std::string detector_sentence(const Verdict& verdict, const Draft& draft);

/// Without rows when nothing was replayed.
Table detectors_table(const Draft& draft);
Table responses_table(const Draft& draft, const std::vector<ResponseRow>& rows, bool tissue = true);

/// p99 tick against worst depth, a line per method over its settings; failed rows stand on a rail of their own.
ScatterChart depth_against_time(const std::vector<ResponseRow>& rows);

/// "`penalty:k=1000` (tracked_proximity) by `implicit`".
std::string response_name(const Method& who);

/// The row in one word for a table: "`penalty:k=1000` (tracked_proximity)"; with its detector where `detector` is another one.
std::string name_of_row(const ResponseRow& row, const std::string& detector);

}  // namespace trocar
