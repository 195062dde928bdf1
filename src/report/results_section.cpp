#include "report/sections.hpp"

#include <fmt/format.h>

#include <set>
#include <vector>

#include "measure/metrics.hpp"

namespace trocar {
namespace {

/// The figures that any run of the study has, in the order of the one list.
std::vector<const SummaryFigure*> used_figures(const Draft& draft) {
    std::set<std::string> keys;
    for (const Record& record : draft.records) {
        for (const auto& [key, value] : record.summary) keys.insert(key);
    }
    std::vector<const SummaryFigure*> used;
    for (const SummaryFigure& figure : summary_figures()) {
        if (keys.contains(figure.name)) used.push_back(&figure);
    }
    return used;
}

}  // namespace

void add_glossary(Draft& draft) {
    draft.heading(2, "What the words mean");
    Table table;
    table.caption = "Columns of results.csv";
    table.columns = {{"figure", false}, {"unit", false}, {"better", false}, {"meaning", false}, {"taken from", false}};
    table.folded = true;
    for (const SummaryFigure* figure : used_figures(draft)) {
        table.rows.push_back({.cells = {code(figure->name), figure->unit, std::string(name_of(figure->better)),
                                        figure->meaning, figure->source}});
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
        CodeBlock{fmt::format("trocar report DIR    # this report from DIR/records.jsonl, byte for byte\n"
                              "trocar study {}    # the records: other times, same pairs and motion",
                              common_fact(draft.records, "study.file"))});
    draft.paragraph(
        "`records.jsonl`: every run with its specification, environment and ticks (of a closed loop the judged ones). "
        "`results.csv`: one row per run, other kinds of runs in `results_KIND.csv`; `figures.csv`: what their columns "
        "mean. `charts/`: the drawings. `trocar table DIR --format tex`: a table for a paper.");
}

}  // namespace trocar
