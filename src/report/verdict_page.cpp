// What is printed of a verdict: its tables and its chart.
#include "report/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "report/chart.hpp"
#include "report/sections.hpp"
#include "report/verdict_order.hpp"

namespace trocar {
namespace {

/// An answer that a limit cut is unknown, never free of contact: reported wherever missed pairs are.
std::string cut_text(const VerdictRow& row) {
    return row.truncated_ticks > 0.0 ? fmt::format(", cut in {:.0f} ticks", row.truncated_ticks) : std::string();
}

std::string pairs_text(const VerdictRow& row) {
    if (std::isnan(row.true_pairs)) return "n/a";
    return fmt::format("{:.0f} / {:.0f} of {:.0f}{}", row.false_negatives, row.false_positives, row.true_pairs,
                       cut_text(row));
}

std::string between_text(const VerdictRow& row) {
    if (std::isnan(row.contact_events)) return "n/a";
    return fmt::format("{:.0f} of {:.0f}", row.contact_events_missed, row.contact_events);
}

std::string two_numbers(double first, double second, double scale) {
    if (std::isnan(first) && std::isnan(second)) return "n/a";
    return format_number(first * scale) + " / " + format_number(second * scale);
}

std::string left_text(const VerdictRow& row) {
    return two_numbers(row.residual_penetration_median_m, row.residual_penetration_max_m, mm) +
           undecided_text(row.side_undecided_max);
}

std::string forces_text(const VerdictRow& row, bool closed_loop) {
    const auto report = [](double error, double within) {
        return std::isnan(error) && !std::isnan(within) ? "≤ " + format_number(within) : format_number(error);
    };
    const std::string equal_k = report(row.force_error_rms_equal_k, row.force_within_equal_k);
    const std::string hard = report(row.force_error_rms_hard, row.force_within_hard);
    const std::string unknown = format_number(not_known);
    if (equal_k == unknown && hard == unknown) return closed_loop ? "no reference" : "n/a";
    return equal_k + " / " + hard;
}

std::string failures_text(const VerdictRow& row) {
    std::string text = row.failed_runs == 0 ? "0" : fmt::format("{} of {} runs", row.failed_runs, row.runs);
    if (row.scenes_ok < row.scenes) text += fmt::format(", {} of {} scenes ok", row.scenes_ok, row.scenes);
    return text;
}

/// "`ohc` + `penalty` (intersection)": parts of their own, so that a narrow page can break between them.
std::string who_text(const Method& method) {
    std::string text = "`" + method.detector + "`";
    if (!method.response.empty()) text += " + `" + method.response + "`";
    if (method.mode == "closed_loop") text += " (" + method.contacts + ")";
    if (!method.stepper.empty()) text += " by `" + method.stepper + "`";
    return text;
}

std::string time_text(const VerdictRow& row, const Estimate& interval, bool is_p99) {
    if (row.scenes_ok < row.scenes) return "fails";
    if (std::isnan(interval.value)) return is_p99 && !std::isnan(row.p50.value) ? "n too small" : "n/a";
    return estimate_text(interval, us);
}

std::string ratio_text(const VerdictRow& row, double noise_floor) {
    if (std::isnan(row.ratio.value)) return "n/a";
    if (row.reference && row.method.contacts != "native") return "1";
    const bool equal = row.ratio.value <= noise_floor && row.ratio.value >= 1.0 / noise_floor;
    return (equal ? "≈ " : "") + estimate_text(row.ratio, 1.0);
}

bool searches_between(const std::vector<VerdictRow>& rows) {
    return std::any_of(rows.begin(), rows.end(), [](const VerdictRow& row) { return !std::isnan(row.contact_events); });
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
            fmt::format("{} ({} / {} µs)", by_detector_alone ? "`" + twin.detector + "`" : who_text(twin), p50, p99));
    }
    return twins.empty() ? std::string() : fmt::format(", moving alike: {}", fmt::join(twins, ", "));
}

Table table_of(const std::vector<VerdictRow>& rows, bool closed_loop, const std::string& caption, double noise_floor,
               bool name_scenes) {
    Table table;
    table.caption = caption;
    table.columns = {{"row", true},
                     {.header = closed_loop ? "detector + response (contact generator)" : "detector", .wide = true},
                     {"false negatives / false positives of true pairs", true, Metric::false_negatives},
                     {"depth error, median / worst (mm)", true, Metric::depth_error_max_m},
                     {"error over scenes (mm)", true, Metric::residual_penetration_max_m},
                     {"residual penetration, median / worst (mm)", true, Metric::residual_penetration_median_m},
                     {"tears", true, Metric::ruptures},
                     {"force error, equal k / hard (N RMS)", true, Metric::force_error_rms_equal_k},
                     {"tick p50 (µs)", true, Metric::total_median_ns},
                     {"tick p99 (µs)", true, Metric::total_p99_ns},
                     {"ratio of medians", true},
                     {"ticks over 1 ms", true, Metric::deadline_misses},
                     {"failures", true}};
    const bool between = searches_between(rows);
    if (between) table.columns.insert(table.columns.begin() + 3, {"contacts between frames never reported", true});
    if (name_scenes) table.columns.insert(table.columns.begin() + 1, {"scenes", false});
    const std::vector<int> numbers = numbers_of(rows);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const VerdictRow& row = rows[i];
        if (row.identical_to >= 0) continue;
        std::vector<std::string> cells{std::to_string(numbers[i])};
        if (name_scenes) cells.push_back(fmt::format("{}", fmt::join(row.scene_names, ", ")));
        std::vector<std::string> figures{who_text(row.method) + twins_text(rows, i),
                                         pairs_text(row),
                                         two_numbers(row.depth_error_median_m, row.depth_error_max_m, mm),
                                         std::isnan(row.error) ? "n/a" : format_number(row.error * mm),
                                         left_text(row),
                                         closed_loop ? count_text(row.tears) : "n/a",
                                         forces_text(row, closed_loop),
                                         time_text(row, row.p50, false),
                                         time_text(row, row.p99, true),
                                         ratio_text(row, noise_floor),
                                         fmt::format("{:.0f} of {:.0f}", row.deadline_misses, row.timed_ticks),
                                         failures_text(row)};
        if (between) figures.insert(figures.begin() + 2, between_text(row));
        cells.insert(cells.end(), figures.begin(), figures.end());
        table.rows.push_back({.cells = std::move(cells)});
        TableRow& printed = table.rows.back();
        if (row.failed_runs > 0) {
            printed.style = TableRow::Style::failed;
        } else if (row.dominated) {
            printed.style = TableRow::Style::dominated;
        } else if (row.ours) {
            printed.style = TableRow::Style::own;
        }
        if (row.side_undecided_max > 0.0) table.note = undecided_note;
    }
    const std::string order =
        have_depths(rows)
            ? std::string(response_order_text) + " Residual penetration is of scenes with tissue, where there are any."
            : detector_order_text;
    table.note = table.note.empty() ? order : order + " " + table.note;
    return table;
}

}  // namespace

std::string estimate_text(const Estimate& interval, double scale) {
    if (std::isnan(interval.value)) return "n/a";
    std::string text = format_number(interval.value * scale);
    if (interval.processes > 1) {
        text += fmt::format(" [{}–{}]", format_number(interval.low * scale), format_number(interval.high * scale));
    }
    return text;
}

Table verdict_table(const Verdict& verdict, const std::string& caption, double noise_floor) {
    return table_of(verdict.rows, verdict.mode == "closed_loop", caption, noise_floor, false);
}

Table partial_table(const Verdict& verdict, const std::string& caption, double noise_floor) {
    Table table = table_of(verdict.partial, verdict.mode == "closed_loop", caption, noise_floor, true);
    table.folded = true;
    return table;
}

ScatterChart verdict_chart(const Verdict& verdict) {
    const bool depth = verdict.error_is_depth();
    const bool p99 = std::all_of(verdict.rows.begin(), verdict.rows.end(), [](const VerdictRow& row) {
        return std::isnan(row.p50.value) || !std::isnan(row.p99.value);
    });
    struct Key {
        std::string detector;
        std::string response;
        std::string contacts;
        std::string stepper;
        auto operator<=>(const Key&) const = default;
    };
    std::map<Key, ChartSeries> series;
    std::map<std::string, int> colours;
    std::map<std::string, int> shapes;
    // Those of `ours` first, so that the first colours are the same in every study.
    int next = 0;
    for (const bool ours : {true, false}) {
        for (const VerdictRow& row : verdict.rows) {
            if (row.ours != ours) continue;
            if (colours.emplace(method_name(row.method.detector), next).second) ++next;
            shapes.emplace(row.method.response, 0);
        }
    }
    next = 0;
    for (auto& [name, shape] : shapes) shape = next++;

    ScatterChart chart;
    std::vector<std::pair<double, double>> all;
    const std::vector<int> numbers = numbers_of(verdict.rows);
    std::size_t next_row = 0;
    for (const VerdictRow& row : verdict.rows) {
        const int number = numbers[next_row++];
        const double error = error_of(row, depth);
        const double time = (p99 ? row.p99.value : row.p50.value) * us;
        if (std::isnan(error) || std::isnan(time)) continue;
        const Key key{method_name(row.method.detector), row.method.response, row.method.contacts,
                      row.method.stepper.empty() ? "" : method_name(row.method.stepper)};
        ChartSeries& one = series[key];
        one.style = {
            .colour = colours.at(key.detector), .shape = shapes.at(key.response), .hollow = key.contacts == "native"};
        one.name = key.detector + (key.response.empty() ? "" : " + " + key.response) +
                   (key.contacts == "native" ? " (native)" : "") + by_stepper(key.stepper);
        const double y = depth ? error * mm : error;
        one.points.push_back({.x = time,
                              .y = y,
                              .name = fmt::format("{}. {}: {} µs, {} {}", number, row.method.label(),
                                                  format_number(time), format_number(y), depth ? "mm" : "wrong"),
                              .label = std::to_string(number)});
        all.emplace_back(time, y);
    }
    for (auto& [key, one] : series) {
        std::sort(one.points.begin(), one.points.end(),
                  [](const ChartPoint& a, const ChartPoint& b) { return std::pair(a.x, a.y) < std::pair(b.x, b.y); });
        one.connected = one.points.size() > 1;
        chart.series.push_back(one);
    }
    std::sort(all.begin(), all.end());
    for (const auto& point : all) {
        if (chart.front.empty() || point.second < chart.front.back().second) chart.front.push_back(point);
    }
    chart.x_title = fmt::format("{} time per tick (µs, {})", p99 ? "p99" : "median",
                                verdict.scenes.size() == 1 ? verdict.scenes.front() : "geometric mean over scenes");
    chart.y_title = depth                            ? "error over scenes (mm)"
                    : searches_between(verdict.rows) ? "false negatives + false positives + contacts never reported"
                                                     : "false negatives + false positives";
    chart.x_limit = 1000.0;
    chart.x_limit_name = "1 ms";
    return chart;
}

}  // namespace trocar
