#include "report_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/document.hpp"

namespace trocar::bench {
namespace {

/// Median of copies; the library's own sorts, which is too slow for thousands of resamples.
double quick_median(std::vector<double> values) {
    if (values.empty()) return not_known;
    const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), half, values.end());
    if (values.size() % 2 == 1) return *half;
    return 0.5 * (*half + *std::max_element(values.begin(), half));
}

}  // namespace

std::vector<double> step_times(const MethodResult& row) {
    std::vector<double> times;
    for (std::size_t i = 0; i < row.step.size(); ++i) {
        times.push_back(us * static_cast<double>(row.update_ns[i] + row.detect_ns[i]));
    }
    return times;
}
std::vector<double> in_us(const std::vector<std::int64_t>& ns) {
    std::vector<double> times;
    times.reserve(ns.size());
    for (const std::int64_t value : ns) times.push_back(us * static_cast<double>(value));
    return times;
}
double median_time(const MethodResult& row) { return row.outcome.ok() ? median(step_times(row)) : not_known; }

Ratio ratio_of(const MethodResult& slow, const MethodResult& fast) {
    std::vector<double> a;
    std::vector<double> b;
    const std::vector<double> slow_times = step_times(slow);
    const std::vector<double> fast_times = step_times(fast);
    std::size_t j = 0;
    for (std::size_t i = 0; i < slow.step.size(); ++i) {
        while (j < fast.step.size() && fast.step[j] < slow.step[i]) ++j;
        if (j == fast.step.size()) break;
        if (fast.step[j] != slow.step[i]) continue;
        a.push_back(slow_times[i]);
        b.push_back(fast_times[j]);
    }
    Ratio ratio;
    if (a.empty() || !slow.outcome.ok() || !fast.outcome.ok()) return ratio;
    ratio.value = quick_median(a) / quick_median(b);
    constexpr std::int64_t neighbours = 8;
    constexpr int resamples = 400;
    if (a.size() >= 4) ratio.bounds = bootstrap_ratio({a}, {b}, quick_median, neighbours, 1, resamples);
    return ratio;
}

std::string ratio_text(const Ratio& ratio, double floor) {
    if (!ratio.known()) return "n/a";
    std::string text = format_number(ratio.value);
    if (std::fabs(std::log(ratio.value)) <= floor) text = "≈ " + text;
    if (std::isnan(ratio.bounds.low)) return text;
    return text + fmt::format(" [{}, {}]", format_number(ratio.bounds.low), format_number(ratio.bounds.high));
}

std::string time_text(double value) { return format_number(value); }

double memory_mb(const MethodResult& row) {
    const std::int64_t most = std::max(row.heap_bytes, row.resident_bytes);
    return most < 0 ? not_known : 1e-6 * static_cast<double>(most);
}

std::string pairs_text(const MethodResult& row) {
    if (!row.outcome.ok()) {
        return std::string(name_of(row.outcome.kind)) + (row.outcome.message.empty() ? "" : ": " + row.outcome.message);
    }
    if (row.exact()) return "exact";
    if (row.false_negatives == 0 && row.false_positives == 0) {
        return fmt::format("differs on {} of {} steps", row.differing_steps, row.step.size());
    }
    return fmt::format("misses {} and invents {} of {}", row.false_negatives, row.false_positives, row.true_pairs);
}

bool is_default(const MethodResult& row) {
    return row.label == row.method && row.method.find(':') == std::string::npos;
}
bool is_copy(const MethodResult& row) { return row.label.ends_with(" (again)"); }

const MethodResult* find_row(const CellRecord& cell, std::string_view label) {
    for (const MethodResult& row : cell.measurement.methods) {
        if (row.label == label && !row.step.empty()) return &row;
    }
    return nullptr;
}

}  // namespace trocar::bench
