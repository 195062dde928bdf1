// Page 1 in words: its sentence and its two tables.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "measure/statistics.hpp"
#include "report/metric_table.hpp"
#include "report/page_one.hpp"
#include "report/reference_law.hpp"
#include "report/verdict_order.hpp"

namespace trocar {
namespace {

constexpr const char* failed_help =
    "Runs of the row that ended other than ok (failed, unstable, timed out, crashed) of all that it has";

std::string count_failed(int failed, int runs, int not_run) {
    std::string text = fmt::format("{} of {}", failed, runs);
    if (not_run > 0) text += fmt::format(", {} not run", not_run);
    return text;
}

std::vector<double> failed_as_infinite(const ResultSet& results, Metric metric) {
    return failed_as_infinite(results, [metric](const SceneResult& result) { return result.first(metric); });
}

/// mm, median over the scenes of the largest residual penetration.
double median_depth(const ResultSet& results) {
    return median(failed_as_infinite(results, Metric::residual_penetration_max_m)) * mm;
}

/// "0.350 [0.200–0.500]": median_depth with its rank interval.
std::string median_depth_text(const ResultSet& results) {
    const std::vector<double> depths = failed_as_infinite(results, Metric::residual_penetration_max_m);
    const Bounds bounds = median_bounds(depths);
    const std::string value = scaled(median(depths), mm);
    return std::isnan(bounds.low) ? value
                                  : fmt::format("{} [{}–{}]", value, scaled(bounds.low, mm), scaled(bounds.high, mm));
}

/// Of the largest value of each scene, in the metric's unit.
double largest(const ResultSet& results, Metric metric) { return known_largest(failed_as_infinite(results, metric)); }

/// "7.49, 1 tear": the largest residual penetration in mm, and ruptures.
std::string worst_depth_text(const ResultSet& results) {
    const double tears = results.ok().sum(Metric::ruptures);
    return scaled(largest(results, Metric::residual_penetration_max_m), mm) +
           (tears > 0.0 ? fmt::format(", {:.0f} tear{}", tears, tears == 1.0 ? "" : "s") : "");
}

/// The largest over the scenes of a run's largest force step over that of the reference with hard contact.
double step_ratio(const ResultSet& results) {
    return known_largest(failed_as_infinite(results, [](const SceneResult& result) {
        return result.first(Metric::force_jump_max_n) / result.first(Metric::reference_force_step_hard);
    }));
}

/// ms, tail of a tick on the slowest scene.
double slowest(const ResultSet& results, Metric tail) {
    return known_largest(
               failed_as_infinite(results, [tail](const SceneResult& result) { return result.of(tail).value; })) *
           ms;
}

/// A column of responses, with the number that ranges over readings are of.
struct ResponseColumn {
    MetricColumn column;
    std::function<double(const ResultSet&)> value;  ///< in the unit that is printed
    const char* unit = "";                          ///< behind a range
};

std::vector<ResponseColumn> response_columns(const Draft& draft) {
    const std::set<std::string> with_reference = scenes_with(draft.results, hard_law.force_bound);
    const Metric tail = draft.results.tail_metric();
    const auto number = [](const std::string& header, Metric metric,
                           const std::function<double(const ResultSet&)>& value) {
        return ResponseColumn{{.header = header,
                               .metric = metric,
                               .text = [value](const ResultSet& results) { return scaled(value(results)); }},
                              value};
    };
    return {{{.header = "residual penetration, median [95 %] (mm)",
              .metric = Metric::residual_penetration_max_m,
              .text = median_depth_text},
             median_depth},
            {{.header = "worst (mm)", .metric = Metric::residual_penetration_max_m, .text = worst_depth_text},
             [](const ResultSet& results) { return largest(results, Metric::residual_penetration_max_m) * mm; }},
            number("force without touch (mm)", Metric::force_without_touch_m,
                   [](const ResultSet& results) { return largest(results, Metric::force_without_touch_m) * mm; }),
            {{.header = "force within bound of N; else error (% of peak)",
              .metric = Metric::force_error_rms_hard,
              .text =
                  [with_reference](const ResultSet& results) {
                      return force_within_text(on_scenes(results, with_reference), hard_law);
                  }},
             [with_reference](const ResultSet& results) {
                 return force_share(on_scenes(results, with_reference), hard_law);
             },
             " %"},
            number("force step / reference's", Metric::force_jump_max_n, step_ratio),
            number(std::string("tick ") + tail_name(tail) + " (ms)", tail,
                   [tail](const ResultSet& results) { return slowest(results, tail); })};
}

/// Behind the name of a method that is written in Python: nobody compares its times.
std::string prototype_text(const Draft& draft, const Method& method, const char* kind) {
    return draft.results.fact(method, std::string(kind) + ".library") == "Python" ? ", a prototype in Python" : "";
}

/// " (3.90–7.00)": the range of a column over a response and its readings, on their scenes; empty without readings.
std::string range_text(const ResponseRow& row, const ResponseColumn& column) {
    if (row.readings.empty()) return {};
    const std::vector<std::string> scenes = row.readings.front().scene_names();
    std::vector<double> values{column.value(on_scenes(row.planned, {scenes.begin(), scenes.end()}))};
    for (const ResponseRow& reading : row.readings) values.push_back(column.value(reading.planned));
    std::erase_if(values, [](double value) { return std::isnan(value); });
    if (values.empty()) return {};
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    return fmt::format(" ({}–{}{})", scaled(*least), scaled(*most), column.unit);
}

/// A line per row, under the columns of page 1.
Table table_of_rows(const Draft& draft, std::string caption, const std::vector<const ResponseRow*>& rows,
                    const std::string& detector) {
    const std::vector<ResponseColumn> columns = response_columns(draft);
    std::vector<MetricColumn> plain;
    plain.reserve(columns.size());
    for (const ResponseColumn& column : columns) plain.push_back(column.column);
    std::vector<MetricRow> lines;
    lines.reserve(rows.size());
    for (const ResponseRow* row : rows) {
        lines.push_back({.names = {name_of_row(*row, detector) + prototype_text(draft, row->who.front(), "response")},
                         .results = row->planned,
                         .style = row->failed_runs > 0 ? TableRow::Style::failed
                                  : row->ours          ? TableRow::Style::own
                                                       : TableRow::Style::normal,
                         .command = run_command(draft, row->who.front())});
    }
    Table table{.caption = std::move(caption), .columns = {{.header = "response", .wide = true}}};
    table = table_of(std::move(table), plain, lines);
    table.columns.push_back({"failed of N", true, {}, failed_help});
    for (std::size_t i = 0; i < rows.size(); ++i) {
        std::vector<std::string>& cells = table.rows[i].cells;
        for (std::size_t k = 0; k < columns.size(); ++k) cells[k + 1] += range_text(*rows[i], columns[k]);
        cells.push_back(count_failed(rows[i]->failed_runs, rows[i]->planned.runs(), rows[i]->not_run));
    }
    return table;
}

std::string scenes_text(std::size_t count, const char* kind = "") {
    return fmt::format("{}{} scene{}", count, kind, count == 1 ? "" : "s");
}

/// "7 tissue scenes", or of a study without one "2 rigid scenes": those that response_rows() are over.
std::string judged_text(const Draft& draft, bool tissue) {
    const std::vector<std::string> scenes = judged_scenes(draft.results, draft.results.scenes("closed_loop"), tissue);
    const bool soft = !scenes.empty() && meets_tissue(draft.results.class_of(scenes.front()));
    return scenes_text(scenes.size(), soft ? " tissue" : " rigid");
}

/// Where the rows stand that page 1 has no room for.
std::string others_text(const std::vector<ResponseRow>& rows, const std::vector<std::size_t>& shown,
                        const std::string& detector) {
    std::vector<std::string> others;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        if (std::find(shown.begin(), shown.end(), i) != shown.end()) continue;
        const ResponseRow& row = rows[i];
        others.push_back(name_of_row(row, detector) + " " + scaled(row.residual_max(), mm) + " mm" +
                         (row.failed_runs > 0 ? fmt::format(", {} failed", row.failed_runs) : ""));
    }
    return others.empty() ? std::string() : fmt::format(" Not shown, at worst: {}.", fmt::join(others, "; "));
}

/// Replayed scenes that no response was run on, for whoever reads "every response on every scene".
std::string replayed_only(const Draft& draft) {
    const std::vector<std::string> closed = draft.results.scenes("closed_loop");
    std::vector<std::string> names;
    for (const std::string& scene : draft.results.scenes("replay")) {
        if (std::find(closed.begin(), closed.end(), scene) == closed.end()) names.push_back(scene);
    }
    return names.empty() ? std::string() : fmt::format(" Not run with responses, detectors only: {}.", joined(names));
}

/// The scenes of a row that was not run on all, or their number where there are many.
std::string only_text(const std::vector<std::string>& scenes) {
    constexpr std::size_t most_named = 3;
    return scenes.size() > most_named ? scenes_text(scenes.size()) : joined(scenes);
}

std::string ratio_header(const Draft& draft) {
    const int processes = draft.most_processes("replay");
    const std::string interval = processes >= processes_for_interval ? " [95 %]"
                                 : processes > 1                     ? fmt::format(" [min–max of {}]", processes)
                                                                     : "";
    return "time / " + code(draft.reference) + interval;
}

}  // namespace

std::string common_detector(const std::vector<ResponseRow>& rows) {
    std::map<std::string, int> count;
    for (const ResponseRow& row : rows) ++count[row.who.front().detector];
    const auto most =
        std::max_element(count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == count.end() ? std::string() : most->first;
}

std::string name_of_row(const ResponseRow& row, const std::string& detector) {
    std::vector<std::string> detectors;  // of those of the same response as the first
    std::vector<std::string> others;
    const auto add_new = [](std::vector<std::string>& list, const std::string& name) {
        if (std::find(list.begin(), list.end(), name) == list.end()) list.push_back(name);
    };
    const std::string first = response_name(row.who.front());
    for (const Method& who : row.who) {
        if (response_name(who) == first) {
            add_new(detectors, who.detector);
        } else {
            add_new(others, response_name(who));
        }
    }
    std::string text = first;
    if (row.setting != "default" && !row.setting.empty()) text += ", " + row.setting;
    if (detectors.size() > 1 || detectors.front() != detector) text += " with " + joined_code(detectors);
    if (!others.empty()) text += " = " + joined(others);
    return text;
}

std::string response_sentence(const Draft& draft, const std::vector<ResponseRow>& rows) {
    const auto [first, other, named] = headline_of(rows);
    if (first == nullptr) return {};
    const std::string detector = common_detector(rows);
    const auto name = [&](const ResponseRow& row) {
        const bool alone = std::none_of(rows.begin(), rows.end(), [&row](const ResponseRow& some) {
            return &some != &row && some.response() == row.response();
        });
        return alone ? code(row.who.front().response) : name_of_row(row, detector);
    };
    std::string text = fmt::format("Over {} {} left {} mm at worst", judged_text(draft, true), name(*first),
                                   scaled(first->residual_max(), mm));
    if (const double tears = first->ok.sum(Metric::ruptures); tears > 0.0) {
        const auto& results = first->ok.results;
        const auto worst =
            std::find_if(results.begin(), results.end(), [most = first->residual_max()](const SceneResult* result) {
                return result->first(Metric::residual_penetration_max_m) == most;
            });
        text += fmt::format(" (on {}; {:.0f} tear{} in all)", (*worst)->scene(), tears, tears == 1.0 ? "" : "s");
    }
    if (other != nullptr) {
        text += fmt::format(", {}, {}, {} mm", named ? "the best other response" : "the next", name(*other),
                            scaled(other->residual_max(), mm));
        const double ratio = other->slowest_tick / first->slowest_tick;
        if (!std::isnan(ratio)) text += fmt::format(" at {} times the time", format_number(ratio));
    }
    int failed = 0;
    int runs = 0;
    for (const ResponseRow& row : rows) {
        failed += row.failed_runs;
        runs += row.planned.runs();
        for (const ResponseRow& reading : row.readings) {
            failed += reading.failed_runs;
            runs += reading.planned.runs();
        }
    }
    return text + fmt::format("; {} of {} runs failed.", failed, runs);
}

std::string detector_sentence(const Verdict& verdict, const Draft& draft) {
    std::vector<const VerdictRow*> ranked;
    int failed = 0;
    int runs = 0;
    for (const VerdictRow& row : verdict.rows) {
        if (row.control) continue;
        failed += row.failed_runs;
        runs += row.planned.runs();
        if (row.failed_runs == 0 && !std::isnan(row.p50.value) && !std::isnan(row.wrong())) ranked.push_back(&row);
    }
    if (ranked.empty()) return {};
    const auto report = [](const VerdictRow& row) {
        const ResultSet& on = row.planned;
        std::string reported = fmt::format("{} missed {} and added {} pairs", code(row.method.detector),
                                           count_text(on.sum(Metric::false_negatives)),
                                           of_text(on.sum(Metric::false_positives), on.sum(Metric::true_pairs)));
        if (const std::string between = between_text(on); between != unknown_text)
            reported += fmt::format(" and missed {} contacts between frames", between);
        return reported;
    };
    std::string text =
        fmt::format("Over {} {}", scenes_text(draft.results.scenes("replay").size()), report(*ranked.front()));
    if (ranked.size() > 1) {
        text += fmt::format(", the next, {}, at {} times the time", report(*ranked[1]),
                            format_number(ranked[1]->p50.value / ranked[0]->p50.value));
    }
    return text + fmt::format("; {} of {} runs failed.", failed, runs);
}

Table detectors_table(const Draft& draft) {
    Table table;
    const std::vector<std::string> scenes = draft.results.scenes("replay");
    if (scenes.empty()) return table;
    const Verdict verdict = make_verdict(draft.results, draft.reference, "replay", scenes);
    std::vector<const VerdictRow*> rows;
    for (const VerdictRow& row : verdict.rows) rows.push_back(&row);
    for (const VerdictRow& row : verdict.partial) rows.push_back(&row);
    std::erase_if(rows, [](const VerdictRow* row) { return row->control; });
    const bool between = std::any_of(rows.begin(), rows.end(),
                                     [](const VerdictRow* row) { return between_text(row->planned) != unknown_text; });
    table.caption = fmt::format("Detectors on the same frames, {}", scenes_text(verdict.scenes.size()));
    std::vector<std::string> left_out;
    for (const VerdictRow* row : rows) {
        const std::string name = code(row->method.detector) + prototype_text(draft, row->method, "detector");
        if (table.rows.size() == page_one_rows) {
            left_out.push_back(name);
            continue;
        }
        table.rows.push_back({});
        const ResultSet& planned = row->planned;
        const bool everywhere = planned.count() == verdict.scenes.size();
        const bool fails = row->failed_runs > 0;
        const auto time = [&](const Estimate& estimate) {
            return scaled(everywhere && !fails ? estimate.value : not_known, us);
        };
        add_cell(table, {.header = "detector", .wide = true},
                 everywhere ? name : name + " (" + only_text(row->scene_names()) + " only)");
        const double truth = planned.sum(Metric::true_pairs);
        add_number(table, "false negatives of N", Metric::false_negatives,
                   of_text(planned.sum(Metric::false_negatives), truth) + (std::isnan(truth) ? "" : cut_text(planned)));
        add_number(table, "false positives", Metric::false_positives, count_text(planned.sum(Metric::false_positives)));
        if (between)
            add_number(table, "missed between frames, of N", Metric::contact_events_missed, between_text(planned));
        add_number(table, "µs p50", Metric::total_median_ns, time(row->p50));
        add_number(table, "µs p99", Metric::total_p99_ns, time(row->p99));
        if (!draft.reference.empty())
            add_number(table, ratio_header(draft), Metric::total_median_ns,
                       estimate_text(fails ? Estimate{} : row->ratio, 1.0));
        add_cell(
            table, {"failed", true, {}, failed_help},
            count_failed(row->failed_runs, planned.runs(), static_cast<int>(verdict.scenes.size() - planned.count())));
        if (fails) table.rows.back().style = TableRow::Style::failed;
    }
    table.note = std::string(detector_order_text) + " Times over scenes are geometric means.";
    if (const std::int64_t stride = draft.widest_stride("replay"); stride > 1) {
        table.note += fmt::format(" Pairs were judged on every {}th tick only.", stride);
    }
    if (left_out.size() > page_one_rows) {
        table.note += fmt::format(" Behind these: {} more.", left_out.size());
    } else if (!left_out.empty()) {
        table.note += " Behind these: " + joined(left_out) + ".";
    }
    return table;
}

Table responses_table(const Draft& draft, const std::vector<ResponseRow>& rows, bool tissue) {
    Table table;
    if (rows.empty()) return table;
    const std::string detector = common_detector(rows);
    const std::vector<std::size_t> shown = rows_that_matter(rows);
    std::vector<const ResponseRow*> lines;
    bool ranges = false;
    for (const std::size_t i : shown) {
        lines.push_back(&rows[i]);
        ranges = ranges || !rows[i].readings.empty();
    }
    table = table_of_rows(draft, fmt::format("Responses, {}, with {}", judged_text(draft, tissue), code(detector)),
                          lines, detector);
    const std::int64_t stride = draft.widest_stride("closed_loop");
    table.note =
        std::string(response_order_text) +
        " Residual penetration: the largest of each scene, then median over the scenes with the interval of its ranks, "
        "and worst; a failed run is infinite. Force: scenes within the bound of the reference with hard contact, of "
        "those "
        "that have one; on the others the median error. Force step: the largest over that of the reference. The tick "
        "is of "
        "the slowest scene. Force without touch: the largest clearance in a tick with contact force; n/a where a "
        "method's forces are not known by pair. " +
        (stride > 1 ? fmt::format("Depths were judged on every {}th tick only.", stride)
                    : std::string("Depths are of every tick.")) +
        (ranges
             ? " In parentheses: least and most over the values that an author leaves open; of the force, the median "
               "error over all scenes."
             : "") +
        others_text(rows, shown, detector) + replayed_only(draft);
    return table;
}

Table readings_table(const Draft& draft, const std::vector<ResponseRow>& rows) {
    std::vector<const ResponseRow*> lines;
    for (const ResponseRow& row : rows) {
        for (const ResponseRow& reading : row.readings) lines.push_back(&reading);
    }
    if (lines.empty()) return {};
    Table table =
        table_of_rows(draft, "Responses at other values that their authors leave open", lines, common_detector(rows));
    table.note =
        "Columns as on page 1. None of these values is searched or recommended; they are there to show how much "
        "hangs on them.";
    return table;
}

}  // namespace trocar
