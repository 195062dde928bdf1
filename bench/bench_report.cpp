#include "bench_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "measure/statistics.hpp"
#include "report/report_files.hpp"
#include "report_writer.hpp"
#include "session.hpp"
#include "study/runner.hpp"
#include "web/web.hpp"

namespace trocar::bench {
namespace {

constexpr const char* charts_file = "charts/charts.js";

}  // namespace

BenchReport Writer::write() {
    find_floor();
    document_.title = "Detection benchmark";
    page_one();
    document_.page_one = document_.blocks.size();
    origin();
    fairness();
    sizes();
    reaches();
    stages();
    bounded();
    bodies();
    cell_sweep();
    orders();
    settings();
    tuning();
    table_31();
    every_cell();
    rebuild();
    document_.command = "./run.sh bench detection";
    document_.charts_js = charts_file;
    report_.files[charts_file] = web::charts_script();
    report_.files["report.md"] = page_one_to_markdown(document_, "report.html");
    report_.files["report.html"] = to_html(document_);
    csv_files();
    for (const auto& block : document_.blocks) {
        if (const auto* figure = std::get_if<Figure>(&block)) report_.files[figure->file] = figure->svg;
    }
    report_.document = std::move(document_);
    return std::move(report_);
}

const CellRecord* Writer::cell(std::string_view id) const {
    for (const CellRecord& record : records_) {
        if (record.spec.id == id && record.outcome.ok()) return &record;
    }
    return nullptr;
}

const MethodResult* Writer::row(std::string_view id, std::string_view label) const {
    const CellRecord* record = cell(id);
    return record == nullptr ? nullptr : find_row(*record, label);
}

double Writer::time(std::string_view id, std::string_view label) const {
    const MethodResult* found = row(id, label);
    return found == nullptr ? not_known : median_time(*found);
}

std::vector<const CellRecord*> Writer::group(Group wanted) const {
    std::vector<const CellRecord*> list;
    for (const CellRecord& record : records_) {
        if (record.spec.group == wanted) list.push_back(&record);
    }
    return list;
}

std::vector<std::string> Writer::labels(const std::vector<const CellRecord*>& cells,
                                        const std::function<bool(const MethodResult&)>& wanted) const {
    std::vector<std::string> list;
    for (const CellRecord* record : cells) {
        for (const MethodResult& entry : record->measurement.methods) {
            if (wanted(entry) && std::find(list.begin(), list.end(), entry.label) == list.end()) {
                list.push_back(entry.label);
            }
        }
    }
    return list;
}

std::vector<std::string> Writer::own_labels() const {
    std::vector<const CellRecord*> all;
    for (const CellRecord& record : records_) all.push_back(&record);
    return labels(all, [](const MethodResult& entry) { return entry.family == "ohc" && is_default(entry); });
}

void Writer::find_floor() {
    for (const CellRecord& record : records_) {
        for (const MethodResult& again : record.measurement.methods) {
            if (!is_copy(again)) continue;
            const MethodResult* first = find_row(record, again.label.substr(0, again.label.size() - 8));
            if (first == nullptr) continue;
            const Ratio ratio = ratio_of(*first, again);
            if (ratio.known()) floors_.push_back({record.spec.id, first->label, ratio});
        }
    }
    std::vector<double> sizes;
    for (const Floor& entry : floors_) sizes.push_back(std::fabs(std::log(entry.ratio.value)));
    if (!sizes.empty()) floor_ = quantile(sizes, 0.9);
}

void Writer::add(Paragraph paragraph) { document_.blocks.emplace_back(std::move(paragraph)); }

void Writer::add_text(std::string text) { add({std::move(text), Paragraph::Style::normal}); }

void Writer::add_heading(std::string text) { document_.blocks.emplace_back(Heading{2, std::move(text)}); }

void Writer::add_table(Table table) {
    if (!table.rows.empty()) document_.blocks.emplace_back(std::move(table));
}

void Writer::add_figure(const std::string& name, const ScatterChart& chart, std::string caption) {
    document_.blocks.emplace_back(
        Figure{"charts/" + name + ".svg", draw(chart), std::move(caption), interactive(chart)});
}

TableRow::Style Writer::style_of(const MethodResult& entry) {
    if (!entry.exact()) return TableRow::Style::failed;
    return entry.own ? TableRow::Style::own : TableRow::Style::normal;
}

void Writer::every_cell() {
    add_heading("Every cell");
    for (const CellRecord& record : records_) {
        if (record.measurement.methods.empty()) continue;
        const MethodResult* embree = find_row(record, embree_anchor);
        const MethodResult* fcl = find_row(record, fcl_anchor);
        Table table;
        table.caption = record.spec.id;
        table.columns = {{"method"},
                         {"n", true},
                         {"update", true},
                         {"detect", true},
                         {"both (µs)", true},
                         {"wall p50", true},
                         {"wall p99", true},
                         {"cold", true},
                         {"Embree refit ÷ it [95 %]", true},
                         {"FCL AABB ÷ it [95 %]", true},
                         {"pairs"},
                         {"triangle tests", true},
                         {"work", true},
                         {"work max/median", true},
                         {"memory (MB)", true},
                         {"allocations, most", true},
                         {"prepare (ms)", true}};
        for (const MethodResult& entry : record.measurement.methods) {
            const std::optional<double> p99 = tail_quantile(in_us(entry.wall_ns), 0.99);
            const double work = static_cast<double>(entry.work.work());
            table.rows.push_back(
                {{"`" + entry.label + "`", fmt::format("{}", entry.step.size()),
                  time_text(median(in_us(entry.update_ns))), time_text(median(in_us(entry.detect_ns))),
                  time_text(median_time(entry)), time_text(median(in_us(entry.wall_ns))),
                  p99 ? time_text(*p99) : "n too small", time_text(median(in_us(entry.cold_ns))),
                  embree == nullptr ? "n/a" : ratio_text(ratio_of(*embree, entry), floor_),
                  fcl == nullptr ? "n/a" : ratio_text(ratio_of(*fcl, entry), floor_), pairs_text(entry),
                  fmt::format("{}", entry.work.triangle_tests), fmt::format("{}", entry.work.work()),
                  work > 0.0 ? format_number(static_cast<double>(entry.work_max) / work) : "n/a",
                  format_number(memory_mb(entry)), entry.allocations < 0 ? "n/a" : fmt::format("{}", entry.allocations),
                  entry.prepare_ns < 0.0 ? "n/a" : format_number(1e-6 * entry.prepare_ns)},
                 style_of(entry)});
        }
        table.note = fmt::format("{} triangles, {} vertices, {} true pairs, frames {}, load {}.", record.triangles,
                                 record.vertices, record.measurement.true_pairs, record.measurement.frames_hash,
                                 format_number(record.load_after));
        table.folded = true;
        add_table(std::move(table));
    }
}

void Writer::rebuild() {
    add_heading("How to rebuild this");
    const bool quick = records_.front().spec.quick;
    document_.blocks.emplace_back(CodeBlock{
        fmt::format("./run.sh bench detection{}            # measure, rebuild reports/detection\n"
                    "./run.sh bench report reports/detection    # the same report from records.jsonl, byte for byte",
                    quick ? " --quick" : "")});
}

BenchReport make_report(const std::vector<CellRecord>& records) { return Writer(records).write(); }

BenchReport write_report(const std::filesystem::path& directory) {
    BenchReport report = make_report(read_cells(directory / "records.jsonl"));
    write_report_files(directory, report.files);
    return report;
}

}  // namespace trocar::bench
