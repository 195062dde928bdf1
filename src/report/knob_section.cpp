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
    const char* ending;  ///< of its figures
};
constexpr std::array laws{Law{equal_k, "contact of equal k", "_equal_k"}, Law{hard, "hard contact", "_hard"}};

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
    for (const Record* run : runs) {
        if (!run->outcome.ok() && mark.outcome.empty()) mark.outcome = outcome_text(run->outcome);
    }
    const Record& first = *runs.front();
    const auto dt_text = first.environment.find("run.dt_s");
    if (!mark.outcome.empty() || dt_text == first.environment.end()) return mark;
    std::vector<double> medians;
    medians.reserve(runs.size());
    for (const Record* run : runs) medians.push_back(summary_of(*run, Metric::total_median_ns));
    mark.time = across_processes(medians).value * us * (1e-3 / Point{dt_text->second}.number());
    mark.error = replay ? summary_of(first, Metric::false_negatives) + summary_of(first, Metric::false_positives)
                        : summary_of(first, Metric::residual_penetration_max_m) * mm;
    for (const Law& law : laws) {
        mark.force.at(law.number) = summary_of(first, metric_of(std::string("force_error_rms") + law.ending));
        mark.force_bound.at(law.number) = summary_of(first, metric_of(std::string("force_bound") + law.ending));
    }
    mark.substeps = summary_of(first, Metric::substeps);
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

/// What the records say of the scene's references.
void read_references(const std::vector<const Record*>& runs, Chart& chart) {
    for (const Record* run : runs) {
        const auto hard_text = run->environment.find("reference.hard");
        if (hard_text != run->environment.end()) chart.hard_reference = hard_text->second;
        const auto equal_k_text = run->environment.find("reference.equal_k");
        if (equal_k_text != run->environment.end()) chart.equal_k_reference[{run->spec.point}] = equal_k_text->second;
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
        std::vector<const Record*> all;
        for (const auto& [name, curve] : by_name) {
            for (const auto& [point, runs] : curve) {
                chart.replay = runs.front()->spec.response.empty();
                chart.marks.push_back(make_mark(name, point.text, runs, chart.replay));
                all.insert(all.end(), runs.begin(), runs.end());
            }
        }
        if (!chart.replay) read_references(all, chart);
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
    table.columns = {{"scene", false},
                     {"knob", false},
                     {"least residual penetration, or fewest pairs wrong", false},
                     {"its error", true},
                     {"its time per simulated ms (µs)", true},
                     {"fastest", false},
                     {"its error", true},
                     {"its time per simulated ms (µs)", true}};
    for (const Chart& chart : charts) {
        const Ends ends = ends_of(chart);
        if (ends.exact == nullptr) continue;
        const std::string unit = chart.replay ? " pairs" : " mm";
        table.rows.push_back(
            {.cells = {chart.scene, chart.knob, mark_text(chart, *ends.exact), scaled(ends.exact->error) + unit,
                       scaled(ends.exact->time), mark_text(chart, *ends.fast), scaled(ends.fast->error) + unit,
                       scaled(ends.fast->time)}});
    }
    return table;
}

Table force_ends_table(const std::vector<Chart>& charts) {
    Table table;
    table.caption = "Least force error of every chart";
    table.columns = {{"scene", false},
                     {"knob", false},
                     {"against", false},
                     {"least force error", false},
                     {"its force error (N RMS)", true},
                     {"bound of the reference (N RMS)", true},
                     {"its time per simulated ms (µs)", true}};
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
            TableRow row{
                .cells = {chart.scene, chart.knob, law.name, "not ranked", "", chart.force_bound_text(law.number), ""}};
            if (best != nullptr) {
                const double bound = best->force_bound.at(law.number);
                const double force = best->force.at(law.number);
                row.cells[3] = mark_text(chart, *best);
                row.cells[4] = force <= bound ? "≤ " + scaled(bound) : scaled(force);
                row.cells[5] = scaled(bound);
                row.cells[6] = scaled(best->time);
            }
            table.rows.push_back(std::move(row));
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
    Table table;
    table.caption = fmt::format("{}: {}", chart.scene, chart.knob);
    table.columns = {{"method", false}, {chart.knob, true}};
    if (!chart.replay) table.columns.push_back({"sub-steps per tick", true, Metric::substeps});
    table.columns.push_back({"time per simulated ms (µs)", true});
    table.columns.push_back({chart.error_title(), true});
    if (!chart.replay)
        table.columns.push_back({"force error, equal k / hard (N RMS)", true, Metric::force_error_rms_equal_k});
    table.columns.push_back({"outcome", false});
    table.folded = true;
    if (!chart.replay) table.note = reference_note(chart);
    for (const Mark& mark : chart.marks) {
        const auto starred = [](const std::string& text, bool dominated) { return text + (dominated ? " †" : ""); };
        std::vector<std::string> cells{code(mark.curve), mark.point + chart.unit()};
        if (!chart.replay) cells.push_back(count_text(mark.substeps));
        cells.push_back(scaled(mark.time));
        cells.push_back(starred(scaled(mark.error), mark.dominated));
        if (!chart.replay) {
            std::vector<std::string> forces;
            forces.reserve(laws.size());
            for (const Law& law : laws) {
                forces.push_back(starred(scaled(mark.force.at(law.number)), mark.force_dominated.at(law.number)));
            }
            cells.push_back(fmt::format("{}", fmt::join(forces, " / ")));
        }
        cells.push_back(mark.outcome.empty() ? "ok" : mark.outcome);
        table.rows.push_back({.cells = std::move(cells)});
        if (!mark.outcome.empty()) table.rows.back().style = TableRow::Style::failed;
        if (is_beaten(chart, mark)) table.rows.back().style = TableRow::Style::dominated;
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
            drawing.series.push_back({.name = mark.curve, .style = mark_style(style), .points = {}, .connected = true});
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
