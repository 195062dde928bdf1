// Figures of a row of a benchmark cell: times, ratios with intervals, memory, correctness of the pair sets.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "cells.hpp"
#include "measure/statistics.hpp"

namespace trocar::bench {

inline constexpr double not_known = std::numeric_limits<double>::quiet_NaN();
inline constexpr double us = 1e-3;  // ns to µs
inline constexpr const char* main_cell = "size: light 20k x 2k";

std::vector<double> step_times(const MethodResult& row);  ///< µs
std::vector<double> in_us(const std::vector<std::int64_t>& ns);
/// µs per step; NaN for a failed row.
double median_time(const MethodResult& row);

struct Ratio {
    double value = not_known;
    Bounds bounds;
    [[nodiscard]] bool known() const { return !std::isnan(value); }
};

/// Time of `slow` relative to `fast`, over their common steps.
Ratio ratio_of(const MethodResult& slow, const MethodResult& fast);
/// Prefixed by ≈ where |log ratio| is within `floor`.
std::string ratio_text(const Ratio& ratio, double floor);
std::string time_text(double value);
double memory_mb(const MethodResult& row);
/// "exact", or the errors of the pair sets.
std::string pairs_text(const MethodResult& row);

bool is_default(const MethodResult& row);
bool is_copy(const MethodResult& row);

/// Null when the cell has no such row with steps.
const MethodResult* find_row(const CellRecord& cell, std::string_view label);

}  // namespace trocar::bench
