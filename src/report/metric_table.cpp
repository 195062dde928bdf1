#include "report/metric_table.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace trocar {
namespace {

/// Methods on one scene that moved alike, bit by bit.
struct Motion {
    const SceneResult* result = nullptr;  ///< of the first method
    std::vector<const Method*> methods;
};

bool has_row(const MetricTable& content, const SceneResult* result) {
    if (result == nullptr || result->not_applicable()) return false;
    return !result->ok() || !content.keep || content.keep(result->runs.front());
}

/// The runs on the scene in the order of `methods`, which they point into; with `alike` one for each different motion.
std::vector<Motion> motions_of(const Draft& draft, const MetricTable& content, const std::string& scene,
                               const std::vector<Method>& methods, bool alike) {
    std::vector<Motion> motions;
    for (const Method& method : methods) {
        const SceneResult* result = draft.results.find(method, scene);
        if (!has_row(content, result)) continue;
        const auto found = std::find_if(motions.begin(), motions.end(), [result, alike](const Motion& motion) {
            return alike && same_motion(motion.result->runs.front(), result->runs.front());
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
std::optional<std::string> value_text(const MetricColumn& column, Metric metric, const ResultSet& results) {
    if (column.processes == Processes::interval && results.count() == 1) {
        const Estimate estimate = results.results.front()->of(metric);
        if (std::isnan(estimate.value)) return std::nullopt;
        return estimate_text(estimate, column.scale);
    }
    const double value = value_over(column.over, results.values(column.processes, metric));
    if (std::isnan(value)) return std::nullopt;
    return column.count ? count_text(value * column.scale) : scaled(value, column.scale);
}

std::string cell_of(const MetricColumn& column, const ResultSet& results) {
    if (column.text) return column.text(results);
    const std::optional<std::string> value = value_text(column, *column.metric, results);
    if (!column.second) return value.value_or(column.unknown);
    const std::optional<std::string> second = value_text(column, *column.second, results);
    if (!value && !second) return column.unknown;
    return value.value_or(unknown_text) + " / " + second.value_or(unknown_text);
}

}  // namespace

Table table_of(Table names, const std::vector<MetricColumn>& columns, const std::vector<MetricRow>& rows) {
    Table table = std::move(names);
    for (const MetricColumn& column : columns) table.columns.push_back({column.header, !column.words, column.metric});
    for (const MetricRow& row : rows) {
        if (row.failure != nullptr) {
            table.rows.push_back(failed_row(row.names, *row.failure, table));
            continue;
        }
        table.rows.push_back({.cells = row.names, .style = row.style, .command = row.command});
        for (const MetricColumn& column : columns) {
            table.rows.back().cells.push_back(row.no_figures ? "" : cell_of(column, row.results));
        }
    }
    return table;
}

Table table_of(const Draft& draft, const MetricTable& content) {
    const bool by_motion = content.rows == MetricTable::Rows::motion;
    Table names{.caption = content.caption, .note = content.note, .folded = content.folded};
    names.note += names.note.empty() ? "" : " ";
    names.note += by_motion ? "Order: class, scene, method." : "Order: scene, method.";
    if (by_motion) names.columns.push_back({"class", false});
    names.columns.push_back({"scene", false});
    const bool alone = content.mode == "replay" || content.mode == "repeated_motion";
    const bool with_contacts = content.mode == "closed_loop" || content.mode == "paced";
    names.columns.push_back({alone           ? "detector"
                             : with_contacts ? "detector + response (contact generator)"
                                             : "detector + response",
                             false});
    const std::vector<Method> methods = draft.results.methods(content.mode);
    std::vector<MetricRow> rows;
    const auto add_scene = [&](const std::vector<std::string>& where, const std::string& scene) {
        for (const Motion& motion : motions_of(draft, content, scene, methods, by_motion)) {
            MetricRow row{.names = where, .results = {{motion.result}}};
            row.names.insert(row.names.end(), {scene, who_text(motion)});
            if (!motion.result->ok()) row.failure = &motion.result->failure();
            rows.push_back(std::move(row));
        }
    };
    if (by_motion) {
        for (const auto& [name, scenes] : draft.scenes_by_class()) {
            for (const std::string& scene : scenes) add_scene({name}, scene);
        }
    } else {
        for (const std::string& scene : draft.results.scenes(content.mode)) add_scene({}, scene);
    }
    return table_of(std::move(names), content.columns, rows);
}

std::string misses_text(const ResultSet& results, Metric metric) {
    const auto total = [&results](Metric of) {
        const std::vector<double> values = results.values(Processes::every, of);
        return std::accumulate(values.begin(), values.end(), 0.0);
    };
    const double ticks = total(Metric::timed_ticks);
    return of_text(total(metric), ticks > 0.0 ? ticks : not_known);
}

std::string tick_text(const SceneResult& result) {
    return result.ok() ? scaled(result.of(Metric::total_median_ns).value, us) : outcome_text(result.failure());
}

MetricColumn misses_column(const std::string& header, Metric metric) {
    return {.header = header, .metric = metric, .text = [metric](const ResultSet& results) {
                return misses_text(results, metric);
            }};
}

MetricColumn time_column(const std::string& header, Metric metric, Processes processes, const char* unknown) {
    return {.header = header, .metric = metric, .processes = processes, .scale = us, .unknown = unknown};
}

MetricColumn count_column(const std::string& header, Metric metric, Processes processes, Over over) {
    return {.header = header, .metric = metric, .processes = processes, .over = over, .count = true};
}

MetricColumn value_column(const std::string& header, Metric metric, double scale, Over over) {
    return {.header = header, .metric = metric, .over = over, .scale = scale};
}

MetricColumn two_column(const std::string& header, Metric metric, Metric second, const char* unknown) {
    return {.header = header, .metric = metric, .second = second, .unknown = unknown};
}

MetricColumn text_column(const std::string& header, Metric metric, std::string (*text)(const RunFigures&)) {
    return {
        .header = header, .metric = metric, .text = [text](const ResultSet& results) { return text(results.first()); }};
}

MetricColumn text_column(const std::string& header, std::function<std::string(const ResultSet&)> text, bool words) {
    return {.header = header, .text = std::move(text), .words = words};
}

void note_undecided(const Draft& draft, Table& table) {
    const bool any = std::any_of(draft.results.runs().begin(), draft.results.runs().end(), [](const RunFigures& run) {
        return run.record->spec.mode == "closed_loop" && run.ok() && run[Metric::side_undecided_max] > 0.0;
    });
    if (any) table.note += " " + std::string(undecided_note);
}

}  // namespace trocar
