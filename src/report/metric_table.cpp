#include "report/metric_table.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
namespace {

/// Methods on one scene that moved alike, bit by bit.
struct Motion {
    const SceneResult* result = nullptr;  ///< of the first method
    std::vector<const Method*> methods;
};

bool has_row(const MetricTable& content, const SceneResult* result) {
    if (result == nullptr || result->not_applicable()) return false;
    return !result->ok() || !content.keep || content.keep(*result);
}

/// The different motions of the runs on the scene, in the order of `methods`, which they point into.
std::vector<Motion> motions_of(const Draft& draft, const MetricTable& content, const std::string& scene,
                               const std::vector<Method>& methods) {
    std::vector<Motion> motions;
    for (const Method& method : methods) {
        const SceneResult* result = draft.results.find(method, scene);
        if (!has_row(content, result)) continue;
        const auto found = std::find_if(motions.begin(), motions.end(), [result](const Motion& motion) {
            return same_motion(motion.result->runs.front(), result->runs.front());
        });
        if (found == motions.end()) {
            motions.push_back({result, {&method}});
        } else {
            found->methods.push_back(&method);
        }
    }
    return motions;
}

/// "`fcl_bvh + penalty (intersection)`, moving alike: `ohc`"
std::string who_text(const Motion& motion) {
    const Method& first = *motion.methods.front();
    std::string text = code(first.label());
    for (std::size_t i = 1; i < motion.methods.size(); ++i) {
        const Method& other = *motion.methods[i];
        text +=
            (i == 1 ? ", moving alike: " : ", ") +
            code(other.contacts == first.contacts && other.response == first.response ? other.detector : other.label());
    }
    return text;
}

/// None where the value is not known; an interval is known when every process has the metric.
std::optional<std::string> value_text(const MetricColumn& column, Metric metric, const SceneResult& result) {
    if (column.processes == Processes::interval) {
        const Estimate estimate = result.of(metric);
        if (std::isnan(estimate.value)) return std::nullopt;
        return estimate_text(estimate, column.scale);
    }
    double value = result.first(metric);
    if (column.processes == Processes::highest) {
        for (const RunFigures& run : result.runs) value = std::fmax(value, run[metric]);
    }
    if (std::isnan(value)) return std::nullopt;
    return column.count ? count_text(value * column.scale) : scaled(value, column.scale);
}

std::string cell_of(const MetricColumn& column, const SceneResult& result) {
    if (column.text) return column.text(result);
    const std::optional<std::string> value = value_text(column, column.metric, result);
    if (!column.second) return value.value_or(column.unknown);
    const std::optional<std::string> second = value_text(column, *column.second, result);
    if (!value && !second) return column.unknown;
    return value.value_or("n/a") + " / " + second.value_or("n/a");
}

void add_row(const MetricTable& content, std::vector<std::string> cells, const SceneResult& result, Table& table) {
    if (!result.ok()) {
        const auto failed =
            std::find_if(result.runs.begin(), result.runs.end(), [](const RunFigures& run) { return !run.ok(); });
        cells.push_back(outcome_text(failed->record->outcome));
        cells.resize(table.columns.size());
        table.rows.push_back({.cells = std::move(cells), .style = TableRow::Style::failed});
        return;
    }
    for (const MetricColumn& column : content.columns) cells.push_back(cell_of(column, result));
    table.rows.push_back({.cells = std::move(cells)});
}

}  // namespace

std::function<std::string(const SceneResult&)> of_first(std::string (*text)(const RunFigures&)) {
    return [text](const SceneResult& result) { return text(result.runs.front()); };
}

MetricColumn misses_column(const std::string& header, Metric metric) {
    return {.header = header, .metric = metric, .text = [metric](const SceneResult& result) {
                double misses = 0.0;
                double ticks = 0.0;
                for (const RunFigures& run : result.runs) {
                    misses += run[metric];
                    ticks += run[Metric::timed_ticks];
                }
                return count_text(misses) + " of " + count_text(ticks);
            }};
}

MetricColumn work_ratio_column(const std::string& header, Metric usual) {
    return {.header = header, .metric = Metric::work_max, .text = [usual](const SceneResult& result) {
                const double work = result.first(Metric::work_max) / result.first(usual);
                return std::isfinite(work) ? format_number(work) : std::string("n/a");
            }};
}

void note_undecided(const Draft& draft, Table& table) {
    const bool any = std::any_of(draft.results.runs().begin(), draft.results.runs().end(), [](const RunFigures& run) {
        return run.record->spec.mode == "closed_loop" && run.ok() && run[Metric::side_undecided_max] > 0.0;
    });
    if (any) table.note += " " + std::string(undecided_note);
}

Table table_of(const Draft& draft, const MetricTable& content) {
    const bool by_motion = content.rows == MetricTable::Rows::motion;
    Table table{.caption = content.caption, .columns = {}, .rows = {}, .note = content.note, .folded = content.folded};
    if (by_motion) table.columns.push_back({"class", false});
    table.columns.push_back({"scene", false});
    table.columns.push_back({content.mode == "replay" || content.mode == "repeated_motion" ? "detector"
                             : content.mode == "closed_loop" ? "detector + response (contact generator)"
                                                             : "detector + response",
                             false});
    for (const MetricColumn& column : content.columns) table.columns.push_back({column.header, true, column.metric});

    const std::vector<Method> methods = draft.results.methods(content.mode);
    if (!by_motion) {
        for (const std::string& scene : draft.results.scenes(content.mode)) {
            for (const Method& method : methods) {
                const SceneResult* result = draft.results.find(method, scene);
                if (has_row(content, result)) add_row(content, {scene, code(method.label())}, *result, table);
            }
        }
        return table;
    }
    for (const auto& [name, scenes] : draft.scenes_by_class()) {
        for (const std::string& scene : scenes) {
            for (const Motion& motion : motions_of(draft, content, scene, methods)) {
                add_row(content, {name, scene, who_text(motion)}, *motion.result, table);
            }
        }
    }
    return table;
}

}  // namespace trocar
