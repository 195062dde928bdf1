// How responses resolve an interpenetration that an interval without contact has left (simulate/resolution.hpp).
#include <algorithm>
#include <map>
#include <set>

#include "measure/statistics.hpp"
#include "report/metric_table.hpp"
#include "report/page_one.hpp"
#include "report/proportions.hpp"

namespace trocar {
namespace {

constexpr const char* kind = "resolution";

/// Groups of drawn scenes, by the first word of their names, in one column each (scene/resolution_scenes.hpp).
struct Group {
    const char* header;
    std::vector<std::string_view> words;
};

const std::vector<Group>& groups() {
    static const std::vector<Group> list{{"at rest, moving", {"rest", "moving"}},
                                         {"silent detector", {"silent"}},
                                         {"through in one tick", {"through"}},
                                         {"hand-held", {"held"}}};
    return list;
}

bool is_of(const Group& group, const std::string& scene) {
    const std::string word = scene.substr(0, scene.find('_'));
    return std::find(group.words.begin(), group.words.end(), word) != group.words.end();
}

bool holds(const SceneResult& result, Metric metric) { return result.ok() && result.first(metric) == 1.0; }

int resolved_of(const ResultSet& results) {
    return static_cast<int>(
        std::count_if(results.results.begin(), results.results.end(),
                      [](const SceneResult* result) { return holds(*result, Metric::resolution_resolved); }));
}

/// "20 / 3 of 24": resolved, of these cleared, of all that were not left out.
std::string counts_of(const ResultSet& results, const Group* group) {
    int all = 0;
    int resolved = 0;
    int cleared = 0;
    for (const SceneResult* result : results.results) {
        if (group != nullptr && !is_of(*group, result->scene())) continue;
        ++all;
        resolved += holds(*result, Metric::resolution_resolved) ? 1 : 0;
        cleared += holds(*result, Metric::resolution_cleared) ? 1 : 0;
    }
    return all == 0 ? unknown_text : std::to_string(resolved) + " / " + of_text(cleared, all);
}

/// Values over all scenes, where a run without one is worse than every other. Without tissue there is no energy.
std::vector<double> worst_first(ResultSet results, Metric metric) {
    std::erase_if(results.results, [metric](const SceneResult* result) {
        return metric == Metric::resolution_excess_energy && !meets_tissue(result->record().spec.pair_class);
    });
    return failed_as_infinite(results, [metric](const SceneResult& result) { return or_last(result.first(metric)); });
}

/// "12 [180]": median, and the value that 90 % do not exceed.
MetricColumn spread_column(const std::string& header, Metric metric, double scale = 1.0) {
    return {.header = header, .metric = metric, .text = [metric, scale](const ResultSet& results) {
                const std::vector<double> values = worst_first(results, metric);
                return scaled(median(values), scale) + " [" + scaled(quantile(values, 0.9), scale) + "]";
            }};
}

/// "wrong side held 12, too slow 3"
std::string causes_of(const ResultSet& results) {
    std::map<std::string, int> count;
    for (const SceneResult* result : results.results) {
        if (holds(*result, Metric::resolution_resolved)) continue;
        ++count[result->ok() ? fact_of(result->record(), "resolution.cause")
                             : std::string(name_of(result->failure().kind))];
    }
    std::vector<std::pair<int, std::string>> order;
    order.reserve(count.size());
    for (const auto& [cause, times] : count) order.emplace_back(-times, cause);
    std::sort(order.begin(), order.end());
    std::vector<std::string> parts;
    parts.reserve(order.size());
    for (const auto& [times, cause] : order) parts.push_back(cause + " " + std::to_string(-times));
    return joined(parts);
}

/// Scenes that are resolved without any response: their scripts alone bring the bodies apart, so that they are no case.
std::set<std::string> resolved_by_none(const Results& results) {
    std::set<std::string> scenes;
    for (const Method& method : results.methods(kind)) {
        if (method.response != "none") continue;
        for (const SceneResult* result : possible(results, method).results) {
            if (holds(*result, Metric::resolution_resolved)) scenes.insert(result->scene());
        }
    }
    return scenes;
}

struct ResolvedRow {
    Method method;
    ResultSet results = {};
    int resolved = 0;
    double ticks = 0.0;  ///< median
};

/// Most resolved first, then fewest ticks.
std::vector<ResolvedRow> resolved_rows(const Draft& draft) {
    const std::set<std::string> no_cases = resolved_by_none(draft.results);
    std::vector<ResolvedRow> rows;
    for (const Method& method : draft.results.methods(kind)) {
        ResolvedRow row{.method = method};
        for (const SceneResult* result : possible(draft.results, method).results) {
            if (!no_cases.contains(result->scene())) row.results.results.push_back(result);
        }
        if (row.results.count() == 0) continue;
        row.resolved = resolved_of(row.results);
        row.ticks = median(worst_first(row.results, Metric::resolution_ticks));
        rows.push_back(std::move(row));
    }
    std::stable_sort(rows.begin(), rows.end(), [](const ResolvedRow& a, const ResolvedRow& b) {
        return a.resolved != b.resolved ? a.resolved > b.resolved : a.ticks < b.ticks;
    });
    return rows;
}

Table rows_table(const std::string& caption, const std::vector<ResolvedRow>& rows,
                 const std::vector<MetricColumn>& columns) {
    std::vector<MetricRow> lines;
    lines.reserve(rows.size());
    for (const ResolvedRow& row : rows) {
        lines.push_back({.names = {response_name(row.method)}, .results = row.results});
    }
    return table_of({.caption = caption, .columns = {{.header = "response", .wide = true}}}, columns, lines);
}

/// The best row of every response: the first of each in the order of the rows.
std::vector<ResolvedRow> best_rows(const std::vector<ResolvedRow>& rows) {
    std::vector<ResolvedRow> best;
    std::set<std::string> seen;
    for (const ResolvedRow& row : rows) {
        if (seen.insert(method_name(row.method.response)).second) best.push_back(row);
    }
    return best;
}

/// "41 of 118 [26 to 44 %]", Wilson's interval.
std::string share_of(const ResultSet& results) {
    const int resolved = resolved_of(results);
    const auto all = static_cast<int>(results.count());
    const Proportion share = wilson_interval(resolved, all);
    return of_text(resolved, all) + " [" + scaled(100.0 * share.low) + " to " + scaled(100.0 * share.high) + " %]";
}

/// "2 / 17, p 0.0007": scenes that this row alone resolves, and the first row alone; exact McNemar on the scenes of
/// both.
std::string against_first(const ResultSet& first, const ResultSet& row) {
    std::map<std::string, bool> of_first;
    for (const SceneResult* result : first.results) {
        of_first[result->scene()] = holds(*result, Metric::resolution_resolved);
    }
    int only_row = 0;
    int only_first = 0;
    for (const SceneResult* result : row.results) {
        const auto found = of_first.find(result->scene());
        if (found == of_first.end()) continue;
        const bool resolved = holds(*result, Metric::resolution_resolved);
        only_row += resolved && !found->second ? 1 : 0;
        only_first += !resolved && found->second ? 1 : 0;
    }
    return std::to_string(only_row) + " / " + std::to_string(only_first) + ", p " +
           scaled(mcnemar_exact(only_row, only_first));
}

}  // namespace

namespace {

std::vector<MetricColumn> group_columns(const Draft& draft) {
    std::vector<MetricColumn> columns;
    const std::vector<std::string> scenes = draft.results.scenes(kind);
    for (const Group& group : groups()) {
        const auto in_group = [&group](const std::string& scene) { return is_of(group, scene); };
        if (std::none_of(scenes.begin(), scenes.end(), in_group)) continue;
        columns.push_back({.header = group.header,
                           .metric = Metric::resolution_resolved,
                           .text = [&group](const ResultSet& results) { return counts_of(results, &group); }});
    }
    if (columns.empty()) {
        columns.push_back({.header = "all",
                           .metric = Metric::resolution_resolved,
                           .text = [](const ResultSet& results) { return counts_of(results, nullptr); }});
    }
    columns.push_back(spread_column("ticks to resolve", Metric::resolution_ticks));
    columns.push_back(spread_column("kick", Metric::resolution_kick));
    columns.push_back(spread_column("excess energy", Metric::resolution_excess_energy));
    return columns;
}

constexpr const char* counts_caption = "Interpenetration resolution: resolved / cleared of N scenes";

}  // namespace

Table resolution_page(const Draft& draft) {
    const std::vector<ResolvedRow> rows = resolved_rows(draft);
    std::vector<ResolvedRow> best = best_rows(rows);
    if (best.size() > page_one_rows) best.resize(page_one_rows);
    Table table = rows_table(counts_caption, best, group_columns(draft));
    table.note =
        "The best row of every response; median [90 %] over the scenes, ∞: not resolved or failed. Order: "
        "resolved, then ticks.";
    return table;
}

std::string resolution_sentence(const Draft& draft) {
    const std::vector<ResolvedRow> rows = resolved_rows(draft);
    if (rows.empty()) return {};
    const std::string ours = method_name(draft.results.fact(rows.front().method, "study.ours"));
    std::vector<std::string> parts;
    for (const ResolvedRow& row : best_rows(rows)) {
        const std::string name = method_name(row.method.response);
        if (!parts.empty() && name != ours && name != "thesis") continue;
        parts.push_back(code(row.method.response) + (parts.empty() ? " resolves " : " ") +
                        std::to_string(row.resolved));
    }
    return "Of " + std::to_string(rows.front().results.count()) + " interpenetrations " + joined(parts) + ".";
}

Table resolution_table(const Draft& draft) {
    Table table = rows_table(counts_caption, resolved_rows(draft), group_columns(draft));
    table.note =
        "Contact is off for an interval in which bodies pass into each other. Resolved: within 200 ms the state is as "
        "that of the same scene with contact at every tick, and stays so. Cleared: besides, never deeper than 0.02 "
        "edges. Others: median [90 %] over the scenes; ∞: not resolved, failed or not defined. Order: resolved, then "
        "ticks.";
    const std::set<std::string> no_cases = resolved_by_none(draft.results);
    if (!no_cases.empty()) {
        table.note += " Left out, since the scripts alone resolve them (response none): " +
                      joined(std::vector<std::string>(no_cases.begin(), no_cases.end())) + ".";
    }
    return table;
}

void add_resolution(Draft& draft) {
    if (draft.results.scenes(kind).empty()) return;
    draft.heading(2, "Interpenetration resolution");
    draft.add(resolution_table(draft));
    const std::vector<ResolvedRow> rows = resolved_rows(draft);
    if (!rows.empty()) {
        const ResultSet& first = rows.front().results;
        Table table =
            rows_table("How many are resolved, and why not", rows,
                       {{.header = "resolved [95 %]", .metric = Metric::resolution_resolved, .text = share_of},
                        {.header = "it alone / the first row alone",
                         .metric = Metric::resolution_resolved,
                         .text = [&first](const ResultSet& row) { return against_first(first, row); }},
                        spread_column("force step (N)", Metric::resolution_force_step_n),
                        spread_column("overshoot (mm)", Metric::resolution_overshoot_m, mm),
                        text_column("causes, and how many scenes", causes_of, true)});
        table.note =
            "Interval: Wilson's. p: exact McNemar test of the scenes that one of the two rows resolves alone, on the "
            "scenes of both; below 0.05 the rows differ. Others: median [90 %]. results.csv has every run. Order: as "
            "above.";
        draft.add(table);
    }
}

}  // namespace trocar
