// Page one of the benchmark: the sentence, the targets and the chart of time against size.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "report_writer.hpp"

namespace trocar::bench {
namespace {

struct Target {
    const char* cell;
    std::string_view anchor;
    double first;
    double goal;
};

}  // namespace

std::string Writer::summary_sentence() const {
    const CellRecord* record = cell(main_cell);
    if (record == nullptr)
        return "The main cell, light contact of 20k tissue and 2k instrument triangles, was not measured.";
    std::string text = fmt::format(
        "Tissue of 20k triangles, all moving, vertices renumbered along a curve, instrument of 2k, {} true pairs, "
        "update and detect to the sorted list of pairs, one thread:",
        record->measurement.true_pairs);
    const char* separator = " ";
    std::vector<std::string> names = own_labels();
    names.emplace_back(embree_anchor);
    names.emplace_back(fcl_anchor);
    for (const std::string& name : names) {
        const MethodResult* entry = find_row(*record, name);
        if (entry == nullptr) continue;
        text += fmt::format("{}`{}` {} µs", separator, name, time_text(median_time(*entry)));
        if (!entry->exact()) text += fmt::format(" ({})", pairs_text(*entry));
        separator = ", ";
    }
    return text + ".";
}

void Writer::page_one() {
    report_.page_one = summary_sentence();
    add({report_.page_one, Paragraph::Style::quote});
    for (const CellRecord& record : records_) {
        if (!record.outcome.ok()) {
            add({fmt::format("Cell `{}` was not measured: {}.", record.spec.id, record.outcome.message),
                 Paragraph::Style::warning});
        }
        for (const MethodResult& entry : record.measurement.methods) {
            if (entry.claims_exact && entry.outcome.ok() && !entry.exact()) {
                broken_claim(entry.label, record.spec.id, pairs_text(entry));
            }
        }
    }
    const double load = records_.front().load_after;
    if (load > 1.5) {
        add({fmt::format("The machine was shared while this was measured (load {} at the first cell's end): "
                         "read the ratios, not the microseconds.",
                         format_number(load)),
             Paragraph::Style::warning});
    }
    targets();
    time_against_size();
}

void Writer::broken_claim(const std::string& label, const std::string& cell, const std::string& what) {
    report_.broken_claims.push_back(fmt::format("{} in {}: {}", label, cell, what));
    add({"Claims to be exact and is not: " + report_.broken_claims.back(), Paragraph::Style::warning});
}

std::string Writer::fastest_baseline(const CellRecord& record) {
    const MethodResult* fastest = nullptr;
    for (const MethodResult& entry : record.measurement.methods) {
        if (entry.own || entry.library == "trocar" || is_copy(entry) || !entry.exact() || entry.step.empty()) continue;
        if (fastest == nullptr || median_time(entry) < median_time(*fastest)) fastest = &entry;
    }
    if (fastest == nullptr) return "n/a";
    return fmt::format("{}, `{}`", time_text(median_time(*fastest)), fastest->label);
}

void Writer::targets() {
    static const std::vector<Target> table{
        {"size: light 20k x 2k", embree_anchor, 6, 15},
        {"size: light 20k x 2k", fcl_anchor, 30, 75},
        {"size: light 200k x 2k", embree_anchor, 15, 50},
        {"size: light 200k x 2k", fcl_anchor, 70, 200},
        {"order: light 200k x 2k generated", embree_anchor, 15, 50},
        {"order: light 200k x 2k generated", fcl_anchor, 70, 200},
        {"size: light 1M x 2k", embree_anchor, 20, 100},
        {"size: light 1M x 2k", fcl_anchor, 70, 300},
        {"size: deep 200k x 10k", embree_anchor, 10, 25},
        {"multi: light 5 x 20k + 10 x 2k", embree_anchor, 5, 10},
    };
    Table result;
    result.caption = "Targets: how many times faster than the baseline, same pair sets";
    result.columns = {{"case"},
                      {"baseline"},
                      {"baseline (µs)", true},
                      {"fastest exact baseline (µs)", true},
                      {"first step", true},
                      {"goal", true}};
    const std::vector<std::string> own = own_labels();
    for (const std::string& name : own) result.columns.push_back({"`" + name + "`", true});
    for (const Target& target : table) {
        const CellRecord* record = cell(target.cell);
        if (record == nullptr) continue;
        const MethodResult* baseline = find_row(*record, target.anchor);
        TableRow line{{target.cell, fmt::format("`{}`", target.anchor),
                       baseline == nullptr ? "absent" : time_text(median_time(*baseline)), fastest_baseline(*record),
                       format_number(target.first), format_number(target.goal)}};
        for (const std::string& name : own) {
            const MethodResult* ours = find_row(*record, name);
            if (baseline == nullptr || ours == nullptr) {
                line.cells.emplace_back("n/a");
                continue;
            }
            const Ratio ratio = ratio_of(*baseline, *ours);
            std::string text = ratio_text(ratio, floor_);
            if (!ours->exact()) text = "n/a (" + pairs_text(*ours) + ")";
            if (ours->exact() && ratio.value >= target.goal)
                text += " goal";
            else if (ours->exact() && ratio.value >= target.first)
                text += " first step";
            line.cells.push_back(text);
        }
        result.rows.push_back(std::move(line));
    }
    result.note =
        "Median times over the steps that both were measured on, 95 % block bootstrap within one process; “first step” "
        "and “goal” behind a number say which target it reaches. Vertices and triangles are renumbered along a curve, "
        "for every method alike, but in the rows “generated”.";
    add_table(std::move(result));
    own_growth(own);
}

void Writer::own_growth(const std::vector<std::string>& own) {
    Table result;
    result.caption = "How our cost grows: times its own cost elsewhere";
    result.columns = {{"case"}, {"against"}, {"first step", true}, {"goal", true}};
    for (const std::string& name : own) result.columns.push_back({"`" + name + "`", true});
    TableRow local{{"10⁶ tissue, deformation local to the contact", "itself at 20k", "≤ 3", "≤ 1.5"}};
    const auto growth = [this](const std::string& name) {
        const double ratio = time("local: local 1M x 2k", name) / time("local: local 20k x 2k", name);
        const char* const reached = ratio <= 1.5 ? " goal" : ratio <= 3.0 ? " first step" : "";
        return format_number(ratio) + reached;
    };
    for (const std::string& name : own) local.cells.push_back(growth(name));
    result.rows.push_back(std::move(local));
    for (const CellRecord* record : group(Group::bounded)) {
        TableRow worst{{fmt::format("worst of {} ticks of {}, in work", record->bounded.ticks, record->bounded.scene),
                        "its own median", "≤ 3", "≤ 3"}};
        for (const std::string& name : own) {
            const auto& methods = record->bounded.methods;
            const auto found = std::find_if(methods.begin(), methods.end(),
                                            [&name](const BoundedResult& entry) { return entry.label == name; });
            const bool known = found != methods.end() && found->outcome.ok() && found->work_ratio() > 0.0;
            worst.cells.push_back(
                !known ? "n/a" : format_number(found->work_ratio()) + (found->work_ratio() <= 3.0 ? " goal" : ""));
        }
        result.rows.push_back(std::move(worst));
    }
    add_table(std::move(result));
}

MarkStyle Writer::mark_of(const std::string& label) {
    const auto found = std::find(marked_.begin(), marked_.end(), label);
    const auto number = static_cast<int>(found - marked_.begin());
    if (found == marked_.end()) marked_.push_back(label);
    return mark_style(number);
}

ScatterChart Writer::chart_over(const std::vector<const CellRecord*>& cells, const std::vector<std::string>& names,
                                const Axis& x, const std::function<double(const MethodResult&, const CellRecord&)>& y) {
    ScatterChart chart;
    for (const std::string& name : names) {
        ChartSeries series{.name = name, .style = mark_of(name), .points = {}, .connected = true};
        for (const CellRecord* record : cells) {
            const MethodResult* entry = find_row(*record, name);
            if (entry == nullptr) continue;
            const double value = y(*entry, *record);
            if (!(value > 0.0)) continue;
            series.points.push_back(
                {x(*record), value,
                 fmt::format("{}, {}: {} ({})", name, record->spec.id, format_number(value), pairs_text(*entry)), ""});
        }
        std::stable_sort(series.points.begin(), series.points.end(),
                         [](const ChartPoint& a, const ChartPoint& b) { return a.x < b.x; });
        if (!series.points.empty()) chart.series.push_back(std::move(series));
    }
    return chart;
}

double Writer::time_of(const MethodResult& entry, const CellRecord& /*record*/) { return median_time(entry); }

bool Writer::in_charts(const MethodResult& entry) { return !is_copy(entry); }

void Writer::time_against_size() {
    std::vector<const CellRecord*> cells;
    for (const CellRecord* record : group(Group::size)) {
        if (record->spec.scene.variant == Variant::light && record->spec.scene.instrument_triangles == 2000) {
            cells.push_back(record);
        }
    }
    if (cells.empty()) return;
    ScatterChart chart = chart_over(
        cells, labels(cells, in_charts), [](const CellRecord& record) { return static_cast<double>(record.triangles); },
        time_of);
    chart.x_title = "triangles in the scene (instrument: 2k)";
    chart.y_title = "median time of a step, update and detect (µs)";
    add_figure("time_against_size", chart,
               "Light contact, every vertex moving every step. A line that stops was left out above that size "
               "(too slow to be worth the time).");
}

}  // namespace trocar::bench
