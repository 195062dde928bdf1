// Order and dominance of the rows of a verdict.
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

/// Scenes with, or without, tissue in their pair class; all scenes when none has tissue.
std::vector<std::string> judged_scenes(const Results& results, const std::vector<std::string>& scenes, bool tissue);

/// Sort key of responses in every table and sentence: controls last, failed, not run everywhere, maximum residual
/// penetration as printed, its median, p99; of the judged scenes.
using ResponseOrder = std::tuple<bool, bool, bool, double, double, double>;
ResponseOrder response_order(const VerdictRow& row, bool not_run);
/// Text for the note under a table.
inline constexpr const char* response_order_text =
    "Order: controls last, then rows that failed, rows not run everywhere, worst residual penetration, its median, "
    "tick p99, name.";

inline constexpr const char* detector_order_text =
    "Order: failed last, then false negatives and false positives, then time.";

bool have_depths(const std::vector<VerdictRow>& rows);

/// Error in the chart and for dominance: printed VerdictRow::error where the table has depths, else
/// VerdictRow::wrong(). NaN: unknown. It does not order rows with depths.
double error_of(const VerdictRow& row, bool depth);

/// Sorts rows planned on the same scenes. Responses use response_order; detectors use failures, false negatives and
/// positives, and time. Marks rows with identical motion and dominated rows.
void compare_rows(const Results& results, const std::vector<std::string>& scenes, std::vector<VerdictRow>& rows);

}  // namespace trocar
