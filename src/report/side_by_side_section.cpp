// Detectors that take turns on generated scenes: time over size, every detector on every scene, and what one costs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "geometry/number_text.hpp"
#include "report/chart.hpp"
#include "report/metric_table.hpp"

namespace trocar {
namespace {

/// Generated scenes that differ in size only, by their number of triangles.
struct SceneFamily {
    std::string name;
    std::map<double, std::string> scenes;
};

std::vector<SceneFamily> scene_families(const Draft& draft) {
    std::map<std::string, SceneFamily> families;
    for (const Record& record : draft.records) {
        const std::string& family = fact_of(record, "scene.family");
        if (family.empty() || record.spec.mode != "replay") continue;
        families[family].name = family;
        families[family].scenes[number_of_text<double>(fact_of(record, "scene.triangles")).value_or(0.0)] =
            record.spec.scene;
    }
    std::vector<SceneFamily> list;
    list.reserve(families.size());
    for (auto& [name, family] : families) list.push_back(std::move(family));
    // Large families first, each a table of its own; the others share one.
    std::stable_sort(list.begin(), list.end(),
                     [](const SceneFamily& a, const SceneFamily& b) { return a.scenes.size() > b.scenes.size(); });
    return list;
}

/// Exact wherever it was compared.
bool is_right(const SceneResult& result) {
    return result.first(Metric::differing_ticks) == 0.0 && !(result.first(Metric::false_positives) > 0.0) &&
           !(result.first(Metric::proximity_false_negatives) > 0.0);
}

std::string cell_of_time(const SceneResult* result) {
    if (result == nullptr) return "–";
    return tick_text(*result) + (result->ok() && !is_right(*result) ? " †" : "");
}

/// Methods that ran on one of these scenes and took part on more than one scene of the study.
std::vector<Method> methods_on(const Draft& draft, const std::vector<std::string>& scenes) {
    std::vector<Method> list;
    for (const Method& method : draft.results.methods("replay")) {
        const auto ran_on = [&](const std::string& scene) {
            const SceneResult* result = draft.results.find(method, scene);
            return result != nullptr && !result->not_applicable();
        };
        if (std::none_of(scenes.begin(), scenes.end(), ran_on)) continue;
        const std::vector<std::string> all = draft.results.scenes("replay");
        if (std::count_if(all.begin(), all.end(), ran_on) > 1) list.push_back(method);
    }
    return list;
}

/// Rows by the number of scenes that a detector ran on, then by the time on the last of them.
Table time_matrix(const Draft& draft, const std::string& caption, const std::vector<std::string>& scenes) {
    Table table;
    table.caption = caption;
    table.columns = {{"detector", false}};
    for (const std::string& scene : scenes) table.columns.push_back({scene + " (µs)", true, Metric::total_median_ns});
    using Order = std::pair<int, double>;  // scenes without a time, and the time on the last scene with one
    std::vector<std::pair<Order, TableRow>> rows;
    for (const Method& method : methods_on(draft, scenes)) {
        TableRow row{.cells = {code(method.label())}};
        Order order{static_cast<int>(scenes.size()), 0.0};
        for (const std::string& scene : scenes) {
            const SceneResult* result = draft.results.find(method, scene);
            row.cells.push_back(cell_of_time(result));
            if (result != nullptr && result->ok()) {
                order = {order.first - 1, result->of(Metric::total_median_ns).value};
            }
        }
        if (draft.results.fact(method, "detector.own") == "yes") row.style = TableRow::Style::own;
        rows.emplace_back(order, std::move(row));
    }
    std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [order, row] : rows) table.rows.push_back(std::move(row));
    table.note =
        "Medians of update and detect together, those that ran everywhere first, in order of the last column. † pair "
        "set differs from truth or from an exact detector; – too slow at this size to be asked, or not asked.";
    return table;
}

ScatterChart time_over_size(const Draft& draft, const SceneFamily& family) {
    ScatterChart chart;
    chart.x_title = "triangles in the scene: " + family.name;
    chart.y_title = "median time of a tick, update and detect (µs)";
    std::vector<std::string> scenes;
    for (const auto& [triangles, scene] : family.scenes) scenes.push_back(scene);
    for (const Method& method : methods_on(draft, scenes)) {
        // Settings are in the tables: as many lines as colours.
        if (method.detector.find(':') != std::string::npos || !method.contacts.empty()) continue;
        ChartSeries series{.name = method.detector,
                           .style = mark_style(static_cast<int>(chart.series.size())),
                           .points = {},
                           .connected = true};
        for (const auto& [triangles, scene] : family.scenes) {
            const SceneResult* result = draft.results.find(method, scene);
            if (result == nullptr || !result->ok()) continue;
            const double time = result->of(Metric::total_median_ns).value * us;
            series.points.push_back({triangles, time,
                                     fmt::format("{}, {}: {} µs{}", method.detector, scene, format_number(time),
                                                 is_right(*result) ? "" : ", pair set differs"),
                                     ""});
        }
        if (!series.points.empty()) chart.series.push_back(std::move(series));
    }
    return chart;
}

std::string exactness(const RunFigures& run) { return of_text(run[Metric::differing_ticks], run[Metric::timed_ticks]); }

MetricTable costs_table() {
    MetricTable table{
        .caption = "Cost of every detector and setting on generated scenes",
        .mode = "replay",
        .columns = {count_column("n (ticks)", Metric::timed_ticks), time_column("p50 (µs)", Metric::total_median_ns),
                    time_column("p99 (µs)", Metric::total_p99_ns, Processes::interval, too_few),
                    value_column("update (µs)", Metric::update_median_ns, us),
                    value_column("detect (µs)", Metric::detect_median_ns, us),
                    value_column("prepare (ms)", Metric::prepare_ns, ms),
                    value_column("memory (MB)", Metric::memory_bytes, 1e-6), value_column("work", Metric::work_median),
                    text_column("ticks that differ", Metric::differing_ticks, exactness)}};
    table.keep = [](const RunFigures& run) { return !std::isnan(run[Metric::differing_ticks]); };
    table.note =
        "Work: vertices read + cells visited + box tests + triangle tests, as far as an adapter can see them. Memory: "
        "growth of the process.";
    return table;
}

std::string work_over_usual(const RunFigures& run) {
    return scaled(run[Metric::work_max] / run[Metric::work_in_contact_median]);
}

}  // namespace

void add_side_by_side(Draft& draft) {
    const std::vector<SceneFamily> families = scene_families(draft);
    if (families.empty()) return;
    draft.heading(2, "Detectors in turns on generated scenes");
    draft.paragraph(
        "Each scene is one process in which all detectors take turns in random order: 8 blocks of consecutive ticks "
        "each, with an untimed tick before every block. A tick is update and detect, from a frame that was just "
        "written to the sorted list of all pairs. Times are CPU time of the process with all its threads. Slow "
        "detectors take fewer ticks. The first tick of each block is compared with the exact oracle, every other with "
        "an exact detector that agreed with it.");
    int number = 0;
    std::vector<std::string> others;
    for (const SceneFamily& family : families) {
        std::vector<std::string> scenes;
        for (const auto& [triangles, scene] : family.scenes) scenes.push_back(scene);
        if (scenes.size() < 2) {
            others.push_back(scenes.front());
            continue;
        }
        draft.figure(
            fmt::format("time_over_size_{}", ++number), time_over_size(draft, family),
            "Every vertex that the scene moves is new at every tick. A line that stops was left out above that "
            "size (too slow to be worth the time).");
        draft.add(time_matrix(draft, "Over size: " + family.name, scenes));
    }
    if (!others.empty()) draft.add(time_matrix(draft, "Other scenes", others));
    draft.add(table_of(draft, costs_table()));
}

Table repeated_motion_table(const Draft& draft) {
    MetricTable table{.caption = "Worst tick of a repeated motion",
                      .mode = "repeated_motion",
                      .columns = {count_column("n (ticks)", Metric::timed_ticks),
                                  value_column("work p50 in contact", Metric::work_in_contact_median),
                                  value_column("work max", Metric::work_max),
                                  text_column("max / p50", Metric::work_max, work_over_usual),
                                  value_column("p50 (µs)", Metric::total_median_ns, us),
                                  time_column("p99 (µs)", Metric::total_p99_ns, Processes::first, too_few),
                                  time_column("p99.9 (µs)", Metric::total_p999_ns, Processes::first, too_few),
                                  time_column("max (µs)", Metric::total_max_ns, Processes::every),
                                  {.header = "false negatives / true pairs",
                                   .metric = Metric::false_negatives,
                                   .second = Metric::true_pairs,
                                   .count = true}}};
    table.note =
        "The motion of a scene again and again, each time in another direction, driven by a neutral spring per pair. "
        "Work does not depend on the machine; the longest times do. What a library does inside is not in its work.";
    table.folded = false;
    return table_of(draft, table);
}

void add_repeated_motion(Draft& draft) {
    Table table = repeated_motion_table(draft);
    if (table.rows.empty()) return;
    draft.heading(2, "Repeated motion");
    draft.add(std::move(table));
}

}  // namespace trocar
