// Texts of the cells of a table. A cell holds a value, in its place the reason why there is none, or the outcome of a
// run that failed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "contact/outcome.hpp"
#include "report/document.hpp"
#include "report/figures.hpp"

namespace trocar {

inline constexpr double us = 1.0e-3;  ///< ns to µs
inline constexpr double ms = 1.0e-6;  ///< ns to ms
inline constexpr double mm = 1.0e3;   ///< m to mm

/// The reason of a cell without a value that has no better one.
inline constexpr const char* unknown_text = "n/a";

/// The reason of a quantile.
inline constexpr const char* too_few = "n too small";

/// Three digits of a value; `unknown` in place of one that is not known.
std::string scaled(double value, double scale = 1.0, const char* unknown = unknown_text);
/// A whole number.
std::string count_text(double value);
/// "12.3 [11.9–12.8]"; no brackets for one process.
std::string estimate_text(const Estimate& interval, double scale, const char* unknown = unknown_text);
/// "0.12 / 3.40"; `unknown` where neither is known.
std::string two_text(double first, double second, double scale = 1.0, const char* unknown = unknown_text);
/// "3 of 1100"; n/a where one of them is not known.
std::string of_text(double part, double whole);
/// "1.000", "0.99987": a ratio below one never rounds to one.
std::string share_text(double part, double whole);
std::string yes_no(bool value);
/// The same for a metric that is 1 or 0.
std::string yes_no(double value, const char* unknown);
/// "timed_out (ended after the limit of 5 s)"
std::string outcome_text(const Outcome& outcome);
/// Appends a cell to the last row. The first row brings the columns; every row has the same ones, in the same order.
void add_cell(Table& table, const Column& column, std::string text);
/// The same for numbers.
void add_number(Table& table, std::string header, std::optional<Metric> metric, std::string text);
/// Cells that name a run that failed, with its outcome in place of figures.
TableRow failed_row(std::vector<std::string> cells, const Outcome& outcome, const Table& table);

/// Suffix of a depth, " (12 undecided)"; empty when the oracle decides all sides.
std::string undecided_text(double samples);
inline constexpr const char* undecided_note =
    "Undecided: sample points, most after a tick, whose side truth leaves open, since the rim of an open sheet is "
    "inside their body; no depth is taken of them.";

std::string code(const std::string& text);
std::string joined(const std::vector<std::string>& items, const char* separator = ", ");
/// "`a`, `b`"
std::string joined_code(const std::vector<std::string>& names, const char* separator = ", ");
/// "`penalty:k=1000` (tracked_proximity) by `implicit`"
std::string response_name(const Method& method);
/// Method name without parameters.
std::string method_name(const std::string& text);

}  // namespace trocar
