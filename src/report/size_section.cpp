// What a tick costs against the size of the tissue: time per stage over the number of triangles, for each family of
// scenes and each combination of methods.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "measure/metrics.hpp"
#include "report/chart.hpp"
#include "report/sections.hpp"

namespace trocar {
namespace {

/// One family of scenes with one combination of methods.
struct Family {
    std::string scenes;
    std::string methods;
    std::string stepper;
    bool operator<(const Family& other) const {
        return std::tie(scenes, methods, stepper) < std::tie(other.scenes, other.methods, other.stepper);
    }
};

/// All processes of one scene.
struct Size {
    double triangles = not_known;
    std::string scene = {};
    std::vector<const Record*> runs = {};
    [[nodiscard]] const Record* failed() const {
        for (const Record* run : runs) {
            if (!run->outcome.ok()) return run;
        }
        return nullptr;
    }
    [[nodiscard]] Estimate time(Metric metric) const {
        std::vector<double> values;
        values.reserve(runs.size());
        for (const Record* run : runs) values.push_back(value_of(run->summary, metric));
        return across_processes(values);
    }
};

double triangles_of(const Record& record) {
    const std::string& found = fact_of(record, "run.tissue_triangles");
    return found.empty() ? not_known : std::strtod(found.c_str(), nullptr);
}

/// Name of the default one included, which a specification leaves out.
std::string stepper_of(const Record& record) {
    const std::string& found = fact_of(record, "run.stepper");
    return found.empty() ? record.spec.stepper : found;
}

/// For an order of sizes: what nobody knows is last.
double rank_of(double triangles) { return std::isnan(triangles) ? std::numeric_limits<double>::infinity() : triangles; }

/// Sizes ascending.
std::map<Family, std::vector<Size>> families_of(const Draft& draft) {
    std::map<Family, std::map<std::string, Size>> found;
    std::map<std::string, double> triangles;  // by scene: a run that ended before it reported them has those of another
    for (const Record* record : runs_of(draft.records, "cost_by_size")) {
        const RunSpec& spec = record->spec;
        double& known = triangles.try_emplace(spec.scene, not_known).first->second;
        known = std::fmax(known, triangles_of(*record));
        Size& size = found[{spec.scene.substr(0, spec.scene.rfind('_')), spec.detector + " + " + spec.response,
                            stepper_of(*record)}][spec.scene];
        size.scene = spec.scene;
        size.runs.push_back(record);
    }
    std::map<Family, std::vector<Size>> families;
    for (const auto& [family, sizes] : found) {
        std::vector<Size>& sorted = families[family];
        for (const auto& [scene, size] : sizes) {
            sorted.push_back(size);
            sorted.back().triangles = triangles.at(scene);
        }
        std::stable_sort(sorted.begin(), sorted.end(),
                         [](const Size& a, const Size& b) { return rank_of(a.triangles) < rank_of(b.triangles); });
    }
    return families;
}

/// A stepper's name has every parameter that is not at its default, the number of threads among them.
std::string threads_of(const std::string& stepper) {
    return stepper.find("threads=2") != std::string::npos ? "two threads" : "one thread";
}

ScatterChart drawing_of(const Family& family, const std::vector<Size>& sizes) {
    ScatterChart chart;
    chart.x_title = fmt::format("tissue triangles, {}, {}", family.scenes, family.stepper);
    chart.y_title = "median time per tick (µs), " + threads_of(family.stepper);
    std::vector<std::string> stages{"total"};
    stages.insert(stages.end(), stage_names.begin(), stage_names.end());
    for (const std::string& stage : stages) {
        const int style = static_cast<int>(chart.series.size());
        ChartSeries series{.name = stage == "total" ? "whole tick" : stage,
                           .style = {.colour = style, .shape = style, .hollow = stage != "total"},
                           .connected = true};
        for (const Size& size : sizes) {
            const double time = size.time(metric_of(std::string(stage) + "_median_ns")).value * us;
            if (size.failed() != nullptr || std::isnan(time) || std::isnan(size.triangles)) continue;
            series.points.push_back({.x = size.triangles,
                                     .y = time,
                                     .name = fmt::format("{}, {} triangles, {}: {} µs", size.scene,
                                                         count_text(size.triangles), series.name, format_number(time)),
                                     .label = {}});
        }
        if (!series.points.empty()) chart.series.push_back(std::move(series));
    }
    return chart;
}

Table table_of(const std::map<Family, std::vector<Size>>& families) {
    Table table;
    table.caption = "Median time per tick and stage against size, one thread where the stepper's name says no more";
    table.columns = {{"scene", false},
                     {"detector + response", false},
                     {"stepper", false},
                     {"tissue triangles", true},
                     {"sub-steps per tick", true, Metric::substeps},
                     {"n per process (ticks)", true, Metric::timed_ticks},
                     {"whole tick (µs)", true}};
    for (const char* stage : stage_names) table.columns.push_back({std::string(stage) + " (µs)", true});
    table.note =
        "Ticks back to back, not judged; the first ones are dropped. A sub-step of an explicit stepper must be shorter "
        "the shorter the edges are: its tick grows faster than its mesh.";
    for (const auto& [family, sizes] : families) {
        for (const Size& size : sizes) {
            std::vector<std::string> cells{size.scene, code(family.methods), code(family.stepper),
                                           count_text(size.triangles),
                                           count_text(value_of(size.runs.front()->summary, Metric::substeps))};
            if (const Record* failed = size.failed()) {
                table.rows.push_back(failed_row(std::move(cells), failed->outcome, table));
                continue;
            }
            cells.push_back(count_text(size.time(Metric::timed_ticks).value));
            cells.push_back(estimate_text(size.time(Metric::total_median_ns), us));
            for (std::size_t stage = 0; stage < stage_count; ++stage) {
                cells.push_back(scaled(size.time(stage_median(stage)).value, us));
            }
            table.rows.push_back({.cells = std::move(cells)});
        }
    }
    return table;
}

}  // namespace

Table size_page(const Draft& draft) {
    const std::map<Family, std::vector<Size>> families = families_of(draft);
    std::set<std::string> steppers;
    for (const auto& [family, sizes] : families) steppers.insert(family.stepper);
    Table table;
    table.caption = "Whole tick against size, median (µs), one thread where the stepper's name says no more";
    table.columns = {{"scene", false}, {"detector + response", false}, {"tissue triangles", true}};
    for (const std::string& stepper : steppers) table.columns.push_back({code(stepper), true});
    struct Row {
        double triangles = not_known;
        std::map<std::string, std::string> times = {};  // by stepper
    };
    std::map<std::tuple<std::string, std::string, double, std::string>, Row> rows;
    for (const auto& [family, sizes] : families) {
        for (const Size& size : sizes) {
            Row& row = rows[{family.scenes, family.methods, rank_of(size.triangles), size.scene}];
            row.triangles = size.triangles;
            const Record* failed = size.failed();
            row.times[family.stepper] = failed != nullptr ? outcome_text(failed->outcome)
                                                          : scaled(size.time(Metric::total_median_ns).value, us);
        }
    }
    for (const auto& [key, row] : rows) {
        std::vector<std::string> cells{std::get<3>(key), code(std::get<1>(key)), count_text(row.triangles)};
        for (const std::string& stepper : steppers) {
            const auto time = row.times.find(stepper);
            cells.push_back(time == row.times.end() ? "" : time->second);
        }
        table.rows.push_back({.cells = std::move(cells)});
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
            fmt::format("Median time per stage against the number of tissue triangles: {} with {}, stepper {}; "
                        "{}.",
                        family.scenes, code(family.methods), code(family.stepper), threads_of(family.stepper)));
    }
    draft.add(table_of(families));
}

}  // namespace trocar
