// One table or chart for each group of cells: sizes, stages, the bounded tick, bodies, cell edge, vertex order.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "geometry/number_text.hpp"
#include "measure/statistics.hpp"
#include "report_writer.hpp"

namespace trocar::bench {

void Writer::matrix(const std::string& caption, const std::vector<const CellRecord*>& cells, const std::string& note) {
    if (cells.empty()) return;
    Table table;
    table.caption = caption;
    table.columns = {{"method"}};
    for (const CellRecord* record : cells) {
        const std::size_t colon = record->spec.id.find(": ");
        table.columns.push_back({record->spec.id.substr(colon == std::string::npos ? 0 : colon + 2), true});
    }
    for (const std::string& label : labels(cells, [](const MethodResult& entry) { return !is_copy(entry); })) {
        TableRow line{{"`" + label + "`"}};
        for (const CellRecord* record : cells) {
            const MethodResult* entry = find_row(*record, label);
            if (entry == nullptr) {
                line.cells.emplace_back("–");
                continue;
            }
            line.cells.push_back(time_text(median_time(*entry)) + (entry->exact() ? "" : " †"));
            if (entry->own) line.style = TableRow::Style::own;
        }
        table.rows.push_back(std::move(line));
    }
    TableRow pairs{{"true pairs"}};
    for (const CellRecord* record : cells) pairs.cells.push_back(fmt::format("{}", record->measurement.true_pairs));
    table.rows.push_back(std::move(pairs));
    table.note = note + " Medians of update and detect together, µs. † pair set differs from truth; – left out.";
    add_table(std::move(table));
}

void Writer::sizes() {
    add_heading("Time over size and motion");
    for (const Variant variant : {Variant::light, Variant::deep}) {
        std::vector<const CellRecord*> cells;
        for (const CellRecord* record : group(Group::size)) {
            if (record->spec.scene.variant == variant) cells.push_back(record);
        }
        matrix(fmt::format("Tissue N × instrument M, {}", name_of(variant)), cells, "");
    }
    std::vector<const CellRecord*> cells;
    for (const CellRecord* record : group(Group::size)) {
        if (record->spec.scene.tissue_triangles == 20000) cells.push_back(record);
    }
    if (cells.size() > 1) {
        ScatterChart chart = chart_over(
            cells, labels(cells, in_charts),
            [](const CellRecord& record) { return static_cast<double>(record.measurement.true_pairs); }, time_of);
        chart.x_title = "true pairs (tissue: 20k)";
        chart.y_title = "median time of a step (µs)";
        add_figure("time_against_pairs", chart,
                   "Light and deep contact with instruments of 500, 2k and 10k triangles, ordered by true pairs.");
    }
    matrix("Motion", group(Group::motion),
           "Near: boxes of the bodies overlap, nothing touches; far: they do not. Both are shown for completeness: "
           "a test of two boxes in front of any method gives it most of that.");
    matrix("Several bodies", group(Group::multi), "");
    matrix("Local deformation, moved ranges given", group(Group::local), "");
}

void Writer::reaches() {
    const std::vector<const CellRecord*> cells = group(Group::query_distance);
    if (cells.empty()) return;
    add_heading("Within the query distance of closed loops");
    add_text(
        "Responses with a look-ahead need all pairs of triangles at most a query distance apart: a tenth of the "
        "smallest mean edge and the path of a step, rounded up to that tenth times a power of two. Who can answer "
        "that is asked both ways in turns on the same frames; near pairs are held against truth as meeting ones are. "
        "Candidates are each method's own; distances are computed by the same code for all, of which ours first "
        "decide most pairs in vectors of floats, as they do for meeting pairs.");
    for (const CellRecord* record : cells) {
        const std::string embree_label = std::string(embree_anchor) + std::string(within_query_distance);
        const std::string fcl_label = std::string(fcl_anchor) + std::string(within_query_distance);
        const MethodResult* embree = find_row(*record, embree_label);
        const MethodResult* fcl = find_row(*record, fcl_label);
        Table table;
        table.caption = record->spec.id;
        table.columns = {{"method"},
                         {"meeting pairs (µs)", true},
                         {"within the query distance (µs)", true},
                         {"within ÷ meeting [95 %]", true},
                         {"Embree refit ÷ it [95 %]", true},
                         {"FCL AABB ÷ it [95 %]", true},
                         {"triangle tests", true},
                         {"pairs within the query distance"}};
        std::string refusing;
        for (const MethodResult& within : record->measurement.methods) {
            if (!within.within_query_distance) continue;
            const std::string label = within.label.substr(0, within.label.size() - within_query_distance.size());
            if (within.outcome.kind == OutcomeKind::unsupported) {
                refusing += fmt::format("{}`{}`", refusing.empty() ? "" : ", ", label);
                continue;
            }
            const MethodResult* meeting = find_row(*record, label);
            table.rows.push_back({{"`" + label + "`", meeting == nullptr ? "n/a" : time_text(median_time(*meeting)),
                                   time_text(median_time(within)),
                                   meeting == nullptr ? "n/a" : ratio_text(ratio_of(within, *meeting), floor_),
                                   embree == nullptr ? "n/a" : ratio_text(ratio_of(*embree, within), floor_),
                                   fcl == nullptr ? "n/a" : ratio_text(ratio_of(*fcl, within), floor_),
                                   fmt::format("{}", within.work.triangle_tests), pairs_text(within)},
                                  style_of(within)});
        }
        table.note = fmt::format(
            "Query distance {} mm; {} true pairs meet, {} more are within the query distance.{}",
            format_number(1e3 * record->query_distance), record->measurement.true_pairs,
            record->measurement.true_near_pairs,
            refusing.empty() ? "" : " Not asked within the query distance, which they cannot: " + refusing + ".");
        add_table(std::move(table));
    }
}

void Writer::stages() {
    const CellRecord* record = cell(main_cell);
    if (record == nullptr) return;
    BarChart chart;
    chart.x_title = "median time (µs), " + record->spec.id;
    chart.parts = {"update", "detect"};
    std::vector<std::pair<double, BarChart::Bar>> bars;
    for (const MethodResult& entry : record->measurement.methods) {
        if (is_copy(entry) || !entry.outcome.ok() || entry.step.empty()) continue;
        const double update = median(in_us(entry.update_ns));
        const double detect = median(in_us(entry.detect_ns));
        bars.push_back({update + detect, {entry.label, {update, detect}}});
    }
    std::stable_sort(bars.begin(), bars.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    // Bars are linear: what takes many times as long as the rest would hide the rest.
    for (auto& [total, bar] : bars) {
        if (total <= 12.0 * bars[bars.size() / 3].first) chart.bars.push_back(std::move(bar));
    }
    document_.blocks.emplace_back(
        Figure{"charts/stages.svg", draw(chart),
               "Where the time goes. The slowest methods are left out here, not in the tables."});
}

void Writer::bounded() {
    bool first = true;
    for (const CellRecord* record : group(Group::bounded)) {
        const BoundedMeasurement& measured = record->bounded;
        if (measured.methods.empty()) continue;
        if (std::exchange(first, false)) {
            add_heading("The worst tick");
            add_text(
                "A scene driven by a neutral spring per triangle pair, its motion repeated, each time in another "
                "direction: ticks with at least one pair of overlapping triangle boxes, one after the other. Work is "
                "counted (vertices read + cells visited + box tests + triangle tests); the target is a worst tick of "
                "at most 3 times the median. The empty loop is arithmetic in registers that takes as long as the "
                "method's median tick, run right after it: what its worst tick shows is the machine.");
        }
        Table table;
        table.caption = fmt::format("`scenes/{}.json`, worst tick of {}; {} box pairs and {} true pairs at the median",
                                    measured.scene, measured.ticks, format_number(measured.box_pairs),
                                    format_number(measured.true_pairs));
        table.columns = {{"method"},
                         {"work, median", true},
                         {"work, worst", true},
                         {"worst ÷ median", true},
                         {"wall median (µs)", true},
                         {"p99", true},
                         {"p99.9", true},
                         {"worst", true},
                         {"empty loop median", true},
                         {"p99", true},
                         {"p99.9", true},
                         {"worst", true},
                         {"allocations, all ticks", true},
                         {"pairs"}};
        for (const BoundedResult& entry : measured.methods) {
            TableRow line{{"`" + entry.label + "`"}};
            line.style = entry.own ? TableRow::Style::own : TableRow::Style::normal;
            std::string pairs = fmt::format("exact in {} ticks asked", entry.truth_ticks);
            if (entry.wrong_ticks > 0) {
                pairs = fmt::format("differs in {} of {} ticks asked", entry.wrong_ticks, entry.truth_ticks);
                line.style = TableRow::Style::failed;
                if (entry.claims_exact) broken_claim(entry.label, record->spec.id, pairs);
            }
            if (entry.truncated > 0) {
                pairs += fmt::format(", truncated in {} ticks", entry.truncated);
                line.style = TableRow::Style::failed;
            }
            if (!entry.outcome.ok()) {
                pairs = std::string(name_of(entry.outcome.kind)) + ": " + entry.outcome.message;
                line.style = TableRow::Style::failed;
            }
            const auto in_us_text = [](double ns) { return ns < 0.0 ? std::string("–") : format_number(us * ns); };
            // What a library does inside is not counted, so a baseline's work says nothing about its worst tick.
            const auto counted = [&entry](std::string text) { return entry.own ? std::move(text) : "n/a"; };
            line.cells.push_back(counted(format_number(entry.work.median)));
            line.cells.push_back(counted(format_number(entry.work.max)));
            line.cells.push_back(
                counted(format_number(entry.work_ratio()) + (entry.work_ratio() <= 3.0 ? " ≤ 3" : "")));
            for (const Spread& spread : {entry.wall, entry.empty}) {
                for (const double ns : {spread.median, spread.p99, spread.p999, spread.max}) {
                    line.cells.push_back(in_us_text(ns));
                }
            }
            line.cells.push_back(entry.allocations < 0 ? "not counted" : fmt::format("{}", entry.allocations));
            line.cells.push_back(pairs);
            table.rows.push_back(std::move(line));
        }
        table.note = fmt::format(
            "Wall time, update and detect. Methods take turns on each tick. Work of libraries cannot be seen from "
            "outside. Frames {}, load {} at the end.",
            measured.frames_hash, format_number(record->load_after));
        add_table(std::move(table));
    }
}

void Writer::bodies() {
    const std::vector<const CellRecord*> cells = group(Group::bodies);
    if (cells.empty()) return;
    add_heading("Many bodies");
    add_text(
        "Bodies of 320 triangles on a lattice, all deforming, all to be tested against all; each touches its "
        "neighbours along one axis only. A broad phase that examines pairs of bodies grows with their square.");
    const auto bodies_of = [](const CellRecord& record) { return static_cast<double>(record.spec.bodies); };
    const auto per_body = [](const MethodResult& entry, const CellRecord& record) {
        return median_time(entry) / static_cast<double>(record.spec.bodies);
    };
    ScatterChart chart = chart_over(cells, labels(cells, in_charts), bodies_of, per_body);
    chart.x_title = "bodies";
    chart.y_title = "median time of a step per body (µs)";
    add_figure("time_against_bodies", chart, "A level line is a cost that does not depend on pairs of bodies.");
    matrix("Time over number of bodies", cells, "");
    Table table;
    table.caption = "Work per body (vertices read + cells visited + box tests + triangle tests)";
    table.columns = {{"method"}};
    for (const CellRecord* record : cells) table.columns.push_back({record->spec.id.substr(8), true});
    for (const std::string& label : labels(cells, in_charts)) {
        TableRow line{{"`" + label + "`"}};
        bool counted = false;
        for (const CellRecord* record : cells) {
            const MethodResult* entry = find_row(*record, label);
            const double work = entry == nullptr ? 0.0 : static_cast<double>(entry->work.work());
            counted = counted || work > 0.0;
            line.cells.push_back(work > 0.0 ? format_number(work / record->spec.bodies) : "n/a");
        }
        if (counted) table.rows.push_back(std::move(line));
    }
    table.note =
        "Counters do not depend on the machine. Baselines count what can be seen from outside: what a library does "
        "inside is not in these numbers.";
    add_table(std::move(table));
}

void Writer::cell_sweep() {
    const std::vector<const CellRecord*> cells = group(Group::cell_size);
    if (cells.empty()) return;
    add_heading("Size of a cell");
    ScatterChart chart;
    chart.x_title = "cell edge / mean edge of the tissue";
    chart.y_title = "median time of a step (µs)";
    Table table;
    table.caption = "Cell edge of ohc and of the one-level tessellation";
    table.columns = {{"scene"},
                     {"cell"},
                     {"time (µs)", true},
                     {"update", true},
                     {"detect", true},
                     {"cells visited", true},
                     {"box tests", true},
                     {"triangle tests", true},
                     {"memory (MB)", true},
                     {"pairs"}};
    for (const CellRecord* record : cells) {
        std::map<std::string, std::size_t> series_of;  // method without its cell -> number in the chart
        for (const MethodResult& entry : record->measurement.methods) {
            table.rows.push_back(
                {{record->spec.scene.name(), entry.label, time_text(median_time(entry)),
                  time_text(median(in_us(entry.update_ns))), time_text(median(in_us(entry.detect_ns))),
                  fmt::format("{}", entry.work.cells_visited), fmt::format("{}", entry.work.box_tests),
                  fmt::format("{}", entry.work.triangle_tests), format_number(memory_mb(entry)), pairs_text(entry)},
                 style_of(entry)});
            const std::size_t equals = entry.method.find("cell=");
            if (equals == std::string::npos || !entry.outcome.ok()) continue;
            const std::size_t begin = equals + 5;
            const auto cell = number_of_text<double>(
                std::string_view(entry.method).substr(begin, entry.method.find(',', begin) - begin));
            if (!cell) continue;
            const std::string name =
                fmt::format("{}, {}", entry.method.substr(0, equals - 1), record->spec.scene.name());
            const auto [place, is_new] = series_of.emplace(name, chart.series.size());
            if (is_new) {
                chart.series.push_back({.name = name, .style = mark_of(name), .points = {}, .connected = true});
            }
            const double factor = *cell / record->tissue_edge;
            chart.series[place->second].points.push_back({factor, median_time(entry), entry.label, ""});
        }
    }
    if (!chart.series.empty()) {
        add_figure("cell_size", chart,
                   "Too small a cell: triangles lie in many cells. Too large: many triangles share one (thesis §3.3).");
    }
    add_table(std::move(table));
}

void Writer::orders() {
    const std::vector<const CellRecord*> cells = group(Group::order);
    if (cells.empty()) return;
    add_heading("Order of vertices");
    Table table;
    table.caption = "Original order beside the renumbered one";
    table.columns = {{"scene"}, {"method"}, {"renumbered (µs)", true}, {"this order (µs)", true}, {"factor", true}};
    for (const CellRecord* record : cells) {
        SceneSpec renumbered = record->spec.scene;
        renumbered.order = VertexOrder::renumbered;
        const std::string id = "size: " + renumbered.name();
        for (const MethodResult& entry : record->measurement.methods) {
            const double before = time(id, entry.label);
            const double now = median_time(entry);
            if (std::isnan(before) || std::isnan(now)) continue;
            table.rows.push_back({{record->spec.scene.name(), "`" + entry.label + "`", time_text(before),
                                   time_text(now), format_number(now / before)},
                                  style_of(entry)});
        }
    }
    table.note =
        "All other cells use vertices and triangles renumbered once, at load, along a space-filling curve, for every "
        "method alike. Generated: face by face, row by row. Shuffled: at random.";
    add_table(std::move(table));
}

}  // namespace trocar::bench
