// Two verdicts: force and position with the scene's law of contact, and with hard contact.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "measure/statistics.hpp"
#include "report/metric_table.hpp"
#include "report/page_one.hpp"
#include "report/reference_law.hpp"
#include "report/verdict_order.hpp"

namespace trocar {
namespace {

/// An error on one scene, with the bound of its reference and the unit in which it is printed.
struct BoundedError {
    double error = not_known;  ///< infinite: the run failed
    double bound = not_known;
    double unit = 1.0;
};

/// Errors with a known bound, one per result. `unit`: of a result.
template <typename Unit>
std::vector<BoundedError> errors_of(const ResultSet& on_references, Metric error, Metric bound, const Unit& unit) {
    std::vector<BoundedError> errors;
    for (const SceneResult* result : on_references.results) {
        if (!result->ok()) {
            errors.push_back({.error = std::numeric_limits<double>::infinity(), .bound = 0.0});
        } else if (!std::isnan(result->first(error)) && !std::isnan(result->first(bound))) {
            errors.push_back({.error = result->first(error), .bound = result->first(bound), .unit = unit(*result)});
        }
    }
    return errors;
}

std::vector<BoundedError> force_errors(const ResultSet& on_references, const ReferenceLaw& law) {
    return errors_of(on_references, law.force_error, law.force_bound,
                     [&law](const SceneResult& result) { return result.first(law.force_max) / 100.0; });
}

std::vector<BoundedError> position_errors(const ResultSet& on_references, const ReferenceLaw& law) {
    return errors_of(on_references, law.position_error, law.position_bound,
                     [](const SceneResult&) { return 1.0 / mm; });
}

std::string within_text(const std::vector<BoundedError>& errors, const char* unit) {
    if (errors.empty()) return unknown_text;
    std::vector<double> beyond;
    for (const BoundedError& one : errors) {
        if (!(one.error <= one.bound)) beyond.push_back(one.error / one.unit);
    }
    const double median_beyond = median(beyond);
    return of_text(static_cast<double>(errors.size() - beyond.size()), static_cast<double>(errors.size())) +
           (std::isnan(median_beyond) ? "" : "; " + scaled(median_beyond) + " " + unit);
}

/// "3 / 1 / 2": scenes on which the force is nearer to the reference than the other row's, tied, and farther. Errors
/// tie unless they differ by more than twice the bound.
std::string against_text(const ResultSet& row, const ResultSet& other, const ReferenceLaw& law) {
    std::map<std::string, const SceneResult*> others;
    for (const SceneResult* result : other.results) others[result->scene()] = result;
    int better = 0;
    int tied = 0;
    int worse = 0;
    for (const SceneResult* result : row.results) {
        const auto found = others.find(result->scene());
        if (found == others.end()) continue;
        const std::vector<BoundedError> a = force_errors({{result}}, law);
        const std::vector<BoundedError> b = force_errors({{found->second}}, law);
        if (a.empty() || b.empty()) continue;
        const double bound = std::max(a.front().bound, b.front().bound);
        if (a.front().error + 2.0 * bound < b.front().error) {
            ++better;
        } else if (b.front().error + 2.0 * bound < a.front().error) {
            ++worse;
        } else {
            ++tied;
        }
    }
    return fmt::format("{} / {} / {}", better, tied, worse);
}

/// Whether the response has the scene's stiffness wherever the scene says one.
bool has_scene_law(const ResultSet& results) {
    bool any = false;
    for (const SceneResult* result : results.ok().results) {
        const double scene = result->first(Metric::k_scene_n_per_m);
        if (std::isnan(scene)) continue;
        if (!(std::abs(result->first(Metric::k_effective_n_per_m) - scene) <= 1e-9 * scene)) return false;
        any = true;
    }
    return any;
}

Table law_table(const Draft& draft, const ReferenceLaw& law, const std::vector<ResponseRow>& rows, bool tissue) {
    struct Line {
        const ResponseRow* row;
        ResultSet on;
        double share;
    };
    const std::set<std::string> scenes = scenes_with(draft.results, law.force_bound);
    std::vector<Line> lines;
    for (const ResponseRow& row : rows) {
        if (row.control || (law.of_scene && !has_scene_law(row.planned))) continue;
        ResultSet on = on_scenes(row.planned, scenes);
        if (on.count() == 0) continue;
        const double share = or_last(as_printed(force_share(on, law)));
        lines.push_back({&row, std::move(on), share});
    }
    Table table;
    if (lines.empty()) return table;
    std::stable_sort(lines.begin(), lines.end(), [](const Line& a, const Line& b) {
        return std::tuple(a.on.failed_runs() > 0, a.share) < std::tuple(b.on.failed_runs() > 0, b.share);
    });
    const std::string detector = common_detector(rows);
    const ResultSet first = lines.front().on;
    const std::vector<MetricColumn> columns{
        {.header = "force within bound of N; else error (% of peak)",
         .metric = law.force_error,
         .text = [law](const ResultSet& results) { return force_within_text(results, law); }},
        {.header = "median of all (% of peak)",
         .metric = law.force_error,
         .text = [law](const ResultSet& results) { return scaled(force_share(results, law)); }},
        {.header = "nearer / tied / farther than the first row",
         .metric = law.force_error,
         .text = [law, first](const ResultSet& results) { return against_text(results, first, law); }},
        {.header = "position within bound of N; else error (mm)",
         .metric = law.position_error,
         .text = [law](const ResultSet& results) { return within_text(position_errors(results, law), "mm"); }},
        time_column("tick p50, largest (µs)", Metric::total_median_ns, Processes::median)};
    std::vector<MetricRow> printed;
    printed.reserve(lines.size());
    for (const Line& line : lines) {
        printed.push_back({.names = {name_of_row(*line.row, detector)},
                           .results = line.on,
                           .style = line.on.failed_runs() > 0 ? TableRow::Style::failed
                                    : line.row->ours          ? TableRow::Style::own
                                                              : TableRow::Style::normal});
    }
    table = table_of(
        {.caption = fmt::format("{}, scenes {} tissue with a reference",
                                law.of_scene ? "Law of the scene" : "Hard contact", tissue ? "with" : "without"),
         .columns = {{.header = "response", .wide = true}}},
        columns, printed);
    table.note =
        "Order: rows that failed last, then the median force error in percent of the reference's largest force. An "
        "error "
        "within the bound of its reference is as good as none; two rows are tied on a scene unless their errors differ "
        "by more than twice the bound. A failed run is infinitely wrong.";
    if (law.of_scene) {
        table.note +=
            " Rows have the scene's k and mu in force. The reference spreads k over the area of the surface, methods "
            "have it at vertices: `penalty` weighted by area with `implicit` at an eighth of the tick, where the study "
            "runs it, shows how much of the difference weight and time step make.";
    }
    return table;
}

}  // namespace

std::set<std::string> scenes_with(const Results& results, Metric metric) {
    std::set<std::string> scenes;
    for (const Method& method : results.methods("closed_loop")) {
        for (const auto& [scene, result] : results.of(method)) {
            if (!std::isnan(result.first(metric))) scenes.insert(scene);
        }
    }
    return scenes;
}

ResultSet on_scenes(const ResultSet& results, const std::set<std::string>& scenes) {
    ResultSet on;
    std::copy_if(results.results.begin(), results.results.end(), std::back_inserter(on.results),
                 [&scenes](const SceneResult* result) { return scenes.count(result->scene()) > 0; });
    return on;
}

double force_share(const ResultSet& on_references, const ReferenceLaw& law) {
    std::vector<double> shares;
    for (const BoundedError& one : force_errors(on_references, law)) shares.push_back(one.error / one.unit);
    return median(std::move(shares));
}

std::string force_within_text(const ResultSet& on_references, const ReferenceLaw& law) {
    return within_text(force_errors(on_references, law), "%");
}

void add_reference_laws(Draft& draft) {
    std::vector<Table> tables;
    const std::vector<std::string> scenes = draft.results.scenes("closed_loop");
    const bool any_tissue = judged_scenes(draft.results, scenes, false).size() < scenes.size();
    const std::vector<ResponseRow> soft = any_tissue ? response_rows(draft, true) : std::vector<ResponseRow>{};
    const std::vector<ResponseRow> rigid = response_rows(draft, false);
    for (const ReferenceLaw* law : {&hard_law, &scene_law}) {
        tables.push_back(law_table(draft, *law, soft, true));
        tables.push_back(law_table(draft, *law, rigid, false));
    }
    std::erase_if(tables, [](const Table& table) { return table.rows.empty(); });
    if (tables.empty()) return;
    draft.heading(2, "Force and position against the references");
    for (Table& table : tables) draft.add(std::move(table));
}

}  // namespace trocar
