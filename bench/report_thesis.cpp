// The thesis' Table 3.1 answered with numbers.
#include <fmt/format.h>

#include <functional>
#include <map>
#include <utility>

#include "measure/statistics.hpp"
#include "report_writer.hpp"

namespace trocar::bench {

std::string Writer::quotient(std::string_view above, std::string_view below, const std::string& label) const {
    return format_number(time(above, label) / time(below, label));
}

std::string Writer::per_body(const std::string& label, bool work) const {
    const auto value = [&](std::string_view id, double count) {
        const MethodResult* found = row(id, label);
        if (found == nullptr || !found->outcome.ok()) return not_known;
        const double amount = work ? static_cast<double>(found->work.work()) : median_time(*found);
        return amount > 0.0 ? amount / count : not_known;
    };
    return format_number(value("bodies: 128 bodies", 128.0) / value("bodies: 8 bodies", 8.0));
}

void Writer::table_31() {
    const CellRecord* record = cell(main_cell);
    if (record == nullptr) return;
    add_heading("Table 3.1 of the thesis, answered with numbers");
    std::vector<std::pair<std::string, std::string>> columns;  // label, heading
    for (const char* family : {"tree", "boxes", "cells", "ohc"}) {
        for (const MethodResult& entry : record->measurement.methods) {
            // Both layouts of the cells: the thesis' words on storage are about one of them.
            const bool shown = is_default(entry) || (entry.family == "cells" && !is_copy(entry));
            if (entry.family == family && shown && entry.exact()) columns.emplace_back(entry.label, family);
        }
    }
    Table table;
    table.caption = "The thesis' rows, its words, and what was measured";
    table.columns = {{"row of the thesis"}, {"hierarchy / tessellation / OHC, as claimed"}, {"measured here"}};
    const std::map<std::string, std::string> family_names{
        {"tree", "hierarchy"}, {"boxes", "sorted boxes"}, {"cells", "tessellation"}, {"ohc", "OHC"}};
    for (const auto& [label, family] : columns) {
        table.columns.push_back({fmt::format("{}: `{}`", family_names.at(family), label), true});
    }
    const auto line = [&](const char* name, const char* claim, const char* measured,
                          const std::function<std::string(const std::string&, const MethodResult&)>& value) {
        TableRow result{{name, claim, measured}};
        for (const auto& [label, family] : columns) {
            const MethodResult* entry = find_row(*record, label);
            result.cells.push_back(entry == nullptr ? "n/a" : value(label, *entry));
        }
        table.rows.push_back(std::move(result));
    };
    line("Broad phase, object level", "pairwise / non-pairwise / non-pairwise",
         "time per body at 128 bodies ÷ at 8 (1: non-pairwise)",
         [this](const std::string& label, const MethodResult&) { return per_body(label, false); });
    line("", "", "counted work per body at 128 bodies ÷ at 8",
         [this](const std::string& label, const MethodResult&) { return per_body(label, true); });
    line("Broad phase, sub-object level", "pairwise / pairwise / non-pairwise",
         "triangle tests per true pair, where counted", [](const std::string&, const MethodResult& entry) {
             if (entry.work.triangle_tests == 0 || entry.pairs == 0) return std::string("n/a");
             return format_number(static_cast<double>(entry.work.triangle_tests) / static_cast<double>(entry.pairs));
         });
    line("", "", "box tests + cells visited per true pair, where counted",
         [](const std::string&, const MethodResult& entry) {
             const std::int64_t tests = entry.work.box_tests + entry.work.cells_visited;
             if (tests <= 1 || entry.pairs == 0) return std::string("n/a");
             return format_number(static_cast<double>(tests) / static_cast<double>(entry.pairs));
         });
    line("Hierarchy complexity", "multi-level / 1 level / 3 level", "share of the tick spent on keeping it (%)",
         [](const std::string&, const MethodResult& entry) {
             return format_number(100.0 * median(in_us(entry.update_ns)) / median_time(entry));
         });
    line("", "", "first build (ms)",
         [](const std::string&, const MethodResult& entry) { return format_number(1e-6 * entry.prepare_ns); });
    line("Data storage and access", "efficient or not / inefficient / efficient", "memory (bytes per triangle)",
         [record](const std::string&, const MethodResult& entry) {
             return format_number(1e6 * memory_mb(entry) / static_cast<double>(record->triangles));
         });
    line("Topological complexity", "dependent / independent / independent",
         "shuffled numbering ÷ renumbered, 200k (1: no matter)", [this](const std::string& label, const MethodResult&) {
             return quotient("order: light 200k x 2k shuffled", "size: light 200k x 2k", label);
         });
    line("", "", "tissue stretched by 20 % ÷ light", [this](const std::string& label, const MethodResult&) {
        return quotient("motion: strain 20k x 2k", main_cell, label);
    });
    line("Large number of moving objects", "no / yes / yes", "time per body at 128 bodies (µs)",
         [this](const std::string& label, const MethodResult&) {
             return format_number(time("bodies: 128 bodies", label) / 128.0);
         });
    line("Large scale environment", "yes / no / yes", "10⁶ triangles ÷ 20k (50: linear)",
         [this](const std::string& label, const MethodResult&) {
             return quotient("size: light 1M x 2k", main_cell, label);
         });
    line("", "", "far away ÷ light (cost without contact)", [this](const std::string& label, const MethodResult&) {
        return quotient("motion: far 20k x 2k", main_cell, label);
    });
    table.note =
        "Columns in the order hierarchy, sorted boxes, tessellation, OHC; only methods that were exact on the main "
        "cell. Counters of a library's inside are not to be had and show as n/a or as what the adapter can see.";
    add_table(std::move(table));
}

}  // namespace trocar::bench
