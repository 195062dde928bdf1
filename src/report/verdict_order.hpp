// In which order the rows of a verdict stand, and which are dominated: apart from the table, since this order is what
// a reader takes for the judgement.
#pragma once

#include <string>
#include <tuple>
#include <vector>

#include "report/verdict.hpp"

namespace trocar {

/// How wrong a closed loop was on one scene (m), at least 1 µm: the residual penetration, max. Where only
/// instruments and bones meet (I2I, I2R) that depth is the contact's own compliance; there it is how far at worst the
/// bodies are from the reference of equal stiffness, if there is one. NaN: no depth.
double error_on(const SceneResult& result, const std::string& pair_class);

/// Those of the scenes with, or without, a tissue body among what meets; with, where there is none: all of them.
std::vector<std::string> judged_scenes(const Results& results, const std::vector<std::string>& scenes, bool tissue);

/// What rows of responses are ordered by, in every table and sentence.
struct ResponseStanding {
    bool control = false;
    bool failed = false;              ///< on a scene
    bool not_run = false;             ///< on a scene
    double worst = not_known;         ///< m, residual penetration over the tissue scenes; where there is none, over all
    double median = not_known;        ///< m, over these scenes
    double total_p99_ns = not_known;  ///< ns, of the slowest of these scenes
};
using ResponseOrder = std::tuple<bool, bool, bool, double, double, double>;
/// Ascending: no controls, no failure, run everywhere, worst residual penetration, its median, slowest p99.
ResponseOrder response_order(const ResponseStanding& row);
/// For the note under a table.
inline constexpr const char* response_order_text =
    "Order: controls last, then rows that failed, rows not run everywhere, worst residual penetration, its median, "
    "tick p99, name.";

inline constexpr const char* detector_order_text = "Order: failed last, then false negatives and false positives, then time.";

bool have_depths(const std::vector<VerdictRow>& rows);

/// Error beside time in the chart and where rows are dominated: VerdictRow::error as printed where the table has
/// depths, else VerdictRow::wrong(); NaN = no answer. Rows with depths are not ordered by it.
double error_of(const VerdictRow& row, bool depth);

/// Sorts rows that were planned on the same scenes, responses by response_order, detectors by failures, pairs missed
/// and added, and time. Marks which move alike and which are dominated.
void compare_rows(const Results& results, const std::vector<std::string>& scenes, std::vector<VerdictRow>& rows);

}  // namespace trocar
