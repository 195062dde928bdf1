// Work against precision: one curve per method over the knob that a study turns, with the points that no other beats.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "geometry/number_text.hpp"
#include "report/chart.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

/// The method without the parameter that the knob turns, so that all points of a curve have the same name.
std::string without_parameter(const std::string& method, const std::string& key) {
    const std::size_t colon = method.find(':');
    if (key.empty() || colon == std::string::npos) return method;
    std::string rest = method.substr(0, colon);
    for (std::size_t start = colon + 1; start < method.size();) {
        const std::size_t end = std::min(method.find(',', start), method.size());
        const std::string parameter = method.substr(start, end - start);
        // From its beginning: friction_k is not k.
        if (!parameter.starts_with(key + "=")) rest += (rest.size() == colon ? ":" : ",") + parameter;
        start = end + 1;
    }
    return rest;
}

/// Numbers in their order, words behind them.
struct Point {
    std::string text;
    [[nodiscard]] double number() const {
        const double value = number_of_text<double>(text).value_or(HUGE_VAL);
        return std::isnan(value) ? HUGE_VAL : value;
    }
    bool operator<(const Point& other) const {
        return number() != other.number() ? number() < other.number() : text < other.text;
    }
};

using Curve = std::map<Point, std::vector<const Record*>>;

constexpr std::size_t equal_k = 0;
constexpr std::size_t hard = 1;
/// The two laws of contact that a reference is solved for.
struct Law {
    std::size_t number;
    const char* name;
    const char* ending;  ///< of its drawings
    Metric error;        ///< N RMS
    Metric bound;        ///< of that error
};
constexpr std::array laws{
    Law{equal_k, "contact of equal k", "_equal_k", Metric::force_error_rms_equal_k, Metric::force_bound_equal_k},
    Law{hard, "hard contact", "_hard", Metric::force_error_rms_hard, Metric::force_bound_hard}};

/// One point of a curve.
struct Mark {
    std::string curve = {};
    std::string point = {};
    double time = not_known;                            ///< µs of computing per simulated ms, median over processes
    double error = not_known;                           ///< mm, or pairs
    std::array<double, 2> force{not_known, not_known};  ///< N RMS, against each of `laws`
    /// N RMS: what the references of this point's k themselves may be off; errors below it are alike.
    std::array<double, 2> force_bound{not_known, not_known};
    double substeps = not_known;
    std::string outcome = {};  ///< empty: ok
    bool dominated = false;
    std::array<bool, 2> force_dominated{};
};

/// What the reference can distinguish, N; NaN where a force is not known.
double reported_apart(const Mark& mark, std::size_t law) {
    return std::isnan(mark.force.at(law)) ? not_known
                                          : as_printed(std::fmax(mark.force.at(law), mark.force_bound.at(law)));
}

/// All curves over one knob on one scene.
struct Chart {
    std::string scene;
    std::string knob;
    bool replay = false;
    std::vector<Mark> marks = {};  ///< curve by curve, each in the order of its points
    // What the records say of the references: hard contact's has no stiffness, equal k is solved for each.
    std::string hard_reference = {};
    std::map<Point, std::string> equal_k_reference = {};
    [[nodiscard]] const char* unit() const { return knob == "dt" ? " s" : knob == "k" ? " N/m" : ""; }
    [[nodiscard]] const char* error_title() const {
        return replay ? "false negatives + false positives" : "residual penetration, max (mm)";
    }
    /// False where every error lies within the bound, or none is known.
    [[nodiscard]] bool ranks_forces(std::size_t law) const {
        return std::any_of(marks.begin(), marks.end(),
                           [&](const Mark& mark) { return mark.force.at(law) > mark.force_bound.at(law); });
    }
    /// Of all points' references.
    [[nodiscard]] std::string force_bound_text(std::size_t law) const {
        double least = not_known;
        double largest = not_known;
        for (const Mark& mark : marks) {
            least = std::fmin(least, mark.force_bound.at(law));
            largest = std::fmax(largest, mark.force_bound.at(law));
        }
        return least < largest ? scaled(least) + " to " + scaled(largest) : scaled(largest);
    }
};

Mark make_mark(const std::string& curve, const std::string& point, const std::vector<const Record*>& runs,
               bool replay) {
    Mark mark{.curve = curve, .point = point};
    std::vector<double> medians;
    for (const Record* run : runs) {
        if (!run->outcome.ok() && mark.outcome.empty()) mark.outcome = outcome_text(run->outcome);
        medians.push_back(value_of(run->summary, Metric::total_median_ns));
    }
    const std::string& dt_text = fact_of(*runs.front(), "run.dt_s");
    if (!mark.outcome.empty() || dt_text.empty()) return mark;
    const auto first = [&runs](Metric metric) { return value_of(runs.front()->summary, metric); };
    mark.time = across_processes(medians).value * us * (1e-3 / Point{dt_text}.number());
    mark.error = replay ? first(Metric::false_negatives) + first(Metric::false_positives)
                        : first(Metric::residual_penetration_max_m) * mm;
    for (const Law& law : laws) {
        mark.force.at(law.number) = first(law.error);
        mark.force_bound.at(law.number) = first(law.bound);
    }
    mark.substeps = first(Metric::substeps);
    return mark;
}

/// Another point is at least as fast and as good, and better in one: in time only beyond the noise.
template <typename Error>
bool is_dominated(const Mark& mark, const std::vector<Mark>& marks, double noise, Error error_of) {
    const double error = error_of(mark);
    return std::any_of(marks.begin(), marks.end(), [&](const Mark& other) {
        const double other_error = error_of(other);
        return other.time <= mark.time && other_error <= error &&
               (other.time * noise < mark.time || other_error < error);
    });
}

void mark_dominated(Chart& chart, double noise_floor) {
    const double noise = std::isnan(noise_floor) ? 1.0 : noise_floor;
    for (Mark& mark : chart.marks) {
        mark.dominated = is_dominated(mark, chart.marks, noise, [](const Mark& m) { return as_printed(m.error); });
        for (const Law& law : laws) {
            mark.force_dominated.at(law.number) =
                is_dominated(mark, chart.marks, noise, [&](const Mark& m) { return reported_apart(m, law.number); });
        }
    }
}

std::vector<Chart> charts_of(const Draft& draft) {
    std::map<std::pair<std::string, std::string>, std::map<std::string, Curve>> curves;  // by scene and knob
    for (const Record* record : runs_of(draft.records, "work_precision")) {
        const RunSpec& spec = record->spec;
        const std::size_t dot = spec.knob.find('.');
        const std::string key = dot == std::string::npos ? std::string() : spec.knob.substr(dot + 1);
        const bool of_detector = spec.knob.starts_with("detector.");
        const std::string detector = of_detector ? without_parameter(spec.detector, key) : spec.detector;
        const std::string response = of_detector ? spec.response : without_parameter(spec.response, key);
        std::string name = detector;
        if (!response.empty()) name.append(" + ").append(response);
        if (of_detector) name += " over " + key;
        if (spec.contacts == "native") name += " (native)";
        curves[{spec.scene, of_detector ? "the detectors' own knobs" : spec.knob}][name][{spec.point}].push_back(
            record);
    }
    std::vector<Chart> charts;
    for (const auto& [where, by_name] : curves) {
        Chart chart{.scene = where.first, .knob = where.second};
        for (const auto& [name, curve] : by_name) {
            for (const auto& [point, runs] : curve) {
                chart.replay = runs.front()->spec.response.empty();
                chart.marks.push_back(make_mark(name, point.text, runs, chart.replay));
                for (const Record* run : runs) {
                    const std::string& hard_text = fact_of(*run, "reference.hard");
                    const std::string& equal_k_text = fact_of(*run, "reference.equal_k");
                    if (!hard_text.empty()) chart.hard_reference = hard_text;
                    if (!equal_k_text.empty()) chart.equal_k_reference[point] = equal_k_text;
                }
            }
        }
        mark_dominated(chart, draft.results.noise_floor());
        charts.push_back(std::move(chart));
    }
    return charts;
}

/// Least error and fastest point of a chart; null when it has none.
struct Ends {
    const Mark* exact = nullptr;
    std::array<const Mark*, 2> force{};  ///< least force error by law; null where the reference cannot rank
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
        for (const Law& law : laws) {
            const Mark*& best = ends.force.at(law.number);
            const auto by_force = [&](const Mark& m) { return std::pair(reported_apart(m, law.number), m.time); };
            if (std::isnan(mark.force.at(law.number)) || !chart.ranks_forces(law.number)) continue;
            if (best == nullptr || by_force(mark) < by_force(*best)) best = &mark;
        }
    }
    return ends;
}

std::string mark_text(const Chart& chart, const Mark& mark) {
    return fmt::format("{} at {}{}", code(mark.curve), mark.point, chart.unit());
}

Table ends_table(const std::vector<Chart>& charts) {
    Table table;
    table.caption = "The ends of every chart: least error and fastest";
    for (const Chart& chart : charts) {
        const Ends ends = ends_of(chart);
        if (ends.exact == nullptr) continue;
        table.rows.push_back({});
        add_cell(table, {"scene"}, chart.scene);
        add_cell(table, {"knob"}, chart.knob);
        for (const auto& [header, mark] :
             {std::pair("least residual penetration, or fewest pairs wrong", ends.exact), {"fastest", ends.fast}}) {
            add_cell(table, {header}, mark_text(chart, *mark));
            add_cell(table, {"its error", true}, scaled(mark->error) + (chart.replay ? " pairs" : " mm"));
            add_cell(table, {"its time per simulated ms (µs)", true}, scaled(mark->time));
        }
    }
    return table;
}

Table force_ends_table(const std::vector<Chart>& charts) {
    Table table;
    table.caption = "Least force error of every chart";
    table.note =
        "Two laws, two rankings: a response with springs as soft as the scene's k belongs beside the reference of "
        "equal k, one that holds surfaces apart beside hard contact; against the other law the difference of the laws "
        "counts as error. ≤: within the reference's own bound, where errors cannot be distinguished; the fastest of "
        "these stands here. not ranked: no reference, or all errors within its bound. Where the knob turns k, the "
        "reference of equal k is solved anew for each value, and every point is held against that of its own.";
    for (const Chart& chart : charts) {
        if (chart.replay) continue;
        const Ends ends = ends_of(chart);
        for (const Law& law : laws) {
            const Mark* best = ends.force.at(law.number);
            const Mark mark = best == nullptr ? Mark{} : *best;
            const double bound = mark.force_bound.at(law.number);
            const double force = mark.force.at(law.number);
            table.rows.push_back({});
            add_cell(table, {"scene"}, chart.scene);
            add_cell(table, {"knob"}, chart.knob);
            add_cell(table, {"against"}, law.name);
            add_cell(table, {"least force error"}, best == nullptr ? "not ranked" : mark_text(chart, mark));
            add_cell(table, {"its force error (N RMS)", true},
                     force <= bound ? "≤ " + scaled(bound) : scaled(force, 1.0, ""));
            add_cell(table, {"bound of the reference (N RMS)", true},
                     best == nullptr ? chart.force_bound_text(law.number) : scaled(bound));
            add_cell(table, {"its time per simulated ms (µs)", true}, scaled(mark.time, 1.0, ""));
        }
    }
    return table;
}

/// Why a force error of the chart is n/a, and how far the others can be trusted.
std::string reference_note(const Chart& chart) {
    std::string note = "Force errors are root mean squares below 30 Hz against the scene's reference. ";
    if (chart.hard_reference.empty()) return note + "It has none.";
    note += fmt::format("Hard contact: {}.", chart.hard_reference);
    const auto& equal_k_texts = chart.equal_k_reference;
    const bool alike = std::all_of(equal_k_texts.begin(), equal_k_texts.end(),
                                   [&](const auto& it) { return it.second == equal_k_texts.begin()->second; });
    for (const auto& [point, text] : equal_k_texts) {
        if (alike) return note + fmt::format(" Equal k: {}.", text);
        note += fmt::format(" Equal k at {}{}: {}.", point.text, chart.unit(), text);
    }
    return note;
}

/// By other points in every error that is known and ranks.
bool is_beaten(const Chart& chart, const Mark& mark) {
    return mark.dominated && std::all_of(laws.begin(), laws.end(), [&](const Law& law) {
               return mark.force_dominated.at(law.number) || !chart.ranks_forces(law.number);
           });
}

Table points_table(const Chart& chart) {
    Table table{.caption = fmt::format("{}: {}", chart.scene, chart.knob),
                .note = chart.replay ? std::string() : reference_note(chart),
                .folded = true};
    const auto starred = [](double value, bool dominated) { return scaled(value) + (dominated ? " †" : ""); };
    for (const Mark& mark : chart.marks) {
        table.rows.push_back({.style = is_beaten(chart, mark)  ? TableRow::Style::dominated
                                       : !mark.outcome.empty() ? TableRow::Style::failed
                                                               : TableRow::Style::normal});
        add_cell(table, {"method"}, code(mark.curve));
        add_cell(table, {chart.knob, true}, mark.point + chart.unit());
        if (!chart.replay) add_cell(table, {"sub-steps per tick", true, Metric::substeps}, count_text(mark.substeps));
        add_cell(table, {"time per simulated ms (µs)", true}, scaled(mark.time));
        add_cell(table, {chart.error_title(), true}, starred(mark.error, mark.dominated));
        if (!chart.replay) {
            std::vector<std::string> forces;
            forces.reserve(laws.size());
            for (const Law& law : laws) {
                forces.push_back(starred(mark.force.at(law.number), mark.force_dominated.at(law.number)));
            }
            add_cell(table, {"force error, equal k / hard (N RMS)", true, Metric::force_error_rms_equal_k},
                     joined(forces, " / "));
        }
        add_cell(table, {"outcome"}, mark.outcome.empty() ? "ok" : mark.outcome);
    }
    return table;
}

/// What a drawing shows on its upright axis: a force error by a law, or (none) what is left or wrong.
struct KnobPanel {
    const Law* law = nullptr;
    std::string title;
    const char* unit;
    [[nodiscard]] double error(const Mark& mark) const {
        return law == nullptr ? mark.error : mark.force.at(law->number);
    }
    [[nodiscard]] bool dominated(const Mark& mark) const {
        return law == nullptr ? mark.dominated : mark.force_dominated.at(law->number);
    }
};

/// Without series when no point has a place on a curve.
ScatterChart drawing_of(const Chart& chart, const KnobPanel& panel) {
    ScatterChart drawing;
    drawing.x_title = fmt::format("time per simulated ms (µs), {}, {}", chart.scene, chart.knob);
    drawing.y_title = panel.title;
    drawing.x_limit = 1000.0;
    drawing.x_limit_name = "1 ms";
    for (const Mark& mark : chart.marks) {
        const double error = panel.error(mark);
        if (std::isnan(mark.time) || std::isnan(error)) continue;
        if (drawing.series.empty() || drawing.series.back().name != mark.curve) {
            const int style = static_cast<int>(drawing.series.size());
            drawing.series.push_back({.name = mark.curve, .style = mark_style(style), .connected = true});
        }
        drawing.series.back().points.push_back(
            {.x = mark.time,
             .y = error,
             .name = fmt::format("{}, {} = {}{}: {} µs, {} {}", mark.curve, chart.knob, mark.point, chart.unit(),
                                 format_number(mark.time), format_number(error), panel.unit),
             .label = mark.point});
        if (!panel.dominated(mark)) drawing.front.emplace_back(mark.time, error);
    }
    for (ChartSeries& curve : drawing.series) {  // the ends show the direction of a curve
        for (std::size_t i = 1; i + 1 < curve.points.size(); ++i) curve.points[i].label.clear();
    }
    std::sort(drawing.front.begin(), drawing.front.end());
    return drawing;
}

}  // namespace

std::string work_precision_sentence(const Draft& draft) {
    for (const Chart& chart : charts_of(draft)) {
        const Ends ends = ends_of(chart);
        if (chart.replay || ends.exact == nullptr) continue;
        const auto report = [&chart](const Mark& mark) {
            return fmt::format("{} ({} mm at worst, {} µs per simulated ms)", mark_text(chart, mark),
                               scaled(mark.error), scaled(mark.time));
        };
        return fmt::format("On {} over {}, the least residual penetration is that of {}; fastest is {}.", chart.scene,
                           code(chart.knob), report(*ends.exact), report(*ends.fast));
    }
    return {};
}

void add_work_precision(Draft& draft) {
    const std::vector<Chart> charts = charts_of(draft);
    if (charts.empty()) return;
    draft.heading(2, "Work and precision");
    draft.paragraph(
        "One connected curve per method, by turning one knob: time to compute one simulated millisecond against "
        "residual penetration and, where the scene has a reference, against the error of the force. † : another point "
        "of the same chart is at least as fast and as good, and better in one of the two (in time beyond the noise "
        "floor, where several processes show one; in force beyond the reference's bound); grey: so in every error "
        "that ranks. The dashed line is the front of the points without †; to the right of 1 ms no haptic loop can "
        "follow. A point that failed has no place on a curve and stays in the table.");
    draft.add(ends_table(charts));
    draft.add(force_ends_table(charts));
    int number = 0;
    for (const Chart& chart : charts) {
        std::vector<KnobPanel> panels{{nullptr, chart.error_title(), chart.replay ? "pairs wrong" : "mm"}};
        for (const Law& law : laws) {
            if (!chart.ranks_forces(law.number)) continue;
            panels.push_back({&law, fmt::format("force error against {} (N RMS)", law.name), "N"});
        }
        const std::string unit = chart.unit();
        const std::string over =
            fmt::format("{} over {}{}; labels are the knob's values at the ends of a curve", code(chart.scene),
                        code(chart.knob), unit.empty() ? "" : " (" + unit.substr(1) + ")");
        ++number;
        for (const KnobPanel& panel : panels) {
            const ScatterChart drawing = drawing_of(chart, panel);
            if (drawing.series.empty()) continue;
            if (panel.law == nullptr) {
                draft.figure(fmt::format("work_precision_{}", number), drawing, "Work and precision on " + over + ".");
                continue;
            }
            draft.figure(fmt::format("work_precision_{}{}", number, panel.law->ending), drawing,
                         fmt::format("Work and force error against {} on {}. The reference itself knows {} N.",
                                     panel.law->name, over, chart.force_bound_text(panel.law->number)));
        }
        draft.add(points_table(chart));
    }
}

}  // namespace trocar
