#include "report/sections.hpp"

#include <fmt/format.h>

#include <array>
#include <map>

namespace trocar {

void add_failures(Draft& draft) {
    draft.heading(2, "Failures");
    using Key = std::array<std::string, 4>;  // mode, method, scene, outcome
    std::map<Key, int> failed;
    std::map<Key, int> not_run;
    std::map<Key, int> truncated;
    for (const RunFigures& run : draft.results.runs()) {
        const RunSpec& spec = run.record->spec;
        if (spec.mode == "hard_case") continue;  // reported in the matrix, where a failure may be the right answer
        Key key{spec.mode, code(method_of(spec).label()), spec.scene.empty() ? "all scenes" : spec.scene,
                outcome_text(run.record->outcome)};
        const double cut = run[Metric::truncated_ticks];
        if (never_ran(*run.record)) {
            ++not_run[key];
        } else if (!run.ok()) {
            ++failed[key];
        } else if (cut > 0.0) {
            key[3] = count_text(cut) + " ticks truncated";
            ++truncated[key];
        }
    }
    if (failed.empty()) {
        draft.paragraph(
            fmt::format("No run failed: none of {} crashed, threw, timed out, became unstable or ended on a "
                        "number that is not finite.",
                        draft.records.size()));
    }
    const auto table_of = [](const char* caption, const std::map<Key, int>& entries, TableRow::Style style = {}) {
        Table table{
            .caption = caption,
            .columns = {
                {"kind of run", false}, {"method", false}, {"scene", false}, {"outcome", false}, {"runs", true}}};
        for (const auto& [key, count] : entries) {
            table.rows.push_back({.cells = {key[0], key[1], key[2], key[3], std::to_string(count)}, .style = style});
        }
        return table;
    };
    draft.add(table_of("Failed runs", failed, TableRow::Style::failed));
    draft.add(table_of("Answers cut by a limit (\"unknown\", never \"free\")", truncated));
    draft.add(table_of("Not run: neither a failure nor a zero", not_run));
}

}  // namespace trocar
