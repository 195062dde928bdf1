// Work against precision: one curve per method over the knob that a study turns, with the points that no other beats.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "report/chart.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

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

/// One point of a curve.
struct Mark {
    std::string curve = {};
    std::string point = {};
    double time = not_known;           ///< µs of computing per simulated ms, median over processes
    double error = not_known;          ///< mm, or pairs
    double force_equal_k = not_known;  ///< N RMS
    double force_hard = not_known;     ///< N RMS
    double substeps = not_known;
    std::string outcome = {};  ///< empty: ok
    bool dominated = false;
};

/// All curves over one knob on one scene.
struct Chart {
    std::string scene;
    std::string knob;
    bool replay = false;
    std::vector<Mark> marks = {};  ///< curve by curve, each in the order of its points
    [[nodiscard]] const char* unit() const { return knob == "dt" ? " s" : knob == "k" ? " N/m" : ""; }
    [[nodiscard]] const char* error_title() const {
        return replay ? "pairs missed + extra" : "left after the tick, worst (mm)";
    }
};

Mark make_mark(const std::string& curve, const std::string& point, const std::vector<const Record*>& runs,
               bool replay) {
    Mark mark{.curve = curve, .point = point};
    for (const Record* run : runs) {
        if (!run->outcome.ok() && mark.outcome.empty()) mark.outcome = outcome_text(run->outcome);
    }
    const Record& first = *runs.front();
    const auto dt_text = first.environment.find("run.dt_s");
    if (!mark.outcome.empty() || dt_text == first.environment.end()) return mark;
    std::vector<double> medians;
    medians.reserve(runs.size());
    for (const Record* run : runs) medians.push_back(summary_of(*run, "total_median_ns"));
    mark.time = across_processes(medians).value * us * (1e-3 / Point{dt_text->second}.number());
    mark.error =
        replay ? summary_of(first, "missing") + summary_of(first, "extra") : summary_of(first, "residual_max_m") * mm;
    mark.force_equal_k = summary_of(first, "force_error_rms_equal_k");
    mark.force_hard = summary_of(first, "force_error_rms_hard");
    mark.substeps = summary_of(first, "substeps");
    return mark;
}

/// Another point is at least as fast and as good, and better in one: in time only beyond the noise.
void mark_dominated(std::vector<Mark>& marks, double noise_floor) {
    const double noise = std::isnan(noise_floor) ? 1.0 : noise_floor;
    for (Mark& mark : marks) {
        const double error = as_printed(mark.error);
        mark.dominated = std::any_of(marks.begin(), marks.end(), [&](const Mark& other) {
            const double other_error = as_printed(other.error);
            return other.time <= mark.time && other_error <= error &&
                   (other.time * noise < mark.time || other_error < error);
        });
    }
}

std::vector<Chart> charts_of(const Draft& draft) {
    std::map<std::pair<std::string, std::string>, std::map<std::string, Curve>> curves;  // by scene and knob
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
        std::string name = detector;
        if (!response.empty()) name.append(" + ").append(response);
        if (of_detector) name += " over " + key;
        if (spec.contacts == "native") name += " (native)";
        curves[{spec.scene, of_detector ? "the detectors' own knobs" : spec.knob}][name][{spec.point}].push_back(
            &record);
    }
    std::vector<Chart> charts;
    for (const auto& [where, by_name] : curves) {
        Chart chart{.scene = where.first, .knob = where.second};
        for (const auto& [name, curve] : by_name) {
            for (const auto& [point, runs] : curve) {
                chart.replay = runs.front()->spec.response.empty();
                chart.marks.push_back(make_mark(name, point.text, runs, chart.replay));
            }
        }
        mark_dominated(chart.marks, draft.results.noise_floor());
        charts.push_back(std::move(chart));
    }
    return charts;
}

/// Least error and fastest point of a chart; null when it has none.
struct Ends {
    const Mark* exact = nullptr;
    const Mark* fast = nullptr;
};

Ends ends_of(const Chart& chart) {
    Ends ends;
    for (const Mark& mark : chart.marks) {
        if (std::isnan(mark.time) || std::isnan(mark.error)) continue;
        const auto by_error = [](const Mark& m) { return std::pair(as_printed(m.error), m.time); };
        const auto by_time = [](const Mark& m) { return std::pair(m.time, m.error); };
        if (ends.exact == nullptr || by_error(mark) < by_error(*ends.exact)) ends.exact = &mark;
        if (ends.fast == nullptr || by_time(mark) < by_time(*ends.fast)) ends.fast = &mark;
    }
    return ends;
}

std::string mark_text(const Chart& chart, const Mark& mark) {
    return fmt::format("{} at {}{}", code(mark.curve), mark.point, chart.unit());
}

Table ends_table(const std::vector<Chart>& charts) {
    Table table;
    table.caption = "The most exact and the fastest point of every chart";
    table.columns = {{"scene", false},
                     {"knob", false},
                     {"least error", false},
                     {"its error", true},
                     {"its time per simulated ms (µs)", true},
                     {"fastest", false},
                     {"its error", true},
                     {"its time per simulated ms (µs)", true}};
    for (const Chart& chart : charts) {
        const auto [exact, fast] = ends_of(chart);
        if (exact == nullptr) continue;
        const std::string unit = chart.replay ? " pairs" : " mm";
        table.rows.push_back(
            {.cells = {chart.scene, chart.knob, mark_text(chart, *exact), scaled(exact->error) + unit,
                       scaled(exact->time), mark_text(chart, *fast), scaled(fast->error) + unit, scaled(fast->time)}});
    }
    return table;
}

Table points_table(const Chart& chart) {
    const bool forces = std::any_of(chart.marks.begin(), chart.marks.end(), [](const Mark& mark) {
        return !std::isnan(mark.force_equal_k) || !std::isnan(mark.force_hard);
    });
    Table table;
    table.caption = fmt::format("{}: {}", chart.scene, chart.knob);
    table.columns = {{"method", false}, {chart.knob, true}};
    if (!chart.replay) table.columns.push_back({"sub-steps per tick", true});
    table.columns.push_back({"time per simulated ms (µs)", true});
    table.columns.push_back({chart.error_title(), true});
    if (forces) table.columns.push_back({"force error, equal k / hard (N RMS)", true});
    table.columns.push_back({"outcome", false});
    table.folded = true;
    for (const Mark& mark : chart.marks) {
        std::vector<std::string> cells{code(mark.curve), mark.point + chart.unit() + (mark.dominated ? " †" : "")};
        if (!chart.replay) cells.push_back(count_text(mark.substeps));
        cells.push_back(scaled(mark.time));
        cells.push_back(scaled(mark.error));
        if (forces) cells.push_back(scaled(mark.force_equal_k) + " / " + scaled(mark.force_hard));
        cells.push_back(mark.outcome.empty() ? "ok" : mark.outcome);
        table.rows.push_back({.cells = std::move(cells)});
        if (!mark.outcome.empty()) table.rows.back().style = TableRow::Style::failed;
        if (mark.dominated) table.rows.back().style = TableRow::Style::dominated;
    }
    return table;
}

/// Empty when no point has a place on a curve.
std::string drawing_of(const Chart& chart) {
    ScatterChart drawing;
    drawing.x_title = fmt::format("time per simulated ms (µs), {}, {}", chart.scene, chart.knob);
    drawing.y_title = chart.error_title();
    drawing.x_limit = 1000.0;
    drawing.x_limit_name = "1 ms";
    for (const Mark& mark : chart.marks) {
        if (std::isnan(mark.time) || std::isnan(mark.error)) continue;
        if (drawing.series.empty() || drawing.series.back().name != mark.curve) {
            const int style = static_cast<int>(drawing.series.size());
            drawing.series.push_back(
                {.name = mark.curve, .style = {.colour = style, .shape = style}, .points = {}, .connected = true});
        }
        drawing.series.back().points.push_back(
            {.x = mark.time,
             .y = mark.error,
             .name =
                 fmt::format("{}, {} = {}{}: {} µs, {} {}", mark.curve, chart.knob, mark.point, chart.unit(),
                             format_number(mark.time), format_number(mark.error), chart.replay ? "pairs wrong" : "mm"),
             .label = mark.point});
        if (!mark.dominated) drawing.front.emplace_back(mark.time, mark.error);
    }
    std::sort(drawing.front.begin(), drawing.front.end());
    return drawing.series.empty() ? std::string() : draw(drawing);
}

}  // namespace

std::string work_precision_sentence(const Draft& draft) {
    for (const Chart& chart : charts_of(draft)) {
        const auto [exact, fast] = ends_of(chart);
        if (chart.replay || exact == nullptr) continue;
        const auto tell = [&chart](const Mark& mark) {
            return fmt::format("{} ({} mm at worst, {} µs per simulated ms)", mark_text(chart, mark),
                               scaled(mark.error), scaled(mark.time));
        };
        return fmt::format("On {} over {}, least is left by {}; fastest is {}.", chart.scene, code(chart.knob),
                           tell(*exact), tell(*fast));
    }
    return {};
}

void add_work_precision(Draft& draft) {
    const std::vector<Chart> charts = charts_of(draft);
    if (charts.empty()) return;
    draft.heading(2, "Work and precision");
    draft.paragraph(
        "One connected curve per method, by turning one knob: time to compute one simulated millisecond against the "
        "error. † and grey: another point of the same chart is at least as fast and as good, and better in one of the "
        "two (in time beyond the noise floor, where several processes show one). The dashed line is the front of the "
        "points that are not dominated; to the right of 1 ms no haptic loop can follow. A point that failed has no "
        "place on a curve and stays in the table.");
    draft.add(ends_table(charts));
    int number = 0;
    for (const Chart& chart : charts) {
        const std::string drawing = drawing_of(chart);
        const std::string unit = chart.unit();
        if (!drawing.empty()) {
            draft.figure(
                fmt::format("work_precision_{}", ++number), drawing,
                fmt::format("Work and precision on {} over {}{}; labels are the knob's values.", code(chart.scene),
                            code(chart.knob), unit.empty() ? "" : " (" + unit.substr(1) + ")"));
        }
        draft.add(points_table(chart));
    }
}

}  // namespace trocar
