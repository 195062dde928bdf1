// The benchmark's numbers as CSV: one file per group of cells, one row per cell and method, and what the columns
// mean.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "measure/statistics.hpp"
#include "method/registry.hpp"
#include "report_writer.hpp"

namespace trocar::bench {
namespace {

/// One row's cell and method, with the ratios that need others.
struct Row {
    const CellRecord* cell;
    const MethodResult* entry;
    Ratio to_embree;
    Ratio to_fcl;
};

struct CsvColumn {
    const char* name;
    const char* unit;
    const char* better;
    const char* meaning;
    std::string (*text)(const Row&);
    bool of_meshes = false;  ///< says nothing about cells that count bodies
};

std::string whole(std::int64_t value) { return fmt::format("{}", value); }
std::string median_us(const std::vector<std::int64_t>& ns) { return format_exact(median(in_us(ns))); }

const std::vector<CsvColumn>& columns() {
    static const std::vector<CsvColumn> list{
        {"cell", "text", "neither", "What is measured", [](const Row& r) { return r.cell->spec.id; }},
        {"variant", "text", "neither", "How the bodies lie to each other",
         [](const Row& r) { return std::string(name_of(r.cell->spec.scene.variant)); }, true},
        {"tissue_triangles", "1", "neither", "Triangles of a tissue",
         [](const Row& r) { return whole(r.cell->spec.scene.tissue_triangles); }, true},
        {"instrument_triangles", "1", "neither", "Triangles of an instrument",
         [](const Row& r) { return whole(r.cell->spec.scene.instrument_triangles); }, true},
        {"tissues", "1", "neither", "Number of tissues", [](const Row& r) { return whole(r.cell->spec.scene.tissues); },
         true},
        {"instruments", "1", "neither", "Number of instruments",
         [](const Row& r) { return whole(r.cell->spec.scene.instruments); }, true},
        {"order", "text", "neither", "Order of the vertices",
         [](const Row& r) { return std::string(name_of(r.cell->spec.scene.order)); }, true},
        {"bodies", "1", "neither", "Number of bodies; 0: given by the columns tissues and instruments",
         [](const Row& r) { return whole(r.cell->spec.bodies); }},
        {"true_pairs", "1", "neither", "Median number of pairs that the exact oracle has",
         [](const Row& r) { return whole(r.cell->measurement.true_pairs); }},
        {"label", "text", "neither", "Method with its parameters as the report names it",
         [](const Row& r) { return r.entry->label; }},
        {"outcome", "text", "neither", "ok, or how the method failed",
         [](const Row& r) { return std::string(trocar::name_of(r.entry->outcome.kind)); }},
        {"exact", "1", "higher", "1 where every pair set was that of truth, else 0",
         [](const Row& r) { return whole(r.entry->exact() ? 1 : 0); }},
        {"steps", "1", "neither", "Measured steps",
         [](const Row& r) { return whole(static_cast<std::int64_t>(r.entry->step.size())); }},
        {"update_us", "us", "lower", "Median processor time of update",
         [](const Row& r) { return median_us(r.entry->update_ns); }},
        {"detect_us", "us", "lower", "Median processor time of detect",
         [](const Row& r) { return median_us(r.entry->detect_ns); }},
        {"total_us", "us", "lower", "Median processor time of update and detect",
         [](const Row& r) { return format_exact(median_time(*r.entry)); }},
        {"wall_p50_us", "us", "lower", "Median wall time of update and detect",
         [](const Row& r) { return median_us(r.entry->wall_ns); }},
        {"cold_us", "us", "lower", "Median of the first step after the others had their turns",
         [](const Row& r) { return median_us(r.entry->cold_ns); }},
        {"ratio_embree", "1", "higher", "How many times the method's time Embree's is; empty: not comparable",
         [](const Row& r) { return format_exact(r.to_embree.value); }},
        {"ratio_embree_low", "1", "higher", "Lower end of its 95 % interval",
         [](const Row& r) { return format_exact(r.to_embree.bounds.low); }},
        {"ratio_embree_high", "1", "higher", "Upper end of its 95 % interval",
         [](const Row& r) { return format_exact(r.to_embree.bounds.high); }},
        {"ratio_fcl", "1", "higher", "How many times the method's time FCL's is; empty: not comparable",
         [](const Row& r) { return format_exact(r.to_fcl.value); }},
        {"ratio_fcl_low", "1", "higher", "Lower end of its 95 % interval",
         [](const Row& r) { return format_exact(r.to_fcl.bounds.low); }},
        {"ratio_fcl_high", "1", "higher", "Upper end of its 95 % interval",
         [](const Row& r) { return format_exact(r.to_fcl.bounds.high); }},
        {"vertices_read", "1", "lower", "Median of a step",
         [](const Row& r) { return whole(r.entry->work.vertices_read); }},
        {"cells_visited", "1", "lower", "Median of a step",
         [](const Row& r) { return whole(r.entry->work.cells_visited); }},
        {"box_tests", "1", "lower", "Median of a step", [](const Row& r) { return whole(r.entry->work.box_tests); }},
        {"triangle_tests", "1", "lower", "Median of a step",
         [](const Row& r) { return whole(r.entry->work.triangle_tests); }},
        {"work_max", "1", "lower", "Largest sum of these four in a step",
         [](const Row& r) { return whole(r.entry->work_max); }},
        {"heap_bytes", "B", "lower", "Of malloc, after prepare and one step; -1: not known",
         [](const Row& r) { return whole(r.entry->heap_bytes); }},
        {"resident_bytes", "B", "lower", "Growth of the process; -1: not known",
         [](const Row& r) { return whole(r.entry->resident_bytes); }},
        {"allocations_max", "1", "lower", "Most heap allocations in a measured step; -1: not counted",
         [](const Row& r) { return whole(r.entry->allocations); }},
        {"prepare_ms", "ms", "lower", "Time of prepare",
         [](const Row& r) { return format_exact(1e-6 * r.entry->prepare_ns); }},
        {"false_negatives", "1", "lower", "True pairs not reported, over the steps held against the oracle",
         [](const Row& r) { return whole(r.entry->false_negatives); }},
        {"false_positives", "1", "lower", "Reported pairs that are not true, over these",
         [](const Row& r) { return whole(r.entry->false_positives); }},
        {"differing_steps", "1", "lower", "Steps whose pair set differs from the reference's",
         [](const Row& r) { return whole(r.entry->differing_steps); }},
    };
    return list;
}

/// Broad phases of libraries have names of their own, without parameters.
MethodSpec taken_apart(const std::string& method) {
    return method.find('=') == std::string::npos ? MethodSpec{.name = method, .parameters = {}} : parse_method(method);
}

std::string csv_of(const std::vector<Row>& rows, bool of_bodies, std::map<std::string, std::string>& parameters) {
    std::set<std::string> keys;
    std::vector<MethodSpec> methods;
    for (const Row& row : rows) {
        methods.push_back(taken_apart(row.entry->method));
        for (const auto& [key, value] : methods.back().parameters) keys.insert(key);
    }
    std::string head = "method";
    for (const std::string& key : keys) {
        head += ",method." + key;
        parameters["method." + key] = "Parameter " + key + " of the method; empty: its default";
    }
    for (const CsvColumn& column : columns()) {
        if (!of_bodies || !column.of_meshes) head += std::string(",") + column.name;
    }
    std::string text = head + "\n";
    for (std::size_t i = 0; i < rows.size(); ++i) {
        text += csv_field(methods[i].name);
        for (const std::string& key : keys) {
            const auto found = methods[i].parameters.find(key);
            text += "," + (found == methods[i].parameters.end() ? "" : csv_field(found->second));
        }
        for (const CsvColumn& column : columns()) {
            if (!of_bodies || !column.of_meshes) text += "," + csv_field(column.text(rows[i]));
        }
        text += "\n";
    }
    return text;
}

}  // namespace

void Writer::csv_files() {
    std::map<Group, std::vector<Row>> groups;
    for (const CellRecord& record : records_) {
        const MethodResult* embree = find_row(record, embree_anchor);
        const MethodResult* fcl = find_row(record, fcl_anchor);
        for (const MethodResult& entry : record.measurement.methods) {
            groups[record.spec.group].push_back({.cell = &record,
                                                 .entry = &entry,
                                                 .to_embree = embree == nullptr ? Ratio{} : ratio_of(*embree, entry),
                                                 .to_fcl = fcl == nullptr ? Ratio{} : ratio_of(*fcl, entry)});
        }
    }
    std::map<std::string, std::string> parameters;
    bool first = true;  // the main group where it was measured
    for (const auto& [group, rows] : groups) {
        std::string file = first ? "results.csv" : fmt::format("results_{}.csv", name_of(group));
        std::replace(file.begin(), file.end(), ' ', '_');
        report_.files[file] = csv_of(rows, group == Group::bodies, parameters);
        first = false;
    }
    std::string& dictionary = report_.files["figures.csv"];
    dictionary = "name,unit,better,meaning\nmethod,text,neither,Name of the method\n";
    for (const auto& [name, meaning] : parameters) {
        dictionary += fmt::format("{},text,neither,{}\n", csv_field(name), csv_field(meaning));
    }
    for (const CsvColumn& column : columns()) {
        dictionary += fmt::format("{},{},{},{}\n", column.name, column.unit, column.better, csv_field(column.meaning));
    }
}

}  // namespace trocar::bench
