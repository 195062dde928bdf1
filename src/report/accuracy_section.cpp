#include "report/sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "report/chart.hpp"
#include "report/metric_table.hpp"

namespace trocar {
namespace {

/// Pairs of a detector over its scenes; NaN: not judged.
struct Pairs {
    double truth;
    double touch;
    double false_negatives;
    double false_negatives_touch;
    double false_positives;
    explicit Pairs(const ResultSet& results)
        : truth(results.sum(Metric::true_pairs)),
          touch(results.sum(Metric::true_touches)),
          false_negatives(results.sum(Metric::false_negatives)),
          false_negatives_touch(results.sum(Metric::false_negatives_touch)),
          false_positives(results.sum(Metric::false_positives)) {}
    [[nodiscard]] double found() const { return truth - false_negatives; }
    [[nodiscard]] double reported() const { return found() + false_positives; }
    [[nodiscard]] double firm() const { return truth - touch; }
    [[nodiscard]] double firm_found() const { return firm() - (false_negatives - false_negatives_touch); }
};

std::vector<MetricColumn> pair_columns() {
    const auto share = [](const char* header, Metric metric, std::string (*text)(const Pairs&)) {
        return MetricColumn{.header = header, .metric = metric, .text = [text](const ResultSet& results) {
                                return text(Pairs(results));
                            }};
    };
    const auto count = [](const char* header, Metric metric) {
        return count_column(header, metric, Processes::first, Over::sum);
    };
    std::vector<MetricColumn> columns{
        count("true pairs", Metric::true_pairs),
        count("of these touching", Metric::true_touches),
        share("precision", Metric::precision, [](const Pairs& p) { return share_text(p.found(), p.reported()); }),
        share("recall", Metric::recall, [](const Pairs& p) { return share_text(p.found(), p.truth); }),
        share("recall without touches", Metric::recall_without_touches,
              [](const Pairs& p) { return share_text(p.firm_found(), p.firm()); }),
        share("F1", Metric::f1, [](const Pairs& p) { return share_text(2.0 * p.found(), p.truth + p.reported()); }),
        count("false negatives / false positives", Metric::false_negatives)};
    columns.back().second = Metric::false_positives;
    return columns;
}

std::string case_text(const SceneResult* result) {
    if (result == nullptr) return "not run";
    if (!result->ok()) return outcome_text(result->failure());
    const Pairs pairs({{result}});
    if (std::isnan(pairs.truth)) return "not judged";
    std::vector<std::string> faults;
    const double cut = result->first(Metric::truncated_ticks);
    if (cut > 0.0) faults.push_back("cut in " + count_text(cut) + " ticks");
    if (pairs.false_negatives > 0.0) faults.push_back("misses " + of_text(pairs.false_negatives, pairs.truth));
    if (pairs.false_positives > 0.0) faults.push_back("adds " + count_text(pairs.false_positives));
    return faults.empty() ? "ok" : joined(faults);
}

/// Results with contacts of one generator whose depth is judged.
ResultSet judged_contacts(const ResultSet& results, const std::string& contacts) {
    ResultSet some = results;
    std::erase_if(some.results, [&contacts](const SceneResult* result) {
        return result->record().spec.contacts != contacts || std::isnan(result->first(Metric::depth_error_median_m));
    });
    return some;
}

MetricColumn depth_column(const std::string& contacts, std::optional<Metric> metric, const char* unknown) {
    return {.header = contacts + ", median / worst (mm)", .metric = metric, .text = [=](const ResultSet& results) {
                const ResultSet some = judged_contacts(results, contacts);
                return two_text(some.median(Metric::depth_error_median_m), some.largest(Metric::depth_error_max_m), mm,
                                unknown);
            }};
}

Table depth_table(const Draft& draft) {
    std::map<std::string, ResultSet> by_detector;
    for (const Method& method : draft.results.methods("closed_loop")) {
        ResultSet& set = by_detector[method.detector];
        for (const SceneResult* result : possible(draft.results, method).ok().results) set.results.push_back(result);
    }
    std::vector<MetricColumn> columns{
        depth_column("intersection", std::nullopt, "not judged"),
        depth_column("native", Metric::native_depth_error_max_m, unknown_text),
        {.header = "native contacts per tick",
         .metric = Metric::native_contacts_mean,
         .text = [](const ResultSet& results) {
             return scaled(judged_contacts(results, "native").largest(Metric::native_contacts_mean));
         }}};
    std::vector<MetricRow> rows;
    bool native = false;
    for (const auto& [detector, results] : by_detector) {
        rows.push_back({.names = {code(detector)}, .results = results});
        native = native || judged_contacts(results, "native").count() > 0;
    }
    if (!native) columns.pop_back();
    return table_of(
        {.caption = "Depth error of contacts on the frame that detect saw: intersection beside native",
         .columns = {{"detector", false}},
         .note =
             "Per tick: the worst |depth that a contact states - true depth at the contact's point|. Median over ticks "
             "and scenes / worst of all. Depths of the libraries refer to infinite planes of triangles and are often "
             "large on purpose; the error says how far they are from geometric depth, not that the library is broken."},
        columns, rows);
}

Table outcome_matrix(const Draft& draft, const std::vector<Method>& detectors, const std::vector<std::string>& scenes) {
    Table matrix{.caption = "Scene × detector: ok, or what went wrong", .columns = {{"scene", false}}};
    for (const Method& detector : detectors) matrix.columns.push_back({code(detector.label()), false});
    for (const std::string& scene : scenes) {
        matrix.rows.push_back({.cells = {scene}});
        for (const Method& detector : detectors) {
            matrix.rows.back().cells.push_back(case_text(draft.results.find(detector, scene)));
        }
    }
    return matrix;
}

/// Depth left and tool force over time on the scene of the headline class where most is left.
void course_charts(Draft& draft, const std::vector<Method>& methods) {
    const auto [class_name, scenes] = draft.headline_scenes();
    std::string chosen;
    double most = -1.0;
    for (const std::string& scene : scenes) {
        for (const Method& method : methods) {
            const SceneResult* result = draft.results.find(method, scene);
            if (result == nullptr || !result->ok() || !(result->first(Metric::residual_penetration_max_m) > most))
                continue;
            most = result->first(Metric::residual_penetration_max_m);
            chosen = scene;
        }
    }
    if (chosen.empty()) return;
    LineChart depth{.x_title = "time (s), " + chosen, .y_title = "residual penetration (mm)"};
    LineChart force{.x_title = "time (s), " + chosen, .y_title = "tool force (N)"};
    std::set<std::string> seen;
    int style = 0;
    for (const Method& method : methods) {
        const SceneResult* result = draft.results.find(method, chosen);
        if (result == nullptr || !result->ok()) continue;
        const Record& record = *result->runs.front().record;
        if (!record.state_hash.empty() && !seen.insert(method.response + record.state_hash).second) continue;
        LineChart::Line line{.name = method.label(), .colour = style, .dash = style};
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
    if (std::isnan(run[Metric::residual_penetration_max_m])) return unknown_text;
    return two_text(run[Metric::residual_penetration_median_m], run[Metric::residual_penetration_max_m], mm) + " / " +
           scaled(run[Metric::residual_penetration_final_m], mm) + undecided_text(run[Metric::side_undecided_max]);
}

MetricTable force_table(int processes) {
    MetricTable table{
        .caption = "Outcome of every closed-loop run (first process)",
        .mode = "closed_loop",
        .rows = MetricTable::Rows::motion,
        .columns = {two_column("pairs per tick, mean / max", Metric::pairs_mean, Metric::pairs_max),
                    text_column("residual penetration, median / max / final (mm)", Metric::residual_penetration_max_m,
                                residual_text),
                    value_column("largest force (N)", Metric::force_max_n),
                    two_column("force jump, p99 / max (N per tick)", Metric::force_jump_p99_n,
                               Metric::force_jump_max_n),
                    value_column("force without touch (mm)", Metric::force_without_touch_m, mm),
                    count_column("force flips (ticks)", Metric::force_flips),
                    value_column("largest strain", Metric::max_strain), count_column("ruptures", Metric::ruptures)},
        .note =
            "Who moves alike, bit by bit, stands in one row; its pairs are those of the first. n/a of a p99: too few "
            "ticks."};
    if (processes > 1) {
        table.columns.push_back(text_column("same state in every process", [](const ResultSet& results) {
            return yes_no(results.results.front()->repeatable());
        }));
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
    std::vector<MetricRow> rows;
    rows.reserve(detectors.size());
    for (const Method& detector : detectors) {
        rows.push_back({.names = {code(detector.label())}, .results = possible(draft.results, detector)});
    }
    std::vector<MetricColumn> columns = pair_columns();
    columns.push_back(text_column("scenes ok", [](const ResultSet& results) {
        return fmt::format("{} of {}", results.ok().count(), results.count());
    }));
    const bool one_process = draft.most_processes() < 2;
    columns.push_back(text_column(
        "same pairs in every process",
        [one_process](const ResultSet& results) {
            return one_process ? "n/a (one process)"
                               : yes_no(std::all_of(results.results.begin(), results.results.end(),
                                                    [](const SceneResult* result) { return result->repeatable(); }));
        },
        true));
    draft.add(table_of({.caption = "All replayed scenes together", .columns = {{"detector", false}}}, columns, rows));
    // The page has the width for so many columns, and a chart the colours for little more.
    constexpr std::size_t most_columns = 12;
    const bool fits = detectors.size() <= most_columns;
    if (fits) draft.add(outcome_matrix(draft, detectors, scenes));
    draft.add(table_of(draft, {.caption = "The same per scene", .mode = "replay", .columns = pair_columns()}));
}

void add_contacts_and_forces(Draft& draft) {
    const std::vector<Method> methods = draft.results.methods("closed_loop");
    if (methods.empty()) return;
    draft.heading(2, "Contacts, depth and force");
    draft.add(depth_table(draft));
    Table force = table_of(draft, force_table(draft.most_processes("closed_loop")));
    note_undecided(draft, force);
    draft.add(std::move(force));
    course_charts(draft, methods);
}

}  // namespace trocar
