// What a tick costs against the size of the tissue: time per stage over the number of triangles, for each family of
// scenes and each combination of methods.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <map>
#include <set>

#include "geometry/number_text.hpp"
#include "report/chart.hpp"
#include "report/metric_table.hpp"

namespace trocar {
namespace {

/// One family of scenes with one combination of methods.
struct Family {
    std::string scenes;
    std::string methods;
    std::string stepper;  ///< the default one has its name here, which a specification leaves out
    auto operator<=>(const Family&) const = default;
};

struct Size {
    double triangles = not_known;  ///< of tissue
    const SceneResult* result = nullptr;
};

/// A run that ended before it counted them has the triangles of another run on the scene.
double triangles_of(const Draft& draft, const std::string& scene) {
    double triangles = not_known;
    for (const RunFigures& run : draft.results.runs()) {
        if (run.record->spec.mode != "cost_by_size" || run.record->spec.scene != scene) continue;
        triangles = std::fmax(triangles,
                              number_of_text<double>(fact_of(*run.record, "run.tissue_triangles")).value_or(not_known));
    }
    return triangles;
}

/// Sizes ascending.
std::map<Family, std::vector<Size>> families_of(const Draft& draft) {
    std::map<Family, std::vector<Size>> families;
    for (const Method& method : draft.results.methods("cost_by_size")) {
        for (const SceneResult* result : possible(draft.results, method).results) {
            const std::string& scene = result->scene();
            const std::string& stepper = fact_of(result->record(), "run.stepper");
            families[{scene.substr(0, scene.rfind('_')), method.detector + " + " + method.response,
                      stepper.empty() ? method.stepper : stepper}]
                .push_back({triangles_of(draft, scene), result});
        }
    }
    for (auto& [family, sizes] : families) {
        std::stable_sort(sizes.begin(), sizes.end(),
                         [](const Size& a, const Size& b) { return or_last(a.triangles) < or_last(b.triangles); });
    }
    return families;
}

ScatterChart drawing_of(const Family& family, const std::vector<Size>& sizes) {
    ScatterChart chart;
    chart.x_title = fmt::format("tissue triangles, {}, {}", family.scenes, family.stepper);
    chart.y_title = "median time per tick (µs)";
    std::vector<std::string> stages{"total"};
    stages.insert(stages.end(), stage_names.begin(), stage_names.end());
    for (const std::string& stage : stages) {
        const int style = static_cast<int>(chart.series.size());
        ChartSeries series{.name = stage == "total" ? "whole tick" : stage,
                           .style = {.colour = style, .shape = style, .hollow = stage != "total"},
                           .connected = true};
        for (const Size& size : sizes) {
            const double time = size.result->of(metric_of(stage + "_median_ns")).value * us;
            if (!size.result->ok() || std::isnan(time) || std::isnan(size.triangles)) continue;
            series.points.push_back({.x = size.triangles,
                                     .y = time,
                                     .name = fmt::format("{}, {} triangles, {}: {} µs", size.result->scene(),
                                                         count_text(size.triangles), series.name, format_number(time)),
                                     .label = {}});
        }
        if (!series.points.empty()) chart.series.push_back(std::move(series));
    }
    return chart;
}

Table size_table(const std::map<Family, std::vector<Size>>& families) {
    std::vector<MetricColumn> columns{count_column("n per process (ticks)", Metric::timed_ticks, Processes::median),
                                      text_column("whole tick (µs)", [](const ResultSet& results) {
                                          return estimate_text(results.results.front()->of(Metric::total_median_ns),
                                                               us);
                                      })};
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        columns.push_back(text_column(std::string(stage_names.at(stage)) + " (µs)", [stage](const ResultSet& results) {
            return scaled(results.results.front()->of(stage_median(stage)).value, us);
        }));
    }
    std::vector<MetricRow> rows;
    for (const auto& [family, sizes] : families) {
        for (const Size& size : sizes) {
            const SceneResult& result = *size.result;
            rows.push_back({.names = {result.scene(), code(family.methods), code(family.stepper),
                                      count_text(size.triangles), count_text(result.first(Metric::substeps))},
                            .results = {{&result}},
                            .failure = result.ok() ? nullptr : &result.failure()});
        }
    }
    return table_of(
        {.caption = "Median time per tick and stage against size",
         .columns = {{"scene", false},
                     {"detector + response", false},
                     {"stepper", false},
                     {"tissue triangles", true},
                     {"sub-steps per tick", true, Metric::substeps}},
         .note = "Ticks back to back, not judged; the first ones are dropped. A sub-step of an explicit stepper must "
                 "be shorter the shorter the edges are: its tick grows faster than its mesh."},
        columns, rows);
}

}  // namespace

Table size_page(const Draft& draft) {
    // By family of scenes, methods, size and scene; the results by stepper.
    std::map<std::tuple<std::string, std::string, double, std::string>, std::map<std::string, const SceneResult*>>
        by_stepper;
    std::set<std::string> steppers;
    for (const auto& [family, sizes] : families_of(draft)) {
        steppers.insert(family.stepper);
        for (const auto& [triangles, result] : sizes) {
            by_stepper[{family.scenes, family.methods, or_last(triangles), result->scene()}][family.stepper] = result;
        }
    }
    Table table{.caption = "Whole tick against size, median (µs)",
                .columns = {{"scene", false}, {"detector + response", false}, {"tissue triangles", true}}};
    for (const std::string& stepper : steppers) table.columns.push_back({code(stepper), true});
    for (auto& [key, results] : by_stepper) {
        const auto& [family, methods, triangles, scene] = key;
        table.rows.push_back(
            {.cells = {scene, code(methods), std::isinf(triangles) ? unknown_text : count_text(triangles)}});
        for (const std::string& stepper : steppers) {
            const SceneResult* const result = results[stepper];
            table.rows.back().cells.push_back(result == nullptr ? "" : tick_text(*result));
        }
    }
    return table;
}

void add_cost_by_size(Draft& draft) {
    const std::map<Family, std::vector<Size>> families = families_of(draft);
    if (families.empty()) return;
    draft.heading(2, "Cost by size");
    draft.paragraph(
        "What a tick costs against the number of tissue triangles, stages apart, both axes logarithmic. "
        "Scenes of a family have the same content on finer and finer meshes.");
    int number = 0;
    for (const auto& [family, sizes] : families) {
        draft.figure(
            fmt::format("cost_by_size_{}", ++number), drawing_of(family, sizes),
            fmt::format("Median time per stage against the number of tissue triangles: {} with {}, stepper {}.",
                        family.scenes, code(family.methods), code(family.stepper)));
    }
    draft.add(size_table(families));
}

}  // namespace trocar
