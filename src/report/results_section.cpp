#include "report/sections.hpp"

#include <fmt/format.h>

#include <set>

#include "measure/metrics.hpp"

namespace trocar {
namespace {

std::set<std::string> summary_keys(const Draft& draft) {
    std::set<std::string> keys;
    for (const Record& record : draft.records) {
        for (const auto& [key, value] : record.summary) keys.insert(key);
    }
    for (const FigureColumn& column : figure_columns()) keys.erase(std::string(column.key));
    return keys;
}

}  // namespace

void add_glossary(Draft& draft) {
    draft.heading(2, "What the words mean");
    Table table;
    table.caption = "Columns of results.csv";
    table.columns = {{"column", false}, {"meaning", false}};
    table.folded = true;
    for (const FigureColumn& column : figure_columns()) {
        table.rows.push_back({.cells = {code(std::string(column.key)), std::string(column.meaning)}});
    }
    const std::set<std::string> used = summary_keys(draft);
    for (const SummaryFigure& figure : summary_figures()) {
        if (!used.contains(figure.name)) continue;
        table.rows.push_back(
            {.cells = {code(figure.name), figure.meaning + (figure.unit == "1" ? "" : " (" + figure.unit + ")")}});
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
                              "trocar study {}    # the records: other times on another machine, same pairs and motion",
                              common_fact(draft.records, "study.file"))});
    draft.paragraph(
        "`records.jsonl`: every run with its specification, environment and every tick. `results.csv`: one row per "
        "run. `report.tex`: the tables for LaTeX. `charts/`: the drawings.");
}

std::string results_csv(const Draft& draft) {
    std::string csv =
        "study,mode,scene,class,detector,response,contacts,setting,repetition,seed,ticks,outcome,message,"
        "scene_hash,frames_hash,state_hash";
    const std::set<std::string> keys = summary_keys(draft);
    for (const FigureColumn& column : figure_columns()) csv += "," + std::string(column.key);
    for (const std::string& key : keys) csv += "," + csv_field(key);
    csv += "\n";
    for (const RunFigures& run : draft.results.runs()) {
        const Record& record = *run.record;
        const RunSpec& spec = record.spec;
        for (const std::string& text : {spec.study, spec.mode, spec.scene, spec.pair_class, spec.detector,
                                        spec.response, spec.contacts, spec.setting}) {
            csv += csv_field(text) + ",";
        }
        csv +=
            fmt::format("{},{},{},{},{},{},{},{}", spec.repetition, spec.seed, spec.ticks, name_of(record.outcome.kind),
                        csv_field(record.outcome.message), spec.scene_hash, record.frames_hash, record.state_hash);
        const bool measured = !record.rows.empty();
        for (const FigureColumn& column : figure_columns()) {
            csv += "," + (measured ? format_exact(column.of(run)) : std::string());
        }
        for (const std::string& key : keys) csv += "," + format_exact(summary_of(record, key));
        csv += "\n";
    }
    return csv;
}

}  // namespace trocar
