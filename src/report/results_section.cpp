#include "report/sections.hpp"

#include <fmt/format.h>

#include "report/run_table.hpp"

namespace trocar {
void add_glossary(Draft& draft) {
    draft.heading(2, "What the words mean");
    Table table;
    table.caption = "Columns of results.csv";
    table.columns = {{"figure", false}, {"unit", false}, {"better", false}, {"meaning", false}, {"taken from", false}};
    table.folded = true;
    for (const Metric metric : used_metrics(draft.records)) {
        const MetricInfo& info = info_of(metric);
        table.rows.push_back(
            {.cells = {code(std::string(info.name)), std::string(info.unit), std::string(name_of(info.better)),
                       std::string(info.meaning), std::string(text_of(info.source))}});
    }
    draft.add(std::move(table));
    draft.paragraph(
        "n/a: the figure does not apply. 0: it applies and is exactly zero. n too small: too few ticks for the "
        "quantile. absent, unsupported: not run, with the reason under Failures. Every other outcome than ok is a "
        "failure: it stays in every table and has no time. Quantiles are linear between order statistics (type 7 "
        "of Hyndman and Fan). Touch: triangles that share points but do not pass through each other.");
}

void add_rebuild(Draft& draft) {
    draft.heading(2, "Files and how to rebuild");
    draft.document.blocks.emplace_back(
        CodeBlock{fmt::format("trocar report DIR    # this report from the records, byte for byte\n"
                              "{}    # the records: other times, same pairs and motion",
                              study_command(draft.records))});
    draft.paragraph(
        "`records.jsonl.gz`: every run with its specification, environment and ticks (of a closed loop the judged "
        "ones). "
        "`results.csv`: one row per run, of every mode; `figures.csv`: meanings of its columns. `charts/`: the "
        "drawings. `trocar table DIR --format tex`: a table for a paper.");
}

}  // namespace trocar
