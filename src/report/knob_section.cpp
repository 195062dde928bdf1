#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "measure/statistics.hpp"
#include "report/chart.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

std::string number_or_not(double value, double scale) {
    return std::isnan(value) ? std::string("n/a") : format_number(value * scale);
}

/// One figure of several processes of the same run.
Estimate figure_of(const std::vector<const Record*>& runs, const char* key) {
    std::vector<double> values;
    for (const Record* run : runs) values.push_back(summary_of(*run, key));
    return across_processes(values);
}

bool all_ok(const std::vector<const Record*>& runs) {
    return std::all_of(runs.begin(), runs.end(), [](const Record* run) { return run->outcome.ok(); });
}

/// The method without the parameter that the knob turns, so that all points of a curve have the same name.
std::string without_parameter(const std::string& method, const std::string& key) {
    const std::size_t at = method.find(key + "=");
    if (key.empty() || at == std::string::npos) return method;
    const std::size_t end = std::min(method.find(',', at), method.size());
    std::string rest = method.substr(0, at) + (end < method.size() ? method.substr(end + 1) : std::string());
    while (!rest.empty() && (rest.back() == ',' || rest.back() == ':')) rest.pop_back();
    return rest;
}

/// Numbers in their order, words behind them.
struct Point {
    std::string text;
    [[nodiscard]] double number() const {
        double value = 0.0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        return error == std::errc() && end == text.data() + text.size() ? value : HUGE_VAL;
    }
    bool operator<(const Point& other) const {
        return number() != other.number() ? number() < other.number() : text < other.text;
    }
};

using Curve = std::map<Point, std::vector<const Record*>>;

struct Mark {
    std::string curve = {};
    std::string point = {};
    double time = not_known;   ///< µs of computing per simulated ms
    double error = not_known;  ///< mm, or pairs
    std::string force = {};    ///< N, equal k / hard
    std::string outcome = {};
    bool dominated = false;
};

struct Chart {
    bool replay = false;
    std::map<std::string, Curve> curves;
};

std::string unit_of(const std::string& knob) {
    if (knob == "dt") return " s";
    if (knob == "k") return " N/m";
    return "";
}

}  // namespace

void add_paced(Draft& draft) {
    std::map<std::pair<std::string, std::string>, std::vector<const Record*>> runs;
    for (const Record& record : draft.records) {
        const RunSpec& spec = record.spec;
        if (spec.mode != "paced" || record.outcome.kind == OutcomeKind::absent ||
            record.outcome.kind == OutcomeKind::unsupported) {
            continue;
        }
        runs[{spec.scene, spec.detector + " + " + spec.response}].push_back(&record);
    }
    if (runs.empty()) return;
    Table table;
    table.caption = "Paced loop: one tick released per millisecond, timed from its scheduled release";
    table.columns = {{"scene", false},
                     {"detector + response", false},
                     {"n per process (ticks)", true},
                     {"sub-steps per tick", true},
                     {"p50 (µs)", true},
                     {"p99 (µs)", true},
                     {"p99.9 (µs)", true},
                     {"max (µs)", true},
                     {"deadline misses", true},
                     {"longest burst (ticks)", true},
                     {"empty loop: p50 / p99 / max (µs)", true},
                     {"empty loop: misses", true}};
    for (const char* stage : stage_names) table.columns.push_back({std::string(stage) + ", p50 / p99 (µs)", true});
    for (const auto& [key, processes] : runs) {
        std::vector<std::string> cells{key.first, code(key.second)};
        if (!all_ok(processes)) {
            for (const Record* run : processes) {
                if (run->outcome.ok()) continue;
                cells.push_back(outcome_text(run->outcome));
                break;
            }
            cells.resize(table.columns.size());
            table.rows.push_back({.cells = std::move(cells), .style = TableRow::Style::failed});
            continue;
        }
        const auto tail = [&processes](const char* name) {
            const Estimate estimate = figure_of(processes, name);
            return std::isnan(estimate.value) ? std::string("n too small") : estimate_text(estimate, us);
        };
        const auto worst = [&processes](const char* name) {
            double most = not_known;
            for (const Record* run : processes) most = std::fmax(most, summary_of(*run, name));
            return most;
        };
        const auto sum = [&processes](const char* name) {
            double all = 0.0;
            for (const Record* run : processes) all += summary_of(*run, name);
            return all;
        };
        const double ticks = sum("timed_ticks");
        cells.insert(cells.end(),
                     {count_text(figure_of(processes, "timed_ticks").value),
                      count_text(summary_of(*processes.front(), "substeps")),
                      estimate_text(figure_of(processes, "paced_median_ns"), us), tail("paced_p99_ns"),
                      tail("paced_p999_ns"), number_or_not(worst("paced_max_ns"), us),
                      count_text(sum("paced_misses")) + " of " + count_text(ticks), count_text(worst("paced_burst")),
                      number_or_not(figure_of(processes, "empty_median_ns").value, us) + " / " +
                          number_or_not(figure_of(processes, "empty_p99_ns").value, us) + " / " +
                          number_or_not(worst("empty_max_ns"), us),
                      count_text(sum("empty_misses")) + " of " + count_text(ticks)});
        for (const char* stage : stage_names) {
            const std::string name = stage;
            cells.push_back(number_or_not(figure_of(processes, (name + "_median_ns").c_str()).value, us) + " / " +
                            number_or_not(figure_of(processes, (name + "_p99_ns").c_str()).value, us));
        }
        table.rows.push_back({.cells = std::move(cells)});
    }
    table.note =
        "A tick that ends after the next one's release is a miss, and the next one starts late: its time counts from "
        "its own release, so that no lateness is left out. The empty loop of the same length ran before in the same "
        "process: what it shows is the machine's. n too small: p99 needs 1000 ticks, p99.9 a hundred thousand.";
    draft.add(std::move(table));
}

void add_work_precision(Draft& draft) {
    std::map<std::pair<std::string, std::string>, Chart> charts;  // by scene and knob
    for (const Record& record : draft.records) {
        const RunSpec& spec = record.spec;
        if (spec.mode != "work_precision" || record.outcome.kind == OutcomeKind::absent ||
            record.outcome.kind == OutcomeKind::unsupported) {
            continue;
        }
        const std::size_t dot = spec.knob.find('.');
        const std::string key = dot == std::string::npos ? std::string() : spec.knob.substr(dot + 1);
        const bool of_detector = spec.knob.rfind("detector.", 0) == 0;
        const std::string detector = of_detector ? without_parameter(spec.detector, key) : spec.detector;
        const std::string response = of_detector ? spec.response : without_parameter(spec.response, key);
        Chart& chart = charts[{spec.scene, of_detector ? "the detectors' own knobs" : spec.knob}];
        chart.replay = spec.response.empty();
        std::string name = detector + (response.empty() ? "" : " + " + response);
        if (of_detector) name += " over " + key;
        if (spec.contacts == "native") name += " (native)";
        chart.curves[name][{spec.point}].push_back(&record);
    }
    if (charts.empty()) return;
    draft.heading(2, "Work and precision");
    draft.paragraph(
        "One connected curve per method, by turning one knob: time to compute one simulated millisecond against the "
        "error. † and grey: another point of the same chart is at least as fast and as good, and better in one of the "
        "two. The dashed line is the front of the points that are not dominated; to the right of 1 ms no haptic loop "
        "can follow. A point that failed has no place on a curve and stays in the table.");
    int number = 0;
    for (const auto& [key, chart] : charts) {
        const auto& [scene, knob] = key;
        std::vector<Mark> marks;
        for (const auto& [name, curve] : chart.curves) {
            for (const auto& [point, runs] : curve) {
                Mark mark{.curve = name, .point = point.text};
                for (const Record* run : runs) {
                    if (!run->outcome.ok() && mark.outcome.empty()) mark.outcome = outcome_text(run->outcome);
                }
                const auto dt_text = runs.front()->environment.find("run.dt_s");
                if (mark.outcome.empty() && dt_text != runs.front()->environment.end()) {
                    const double dt = Point{dt_text->second}.number();
                    mark.time = figure_of(runs, "total_median_ns").value * us * (1e-3 / dt);
                    const Record& first = *runs.front();
                    mark.error = chart.replay ? summary_of(first, "missing") + summary_of(first, "extra")
                                              : summary_of(first, "residual_max_m") * mm;
                    mark.force = number_or_not(summary_of(first, "force_error_rms_equal_k"), 1.0) + " / " +
                                 number_or_not(summary_of(first, "force_error_rms_hard"), 1.0);
                }
                marks.push_back(std::move(mark));
            }
        }
        for (Mark& mark : marks) {
            mark.dominated = std::any_of(marks.begin(), marks.end(), [&mark](const Mark& other) {
                return other.time <= mark.time && other.error <= mark.error &&
                       (other.time < mark.time || other.error < mark.error);
            });
        }
        const std::string error_title = chart.replay ? "pairs missed + extra" : "left after the tick, worst (mm)";
        ScatterChart drawing;
        drawing.x_title = fmt::format("time per simulated ms (µs), {}, {}", scene, knob);
        drawing.y_title = error_title;
        drawing.x_limit = 1000.0;
        drawing.x_limit_name = "1 ms";
        Table table;
        table.caption = fmt::format("{}: {}", scene, knob);
        table.columns = {{"method", false},
                         {knob, true},
                         {"time per simulated ms (µs)", true},
                         {error_title, true},
                         {"force error, equal k / hard (N RMS)", true},
                         {"outcome", false}};
        table.folded = true;
        for (const Mark& mark : marks) {
            table.rows.push_back({.cells = {code(mark.curve), mark.point + unit_of(knob) + (mark.dominated ? " †" : ""),
                                            number_or_not(mark.time, 1.0), number_or_not(mark.error, 1.0), mark.force,
                                            mark.outcome.empty() ? "ok" : mark.outcome}});
            if (!mark.outcome.empty()) table.rows.back().style = TableRow::Style::failed;
            if (mark.dominated) table.rows.back().style = TableRow::Style::dominated;
            if (std::isnan(mark.time) || std::isnan(mark.error)) continue;
            if (drawing.series.empty() || drawing.series.back().name != mark.curve) {
                const int style = static_cast<int>(drawing.series.size());
                drawing.series.push_back(
                    {.name = mark.curve, .style = {.colour = style, .shape = style}, .points = {}, .connected = true});
            }
            drawing.series.back().points.push_back(
                {.x = mark.time,
                 .y = mark.error,
                 .name = fmt::format("{}, {} = {}{}: {} µs, {} {}", mark.curve, knob, mark.point, unit_of(knob),
                                     format_number(mark.time), format_number(mark.error),
                                     chart.replay ? "pairs wrong" : "mm"),
                 .label = mark.point});
            if (!mark.dominated) drawing.front.emplace_back(mark.time, mark.error);
        }
        std::sort(drawing.front.begin(), drawing.front.end());
        if (!drawing.series.empty()) {
            draft.figure(fmt::format("work_precision_{}", ++number), draw(drawing),
                         fmt::format("Work and precision on {} over {}; labels are the knob's values.", code(scene),
                                     knob == "k" || knob == "dt" ? code(knob) + " (" + unit_of(knob).substr(1) + ")"
                                                                 : code(knob)));
        }
        draft.add(std::move(table));
    }
}

}  // namespace trocar
