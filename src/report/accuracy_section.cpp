#include "report/sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "measure/statistics.hpp"
#include "report/chart.hpp"
#include "report/metric_table.hpp"

namespace trocar {
namespace {

struct PairSums {
    double truth = 0.0;
    double touch = 0.0;
    double false_negatives = 0.0;
    double false_negatives_touch = 0.0;
    double false_positives = 0.0;
    bool known = false;
    void take(const SceneResult& result) {
        const double value = result.first(Metric::true_pairs);
        if (std::isnan(value)) return;
        known = true;
        truth += value;
        touch += result.first(Metric::true_touches);
        false_negatives += result.first(Metric::false_negatives);
        false_negatives_touch += result.first(Metric::false_negatives_touch);
        false_positives += result.first(Metric::false_positives);
    }
    [[nodiscard]] double found() const { return truth - false_negatives; }
};

std::vector<std::string> pair_cells(const PairSums& sums) {
    if (!sums.known) return {"n/a", "n/a", "n/a", "n/a", "n/a", "n/a", "n/a"};
    const double reported = sums.found() + sums.false_positives;
    const double firm = sums.truth - sums.touch;
    const double firm_found = firm - (sums.false_negatives - sums.false_negatives_touch);
    return {count_text(sums.truth),
            count_text(sums.touch),
            share_text(sums.found(), reported),
            share_text(sums.found(), sums.truth),
            share_text(firm_found, firm),
            share_text(2.0 * sums.found(), sums.truth + reported),
            count_text(sums.false_negatives) + " / " + count_text(sums.false_positives)};
}

std::string case_text(const SceneResult& result, const PairSums& sums) {
    for (const RunFigures& run : result.runs) {
        if (!run.ok()) return outcome_text(run.record->outcome);
    }
    if (!sums.known) return "not judged";
    const double cut = result.first(Metric::truncated_ticks);
    if (sums.false_negatives == 0.0 && sums.false_positives == 0.0 && !(cut > 0.0)) return "ok";
    std::string text;
    if (cut > 0.0) text = fmt::format("cut in {:.0f} ticks", cut);
    if (sums.false_negatives > 0.0)
        text += (text.empty() ? "" : ", ") + fmt::format("misses {:.0f} of {:.0f}", sums.false_negatives, sums.truth);
    if (sums.false_positives > 0.0)
        text += (text.empty() ? "" : ", ") + fmt::format("adds {:.0f}", sums.false_positives);
    return text;
}

std::string detection_chart(const Draft& draft, const std::vector<Method>& detectors,
                            const std::vector<std::string>& scenes) {
    DotChart chart;
    chart.x_title = "time per tick (µs), update + detect";
    chart.x_limit = 1000.0;
    chart.x_limit_name = "1 ms";
    chart.categories = scenes;
    int style = 0;
    for (const Method& detector : detectors) {
        DotChart::Series series;
        series.name = detector.detector;
        series.style = mark_style(style);
        ++style;
        for (const std::string& scene : scenes) {
            const SceneResult* result = draft.results.find(detector, scene);
            if (result == nullptr || !result->ok()) {
                series.dots.emplace_back();
                continue;
            }
            const double p50 = result->of(Metric::total_median_ns).value * us;
            const double p99 = result->of(Metric::total_p99_ns).value * us;
            series.dots.emplace_back(DotChart::Dot{
                .value = p50,
                .upper = p99,
                .name = fmt::format("{} on {}: median {} µs, p99 {}", detector.detector, scene, format_number(p50),
                                    std::isnan(p99) ? "n too small" : format_number(p99) + " µs")});
        }
        chart.series.push_back(std::move(series));
    }
    return draw(chart);
}

/// Depth left and tool force over time on the scene of the headline class where most is left.
void course_charts(Draft& draft, const std::vector<Method>& methods) {
    const auto [class_name, scenes] = draft.headline_scenes();
    std::string chosen;
    double most = -1.0;
    for (const std::string& scene : scenes) {
        for (const Method& method : methods) {
            const SceneResult* result = draft.results.find(method, scene);
            if (result == nullptr || !result->ok()) continue;
            if (result->first(Metric::residual_penetration_max_m) > most) {
                most = result->first(Metric::residual_penetration_max_m);
                chosen = scene;
            }
        }
    }
    if (chosen.empty()) return;
    LineChart depth{.x_title = "time (s), " + chosen, .y_title = "residual penetration (mm)", .lines = {}};
    LineChart force{.x_title = "time (s), " + chosen, .y_title = "tool force (N)", .lines = {}};
    std::set<std::string> seen;
    int style = 0;
    for (const Method& method : methods) {
        const SceneResult* result = draft.results.find(method, chosen);
        if (result == nullptr || !result->ok()) continue;
        const Record& record = *result->runs.front().record;
        if (!record.state_hash.empty() && !seen.insert(method.response + record.state_hash).second) continue;
        LineChart::Line line{.name = method.label(), .colour = style, .dash = style, .points = {}};
        ++style;
        LineChart::Line force_line = line;
        // At most 250 points a line: the largest value of each stretch, so that no peak is lost.
        const std::size_t stretch = std::max<std::size_t>(1, record.rows.size() / 250);
        for (std::size_t from = 0; from < record.rows.size(); from += stretch) {
            double largest_depth = not_known;
            double largest_force = not_known;
            for (std::size_t i = from; i < std::min(from + stretch, record.rows.size()); ++i) {
                const StepRow& row = record.rows[i];
                if (std::isfinite(row.residual_penetration))
                    largest_depth = std::fmax(largest_depth, row.residual_penetration * mm);
                if (row.tool_force.allFinite()) largest_force = std::fmax(largest_force, row.tool_force.norm());
            }
            if (!std::isnan(largest_depth)) line.points.emplace_back(record.rows[from].time, largest_depth);
            if (!std::isnan(largest_force)) force_line.points.emplace_back(record.rows[from].time, largest_force);
        }
        depth.lines.push_back(std::move(line));
        force.lines.push_back(std::move(force_line));
    }
    const std::string rule =
        " on " + code(chosen) + ", the " + class_name +
        " scene of the largest residual penetration. One line per different motion: methods with identical "
        "motion share one. Largest value of each stretch of ticks.";
    draft.figure("depth_over_time", depth, "Residual penetration" + rule);
    draft.figure("force_over_time", force, "Tool force" + rule);
}

std::string residual_text(const RunFigures& run) {
    if (std::isnan(run[Metric::residual_penetration_max_m])) return "n/a";
    return scaled(run[Metric::residual_penetration_median_m], mm) + " / " +
           scaled(run[Metric::residual_penetration_max_m], mm) + " / " +
           scaled(run[Metric::residual_penetration_final_m], mm) + undecided_text(run[Metric::side_undecided_max]);
}

MetricTable force_table(int processes) {
    MetricTable table{
        .caption = "Outcome of every closed-loop run (first process)",
        .mode = "closed_loop",
        .rows = MetricTable::Rows::motion,
        .columns = {{.header = "pairs per tick, mean / max", .metric = Metric::pairs_mean, .second = Metric::pairs_max},
                    {.header = "residual penetration, median / max / final (mm)",
                     .metric = Metric::residual_penetration_max_m,
                     .text = of_first(residual_text)},
                    {.header = "largest force (N)", .metric = Metric::force_max_n},
                    {.header = "force jump, p99 / max (N per tick)",
                     .metric = Metric::force_jump_p99_n,
                     .second = Metric::force_jump_max_n},
                    {.header = "force without touch (mm)", .metric = Metric::force_without_touch_m, .scale = mm},
                    {.header = "force flips (ticks)", .metric = Metric::force_flips, .count = true},
                    {.header = "largest strain", .metric = Metric::max_strain},
                    {.header = "ruptures", .metric = Metric::ruptures, .count = true}},
        .note =
            "Who moves alike, bit by bit, stands in one row; its pairs are those of the first. n/a of a p99: too few "
            "ticks."};
    if (processes > 1) {
        table.columns.push_back({.header = "same state in every process",
                                 .metric = Metric::ticks,
                                 .text = [](const SceneResult& result) { return yes_no(result.repeatable()); }});
    }
    return table;
}

}  // namespace

void add_detection(Draft& draft) {
    const std::vector<Method> detectors = draft.results.methods("replay");
    const std::vector<std::string> scenes = draft.results.scenes("replay");
    if (detectors.empty()) return;
    draft.heading(2, "Detection against the exact oracle");
    draft.paragraph(
        "Replay: the same frames for every detector. Truth is decided by exact arithmetic on the frame's own "
        "doubles; pairs that only touch in a vertex or an edge count, and recall is given with and without them.");
    const std::vector<Column> pair_columns{{"true pairs", true, Metric::true_pairs},
                                           {"of these touching", true, Metric::true_touches},
                                           {"precision", true, Metric::precision},
                                           {"recall", true, Metric::recall},
                                           {"recall without touches", true, Metric::recall_without_touches},
                                           {"F1", true, Metric::f1},
                                           {"false negatives / false positives", true, Metric::false_negatives}};
    Table table;
    table.caption = "All replayed scenes together";
    table.columns = {{"detector", false}};
    table.columns.insert(table.columns.end(), pair_columns.begin(), pair_columns.end());
    table.columns.push_back({"scenes ok", true});
    table.columns.push_back({"same pairs in every process", false});
    Table by_scene;
    by_scene.caption = "The same per scene";
    by_scene.folded = true;
    by_scene.columns = {{"scene", false}, {"detector", false}};
    by_scene.columns.insert(by_scene.columns.end(), pair_columns.begin(), pair_columns.end());
    Table matrix;
    matrix.caption = "Scene × detector: ok, or what went wrong";
    matrix.columns = {{"scene", false}};
    for (const Method& detector : detectors) {
        PairSums sums;
        int ok = 0;
        int planned = 0;
        bool repeatable = true;
        for (const std::string& scene : scenes) {
            const SceneResult* result = draft.results.find(detector, scene);
            if (result == nullptr || result->not_applicable()) continue;
            ++planned;
            ok += result->ok() ? 1 : 0;
            sums.take(*result);
            repeatable = repeatable && result->repeatable();
        }
        std::vector<std::string> cells{code(detector.detector)};
        const std::vector<std::string> pairs = pair_cells(sums);
        cells.insert(cells.end(), pairs.begin(), pairs.end());
        cells.push_back(fmt::format("{} of {}", ok, planned));
        cells.push_back(draft.most_processes() < 2 ? "n/a (one process)" : yes_no(repeatable));
        table.rows.push_back({.cells = cells});
        matrix.columns.push_back({code(detector.detector), false});
    }
    for (const std::string& scene : scenes) {
        std::vector<std::string> verdicts{scene};
        for (const Method& detector : detectors) {
            const SceneResult* result = draft.results.find(detector, scene);
            PairSums sums;
            if (result != nullptr) sums.take(*result);
            verdicts.push_back(result == nullptr ? "not run" : case_text(*result, sums));
            if (result == nullptr || result->not_applicable()) continue;
            std::vector<std::string> cells{scene, code(detector.detector)};
            const std::vector<std::string> pairs = pair_cells(sums);
            cells.insert(cells.end(), pairs.begin(), pairs.end());
            by_scene.rows.push_back({.cells = cells});
        }
        matrix.rows.push_back({.cells = verdicts});
    }
    draft.add(std::move(table));
    draft.add(std::move(matrix));
    draft.add(std::move(by_scene));
    draft.figure("detection_time", detection_chart(draft, detectors, scenes),
                 "Time per tick of each detector (update + detect) per scene: mark = median, whisker to the 99 % value "
                 "where there are 1000 ticks. Red: 1 ms.");
}

void add_contacts_and_forces(Draft& draft) {
    const std::vector<Method> methods = draft.results.methods("closed_loop");
    if (methods.empty()) return;
    draft.heading(2, "Contacts, depth and force");
    Table depth;
    depth.caption = "Depth error of contacts on the frame that detect saw: intersection beside native";
    depth.columns = {{"detector", false},
                     {"intersection, median / worst (mm)", true},
                     {"native, median / worst (mm)", true, Metric::native_depth_error_max_m},
                     {"native contacts per tick", true}};
    std::set<std::string> detectors;
    for (const Method& method : methods) detectors.insert(method.detector);
    for (const std::string& detector : detectors) {
        std::vector<std::string> cells{code(detector)};
        double native_contacts = not_known;
        for (const std::string source : {"intersection", "native"}) {
            std::vector<double> medians;
            double worst = not_known;
            for (const Method& method : methods) {
                if (method.detector != detector || method.contacts != source) continue;
                for (const std::string& scene : draft.results.scenes("closed_loop")) {
                    const SceneResult* result = draft.results.find(method, scene);
                    if (result == nullptr || !result->ok()) continue;
                    const double median_error = result->first(Metric::depth_error_median_m);
                    if (std::isnan(median_error)) continue;
                    medians.push_back(median_error);
                    const double error = result->first(Metric::depth_error_max_m);
                    worst = std::isnan(worst) ? error : std::max(worst, error);
                    if (source == "native") {
                        const double mean = result->first(Metric::native_contacts_mean);
                        if (!std::isnan(mean)) {
                            native_contacts = std::isnan(native_contacts) ? mean : std::max(native_contacts, mean);
                        }
                    }
                }
            }
            const double value = quantile(medians, 0.5);
            cells.push_back(std::isnan(value) ? (source == "native" ? "n/a" : "not judged")
                                              : format_number(value * mm) + " / " + format_number(worst * mm));
        }
        cells.push_back(format_number(native_contacts));
        depth.rows.push_back({.cells = cells});
    }
    if (std::all_of(depth.rows.begin(), depth.rows.end(),
                    [](const TableRow& row) { return row.cells.back() == "n/a"; })) {
        depth.columns.pop_back();
        for (TableRow& row : depth.rows) row.cells.pop_back();
    }
    depth.note =
        "Per tick: the worst |depth that a contact states - true depth at the contact's point|. Median over ticks "
        "and scenes / worst of all. Depths of the libraries refer to infinite planes of triangles and are often "
        "large on purpose; the error says how far they are from geometric depth, not that the library is broken.";
    draft.add(std::move(depth));

    Table force = table_of(draft, force_table(draft.most_processes("closed_loop")));
    note_undecided(draft, force);
    draft.add(std::move(force));
    course_charts(draft, methods);
}

}  // namespace trocar
