// Residual penetration by kind of scene, of studies whose scenes are drawn (scene/judged_scenes.hpp).
#include <algorithm>

#include "measure/statistics.hpp"
#include "report/metric_table.hpp"
#include "report/verdict_order.hpp"

namespace trocar {
namespace {

/// Kinds in one column each; a scene's kind is its name up to the last '_'.
struct KindGroup {
    const char* header;
    std::vector<std::string_view> kinds;
};

const std::vector<KindGroup>& kind_groups() {
    static const std::vector<KindGroup> list{{"press on a sheet", {"press_sheet", "point_sheet"}},
                                             {"stab", {"stab_sheet"}},
                                             {"drag", {"drag_sheet", "drag_organ"}},
                                             {"press on an organ", {"press_organ", "side_organ"}},
                                             {"hand-held", {"held_sheet", "held_organ"}},
                                             {"tissue on tissue", {"two_sheets", "sheet_on_organ"}},
                                             {"over a bone", {"over_bone"}}};
    return list;
}

const KindGroup like_the_search{"median, kinds like a scene of the search",
                                {"press_sheet", "stab_sheet", "two_sheets"}};
const KindGroup never_searched{"median, kinds kept from every search",
                               {"drag_organ", "side_organ", "held_organ", "over_bone"}};

bool has_kind(const KindGroup& group, const std::string& scene) {
    const std::string kind = scene.substr(0, scene.rfind('_'));
    return std::find(group.kinds.begin(), group.kinds.end(), kind) != group.kinds.end();
}

bool is_drawn_kind(const std::string& scene) {
    return std::any_of(kind_groups().begin(), kind_groups().end(),
                       [&scene](const KindGroup& group) { return has_kind(group, scene); });
}

/// m, worst depth of every scene of a group (null: of all); infinite for a run that failed or has none.
std::vector<double> worst_depths(ResultSet results, const KindGroup* group) {
    std::erase_if(results.results, [group](const SceneResult* result) {
        return group != nullptr && !has_kind(*group, result->scene());
    });
    return failed_as_infinite(
        results, [](const SceneResult& result) { return or_last(result.first(Metric::residual_penetration_max_m)); });
}

MetricColumn worst_column(const KindGroup& group) {
    return {.header = group.header,
            .metric = Metric::residual_penetration_max_m,
            .text = [&group](const ResultSet& results) {
                return scaled(known_largest(worst_depths(results, &group)), mm);
            }};
}

MetricColumn median_column(const KindGroup& group) {
    return {.header = group.header,
            .metric = Metric::residual_penetration_max_m,
            .text = [&group](const ResultSet& results) { return scaled(median(worst_depths(results, &group)), mm); }};
}

/// "0.31 [0.25 to 0.42]"
std::string median_of_all(const ResultSet& results) {
    const std::vector<double> depths = worst_depths(results, nullptr);
    const Bounds bounds = median_bounds(depths);
    return scaled(median(depths), mm) + " [" + scaled(bounds.low, mm) + " to " + scaled(bounds.high, mm) + "]";
}

std::string failed_of_all(const ResultSet& results) {
    return of_text(static_cast<double>(results.count() - results.ok().count()), static_cast<double>(results.count()));
}

}  // namespace

void add_kinds(Draft& draft) {
    std::vector<std::string> scenes;
    for (const std::string& scene : draft.results.scenes("closed_loop")) {
        if (is_drawn_kind(scene)) scenes.push_back(scene);
    }
    if (scenes.empty()) return;
    const Verdict verdict = make_verdict(draft.results, draft.reference, "closed_loop", scenes);
    std::vector<MetricRow> rows;
    rows.reserve(verdict.rows.size() + verdict.partial.size());
    for (const std::vector<VerdictRow>* list : {&verdict.rows, &verdict.partial}) {
        for (const VerdictRow& row : *list) {
            rows.push_back({.names = {response_name(row.method)}, .results = row.planned});
        }
    }
    const auto drawn = [&scenes](const KindGroup& group) {
        return std::any_of(scenes.begin(), scenes.end(),
                           [&group](const std::string& scene) { return has_kind(group, scene); });
    };
    std::vector<MetricColumn> columns{
        {.header = "median of all scenes [95 %]", .metric = Metric::residual_penetration_max_m, .text = median_of_all}};
    for (const KindGroup& group : kind_groups()) {
        if (drawn(group)) columns.push_back(worst_column(group));
    }
    for (const KindGroup* group : {&like_the_search, &never_searched}) {
        if (drawn(*group)) columns.push_back(median_column(*group));
    }
    columns.push_back(text_column("failed", failed_of_all));
    draft.heading(2, "Residual penetration by kind of scene");
    Table table = table_of({.caption = "Residual penetration by kind of scene, worst of its draws (mm)",
                            .columns = {{.header = "response", .wide = true}}},
                           columns, rows);
    table.note =
        "Each scene counts by its worst depth over all judged ticks; ∞: a run failed. Medians are over scenes; the "
        "interval is that of the ranks that hold the median with 95 % (binomial). Nobody has tuned on these scenes; "
        "docs/STUDIES.md says what is drawn. ";
    table.note += response_order_text;
    draft.add(std::move(table));
}

}  // namespace trocar
