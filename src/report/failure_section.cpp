#include "report/sections.hpp"

#include <fmt/format.h>

#include <compare>
#include <map>

namespace trocar {

void add_failures(Draft& draft) {
    draft.heading(2, "Failures");
    struct Key {
        std::string mode;
        std::string who;
        std::string scene;
        std::string outcome;
        auto operator<=>(const Key&) const = default;
    };
    std::map<Key, int> failed;
    std::map<Key, int> not_run;
    std::map<Key, int> truncated;
    for (const RunFigures& run : draft.results.runs()) {
        const RunSpec& spec = run.record->spec;
        if (spec.mode == "hard_case") continue;  // reported in the matrix, where a failure may be the right answer
        const Key key{spec.mode, method_of(spec).label(), spec.scene.empty() ? "all scenes" : spec.scene,
                      outcome_text(run.record->outcome)};
        const OutcomeKind kind = run.record->outcome.kind;
        if (kind == OutcomeKind::absent || kind == OutcomeKind::unsupported) {
            ++not_run[key];
        } else if (kind != OutcomeKind::ok) {
            ++failed[key];
        } else if (run[Metric::truncated_ticks] > 0.0) {
            ++truncated[{key.mode, key.who, key.scene,
                         fmt::format("{:.0f} ticks truncated", run[Metric::truncated_ticks])}];
        }
    }
    if (failed.empty()) {
        draft.paragraph(
            fmt::format("No run failed: none of {} crashed, threw, timed out, became unstable or ended on a "
                        "number that is not finite.",
                        draft.records.size()));
    }
    const auto table_of = [](const std::string& caption, const std::map<Key, int>& entries) {
        Table table;
        table.caption = caption;
        table.columns = {
            {"kind of run", false}, {"method", false}, {"scene", false}, {"outcome", false}, {"runs", true}};
        for (const auto& [key, count] : entries) {
            table.rows.push_back({.cells = {key.mode, code(key.who), key.scene, key.outcome, std::to_string(count)}});
        }
        return table;
    };
    Table table = table_of("Failed runs", failed);
    for (TableRow& row : table.rows) row.style = TableRow::Style::failed;
    draft.add(std::move(table));
    draft.add(table_of("Answers cut by a limit (\"unknown\", never \"free\")", truncated));
    draft.add(table_of("Not run: neither a failure nor a zero", not_run));
}

}  // namespace trocar
