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

/// What a point is judged by: what is left or wrong, and its force against the two laws that a reference is solved for.
enum class Judge : std::uint8_t { residual, equal_k, hard };
constexpr std::size_t judge_count = 3;
constexpr std::array laws{Judge::equal_k, Judge::hard};
constexpr std::array<const char*, judge_count> law_names{"", "contact of equal k", "hard contact"};

struct JudgedError {
    double value = not_known;  ///< mm or pairs; N RMS
    /// N RMS: what the references of this point's k themselves may be off; errors below it are alike.
    double bound = not_known;
    bool dominated = false;  ///< another point is at least as fast and as good, and better in one
    [[nodiscard]] double printed() const { return std::isnan(value) ? not_known : as_printed(std::fmax(value, bound)); }
};

/// One point of a curve.
struct Mark {
    std::string curve = {};
    std::string point = {};
    double time = not_known;  ///< µs of computing per simulated ms, median over processes
    std::array<JudgedError, judge_count> errors{};
    double substeps = not_known;
    double recall = not_known;
    double recall_deepest = not_known;
    std::string outcome = {};  ///< empty: ok
    [[nodiscard]] const JudgedError& error(Judge judge) const { return errors.at(static_cast<std::size_t>(judge)); }
    [[nodiscard]] double residual() const { return error(Judge::residual).value; }
};

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
    [[nodiscard]] std::string error_title(Judge judge) const {
        if (judge == Judge::residual)
            return replay ? "false negatives + false positives" : "residual penetration, max (mm)";
        return fmt::format("force error against {} (N RMS)", law_names.at(static_cast<std::size_t>(judge)));
    }
    /// False where every force error lies within the bound, or none is known.
    [[nodiscard]] bool ranks(Judge judge) const {
        return judge == Judge::residual || std::any_of(marks.begin(), marks.end(), [judge](const Mark& mark) {
                   return mark.error(judge).value > mark.error(judge).bound;
               });
    }
    /// Of all points' references.
    [[nodiscard]] std::string bound_text(Judge judge) const {
        double least = not_known;
        double largest = not_known;
        for (const Mark& mark : marks) {
            least = std::fmin(least, mark.error(judge).bound);
            largest = std::fmax(largest, mark.error(judge).bound);
        }
        return least < largest ? scaled(least) + " to " + scaled(largest) : scaled(largest);
    }
    /// Of the points with a time and an error, the one of the least error, the fastest of equals; null without any or
    /// where the reference cannot rank.
    [[nodiscard]] const Mark* best(Judge judge) const {
        const auto rank = [judge](const Mark& m) { return std::pair(m.error(judge).printed(), m.time); };
        const Mark* best = nullptr;
        for (const Mark& mark : marks) {
            if (std::isnan(mark.time) || std::isnan(mark.residual()) || std::isnan(mark.error(judge).value)) continue;
            if (ranks(judge) && (best == nullptr || rank(mark) < rank(*best))) best = &mark;
        }
        return best;
    }
    [[nodiscard]] const Mark* fastest() const {
        const auto rank = [](const Mark& m) { return std::pair(m.time, m.residual()); };
        const Mark* best = nullptr;
        for (const Mark& mark : marks) {
            if (std::isnan(mark.time) || std::isnan(mark.residual())) continue;
            if (best == nullptr || rank(mark) < rank(*best)) best = &mark;
        }
        return best;
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
    mark.errors = {{{.value = replay ? first(Metric::false_negatives) + first(Metric::false_positives)
                                     : first(Metric::residual_penetration_max_m) * mm},
                    {.value = first(Metric::force_error_rms_equal_k), .bound = first(Metric::force_bound_equal_k)},
                    {.value = first(Metric::force_error_rms_hard), .bound = first(Metric::force_bound_hard)}}};
    mark.substeps = first(Metric::substeps);
    mark.recall = first(Metric::recall);
    mark.recall_deepest = first(Metric::recall_deepest);
    return mark;
}

/// In time better only beyond the noise.
void mark_dominated(Chart& chart, double noise_floor) {
    const double noise = std::isnan(noise_floor) ? 1.0 : noise_floor;
    for (Mark& mark : chart.marks) {
        for (std::size_t judge = 0; judge < judge_count; ++judge) {
            JudgedError& error = mark.errors.at(judge);
            error.dominated = std::any_of(chart.marks.begin(), chart.marks.end(), [&](const Mark& other) {
                const double other_error = other.errors.at(judge).printed();
                return other.time <= mark.time && other_error <= error.printed() &&
                       (other.time * noise < mark.time || other_error < error.printed());
            });
        }
    }
}

std::vector<Chart> charts_of(const Draft& draft) {
    using Curve = std::map<Point, std::vector<const Record*>>;
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

std::string mark_text(const Chart& chart, const Mark& mark) {
    return fmt::format("{} at {}{}", code(mark.curve), mark.point, chart.unit());
}

Table ends_table(const std::vector<Chart>& charts) {
    Table table;
    table.caption = "The ends of every chart: least error and fastest";
    for (const Chart& chart : charts) {
        const Mark* const exact = chart.best(Judge::residual);
        if (exact == nullptr) continue;
        table.rows.push_back({});
        add_cell(table, {"scene"}, chart.scene);
        add_cell(table, {"knob"}, chart.knob);
        for (const auto& [header, mark] :
             {std::pair("least residual penetration, or fewest pairs wrong", exact), {"fastest", chart.fastest()}}) {
            add_cell(table, {header}, mark_text(chart, *mark));
            add_cell(table, {"its error", true}, scaled(mark->residual()) + (chart.replay ? " pairs" : " mm"));
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
        for (const Judge law : laws) {
            const Mark* const best = chart.best(law);
            const Mark mark = best == nullptr ? Mark{} : *best;
            const JudgedError& force = mark.error(law);
            table.rows.push_back({});
            add_cell(table, {"scene"}, chart.scene);
            add_cell(table, {"knob"}, chart.knob);
            add_cell(table, {"against"}, law_names.at(static_cast<std::size_t>(law)));
            add_cell(table, {"least force error"}, best == nullptr ? "not ranked" : mark_text(chart, mark));
            add_cell(table, {"its force error (N RMS)", true},
                     force.value <= force.bound ? "≤ " + scaled(force.bound) : scaled(force.value, 1.0, ""));
            add_cell(table, {"bound of the reference (N RMS)", true},
                     best == nullptr ? chart.bound_text(law) : scaled(force.bound));
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

Table points_table(const Chart& chart) {
    Table table{.caption = fmt::format("{}: {}", chart.scene, chart.knob),
                .note = chart.replay ? std::string() : reference_note(chart),
                .folded = true};
    for (const Mark& mark : chart.marks) {
        const auto starred = [&mark](Judge judge) {
            return scaled(mark.error(judge).value) + (mark.error(judge).dominated ? " †" : "");
        };
        const auto is_beaten = [&](Judge judge) { return mark.error(judge).dominated || !chart.ranks(judge); };
        const bool all_beaten = is_beaten(Judge::residual) && std::all_of(laws.begin(), laws.end(), is_beaten);
        table.rows.push_back({.style = all_beaten              ? TableRow::Style::dominated
                                       : !mark.outcome.empty() ? TableRow::Style::failed
                                                               : TableRow::Style::normal});
        add_cell(table, {"method"}, code(mark.curve));
        add_cell(table, {chart.knob, true}, mark.point + chart.unit());
        if (!chart.replay) add_cell(table, {"sub-steps per tick", true, Metric::substeps}, count_text(mark.substeps));
        add_cell(table, {"time per simulated ms (µs)", true}, scaled(mark.time));
        add_cell(table, {chart.error_title(Judge::residual), true}, starred(Judge::residual));
        if (chart.replay) {
            add_cell(table, {"recall", true, Metric::recall}, scaled(mark.recall));
            add_cell(table, {"recall of the ten deepest", true, Metric::recall_deepest}, scaled(mark.recall_deepest));
        } else {
            add_cell(table, {"force error, equal k / hard (N RMS)", true, Metric::force_error_rms_equal_k},
                     starred(Judge::equal_k) + " / " + starred(Judge::hard));
        }
        add_cell(table, {"outcome"}, mark.outcome.empty() ? "ok" : mark.outcome);
    }
    return table;
}

/// Without series when no point has a place on a curve.
ScatterChart drawing_of(const Chart& chart, Judge judge) {
    const char* const unit = judge != Judge::residual ? "N" : chart.replay ? "pairs wrong" : "mm";
    ScatterChart drawing;
    drawing.x_title = fmt::format("time per simulated ms (µs), {}, {}", chart.scene, chart.knob);
    drawing.y_title = chart.error_title(judge);
    drawing.x_limit = 1000.0;
    drawing.x_limit_name = "1 ms";
    for (const Mark& mark : chart.marks) {
        const double error = mark.error(judge).value;
        if (std::isnan(mark.time) || std::isnan(error)) continue;
        if (drawing.series.empty() || drawing.series.back().name != mark.curve) {
            const int style = static_cast<int>(drawing.series.size());
            drawing.series.push_back({.name = mark.curve, .style = mark_style(style), .connected = true});
        }
        drawing.series.back().points.push_back(
            {.x = mark.time,
             .y = error,
             .name = fmt::format("{}, {} = {}{}: {} µs, {} {}", mark.curve, chart.knob, mark.point, chart.unit(),
                                 format_number(mark.time), format_number(error), unit),
             .label = mark.point});
        if (!mark.error(judge).dominated) drawing.front.emplace_back(mark.time, error);
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
        const Mark* const exact = chart.best(Judge::residual);
        if (chart.replay || exact == nullptr) continue;
        const auto report = [&chart](const Mark& mark) {
            return fmt::format("{} ({} mm at worst, {} µs per simulated ms)", mark_text(chart, mark),
                               scaled(mark.residual()), scaled(mark.time));
        };
        return fmt::format("On {} over {}, the least residual penetration is that of {}; fastest is {}.", chart.scene,
                           code(chart.knob), report(*exact), report(*chart.fastest()));
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
        const std::string unit = chart.unit();
        const std::string over =
            fmt::format("{} over {}{}; labels are the knob's values at the ends of a curve", code(chart.scene),
                        code(chart.knob), unit.empty() ? "" : " (" + unit.substr(1) + ")");
        const std::string name = fmt::format("work_precision_{}", ++number);
        draft.figure(name, drawing_of(chart, Judge::residual), "Work and precision on " + over + ".");
        for (const Judge law : laws) {
            if (!chart.ranks(law)) continue;
            draft.figure(name + (law == Judge::hard ? "_hard" : "_equal_k"), drawing_of(chart, law),
                         fmt::format("Work and force error against {} on {}. The reference itself knows {} N.",
                                     law_names.at(static_cast<std::size_t>(law)), over, chart.bound_text(law)));
        }
        draft.add(points_table(chart));
    }
}

}  // namespace trocar
