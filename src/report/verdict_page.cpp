// What is printed of a verdict: its tables.
#include "report/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "report/chart.hpp"
#include "report/metric_table.hpp"
#include "report/verdict_order.hpp"

namespace trocar {
namespace {

std::string pairs_text(const VerdictRow& row) {
    const double truth = row.planned.sum(Metric::true_pairs);
    if (std::isnan(truth)) return unknown_text;
    return count_text(row.planned.sum(Metric::false_negatives)) + " / " +
           of_text(row.planned.sum(Metric::false_positives), truth) + cut_text(row.planned);
}

std::string left_text(const VerdictRow& row) {
    return two_text(row.residual_median(), row.residual_max(), mm) +
           undecided_text(row.ok.largest(Metric::side_undecided_max));
}

std::string forces_text(const VerdictRow& row, bool closed_loop) {
    const auto report = [&row](Metric error, Metric bound) {
        const auto [worst, within] = row.force_error(error, bound);
        return std::isnan(worst) && !std::isnan(within) ? "≤ " + scaled(within) : scaled(worst);
    };
    const std::string equal_k = report(Metric::force_error_rms_equal_k, Metric::force_bound_equal_k);
    const std::string hard = report(Metric::force_error_rms_hard, Metric::force_bound_hard);
    if (equal_k == unknown_text && hard == unknown_text) return closed_loop ? "no reference" : unknown_text;
    return equal_k + " / " + hard;
}

std::string failures_text(const VerdictRow& row) {
    std::string text = row.failed_runs == 0 ? "0" : fmt::format("{} of {} runs", row.failed_runs, row.planned.runs());
    if (row.ok.count() < row.planned.count())
        text += fmt::format(", {} of {} scenes ok", row.ok.count(), row.planned.count());
    return text;
}

/// "`ohc` + `penalty` (intersection)": parts of their own, so that a narrow page can break between them.
std::string who_text(const Method& method) {
    return code(method.detector) + (method.response.empty() ? "" : " + " + response_name(method));
}

std::string time_text(const VerdictRow& row, const Estimate& interval, bool is_p99) {
    if (row.ok.count() < row.planned.count()) return "fails";
    return estimate_text(interval, us, is_p99 && !std::isnan(row.p50.value) ? too_few : unknown_text);
}

std::string ratio_text(const VerdictRow& row, double noise_floor) {
    if (!std::isnan(row.ratio.value) && row.reference && row.method.contacts != "native") return "1";
    const bool equal = row.ratio.value <= noise_floor && row.ratio.value >= 1.0 / noise_floor;
    return (equal ? "≈ " : "") + estimate_text(row.ratio, 1.0);
}

bool searches_between(const std::vector<VerdictRow>& rows) {
    return std::any_of(rows.begin(), rows.end(),
                       [](const VerdictRow& row) { return !std::isnan(row.planned.sum(Metric::contact_events)); });
}

/// Number in the table of every row: those that move as an earlier one share its number.
std::vector<int> numbers_of(const std::vector<VerdictRow>& rows) {
    std::vector<int> numbers;
    numbers.reserve(rows.size());
    int next = 0;
    for (const VerdictRow& row : rows) {
        numbers.push_back(row.identical_to < 0 ? ++next : numbers[static_cast<std::size_t>(row.identical_to)]);
    }
    return numbers;
}

/// ", moving alike: `ohc` (70.9 / 163 µs)" for all rows that do; empty without any.
std::string twins_text(const std::vector<VerdictRow>& rows, std::size_t head) {
    std::vector<std::string> twins;
    const Method& first = rows[head].method;
    for (const VerdictRow& row : rows) {
        if (row.identical_to != static_cast<int>(head)) continue;
        const Method& twin = row.method;
        const bool by_detector_alone =
            twin.response == first.response && twin.contacts == first.contacts && twin.stepper == first.stepper;
        const std::string p50 = time_text(row, row.p50, false);
        const std::string p99 = time_text(row, row.p99, true);
        twins.push_back(
            fmt::format("{} ({} / {} µs)", by_detector_alone ? code(twin.detector) : who_text(twin), p50, p99));
    }
    return twins.empty() ? std::string() : fmt::format(", moving alike: {}", fmt::join(twins, ", "));
}

Table table_of(const std::vector<VerdictRow>& rows, bool closed_loop, const std::string& caption, double noise_floor,
               bool name_scenes) {
    Table table{.caption = caption};
    const bool between = searches_between(rows);
    const std::vector<int> numbers = numbers_of(rows);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const VerdictRow& row = rows[i];
        if (row.identical_to >= 0) continue;
        table.rows.push_back({.style = row.failed_runs > 0 ? TableRow::Style::failed
                                       : row.dominated     ? TableRow::Style::dominated
                                       : row.ours          ? TableRow::Style::own
                                                           : TableRow::Style::normal});
        add_number(table, "row", {}, std::to_string(numbers[i]));
        if (name_scenes) add_cell(table, {"scenes", false}, joined(row.scene_names()));
        add_cell(table, {.header = closed_loop ? "detector + response (contact generator)" : "detector", .wide = true},
                 who_text(row.method) + twins_text(rows, i));
        add_number(table, "false negatives / false positives of true pairs", Metric::false_negatives, pairs_text(row));
        if (between) add_number(table, "contacts between frames never reported", {}, between_text(row.planned));
        add_number(
            table, "depth error, median / worst (mm)", Metric::depth_error_max_m,
            two_text(row.ok.median(Metric::depth_error_median_m), row.ok.largest(Metric::depth_error_max_m), mm));
        add_number(table, "error over scenes (mm)", Metric::residual_penetration_max_m, scaled(row.error, mm));
        add_number(table, "residual penetration, median / worst (mm)", Metric::residual_penetration_median_m,
                   left_text(row));
        add_number(table, "tears", Metric::ruptures,
                   closed_loop ? count_text(row.ok.sum(Metric::ruptures)) : unknown_text);
        add_number(table, "force error, equal k / hard (N RMS)", Metric::force_error_rms_equal_k,
                   forces_text(row, closed_loop));
        add_number(table, "tick p50 (µs)", Metric::total_median_ns, time_text(row, row.p50, false));
        add_number(table, "tick p99 (µs)", Metric::total_p99_ns, time_text(row, row.p99, true));
        add_number(table, "ratio of medians", {}, ratio_text(row, noise_floor));
        add_number(table, "ticks over 1 ms", Metric::deadline_misses,
                   misses_text(row.planned, Metric::deadline_misses));
        add_number(table, "failures", {}, failures_text(row));
        if (row.ok.largest(Metric::side_undecided_max) > 0.0) table.note = undecided_note;
    }
    const std::string order =
        have_depths(rows)
            ? std::string(response_order_text) + " Residual penetration is of scenes with tissue, where there are any."
            : detector_order_text;
    table.note = table.note.empty() ? order : order + " " + table.note;
    return table;
}

}  // namespace

std::string cut_text(const ResultSet& results) {
    const double ticks = results.sum(Metric::truncated_ticks);
    return ticks > 0.0 ? ", cut in " + count_text(ticks) + " ticks" : std::string();
}

std::string between_text(const ResultSet& results) {
    return of_text(results.sum(Metric::contact_events_missed), results.sum(Metric::contact_events));
}

Table verdict_table(const Verdict& verdict, const std::string& caption, double noise_floor) {
    return table_of(verdict.rows, verdict.mode == "closed_loop", caption, noise_floor, false);
}

Table partial_table(const Verdict& verdict, const std::string& caption, double noise_floor) {
    Table table = table_of(verdict.partial, verdict.mode == "closed_loop", caption, noise_floor, true);
    table.folded = true;
    return table;
}

}  // namespace trocar
