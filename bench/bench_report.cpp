#include "bench_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "measure/statistics.hpp"
#include "report/chart.hpp"
#include "report/document.hpp"
#include "session.hpp"
#include "study/runner.hpp"

namespace trocar::bench {
namespace {

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();
constexpr double us = 1e-3;  // ns to µs
constexpr const char* main_cell = "size: light 20k x 2k";

// ---- figures out of rows ----

/// Median of copies; the library's own sorts, which is too slow for thousands of resamples.
double quick_median(std::vector<double> values) {
    if (values.empty()) return not_known;
    const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), half, values.end());
    if (values.size() % 2 == 1) return *half;
    return 0.5 * (*half + *std::max_element(values.begin(), half));
}

std::vector<double> step_times(const MethodResult& row) {
    std::vector<double> times;
    for (std::size_t i = 0; i < row.step.size(); ++i) {
        times.push_back(us * static_cast<double>(row.update_ns[i] + row.detect_ns[i]));
    }
    return times;
}
std::vector<double> in_us(const std::vector<std::int64_t>& ns) {
    std::vector<double> times;
    times.reserve(ns.size());
    for (const std::int64_t value : ns) times.push_back(us * static_cast<double>(value));
    return times;
}
/// µs per step; NaN for a row that failed.
double median_time(const MethodResult& row) { return row.outcome.ok() ? median(step_times(row)) : not_known; }

struct Ratio {
    double value = not_known;
    Bounds bounds;
    [[nodiscard]] bool known() const { return !std::isnan(value); }
};

/// How many times longer `slow` takes than `fast`, over the steps that both have.
Ratio ratio_of(const MethodResult& slow, const MethodResult& fast) {
    std::vector<double> a;
    std::vector<double> b;
    const std::vector<double> slow_times = step_times(slow);
    const std::vector<double> fast_times = step_times(fast);
    std::size_t j = 0;
    for (std::size_t i = 0; i < slow.step.size(); ++i) {
        while (j < fast.step.size() && fast.step[j] < slow.step[i]) ++j;
        if (j == fast.step.size()) break;
        if (fast.step[j] != slow.step[i]) continue;
        a.push_back(slow_times[i]);
        b.push_back(fast_times[j]);
    }
    Ratio ratio;
    if (a.empty() || !slow.outcome.ok() || !fast.outcome.ok()) return ratio;
    ratio.value = quick_median(a) / quick_median(b);
    constexpr std::int64_t neighbours = 8;
    constexpr int resamples = 400;
    if (a.size() >= 4) ratio.bounds = bootstrap_ratio({a}, {b}, quick_median, neighbours, 1, resamples);
    return ratio;
}

std::string ratio_text(const Ratio& ratio, double floor) {
    if (!ratio.known()) return "n/a";
    std::string text = format_number(ratio.value);
    if (std::fabs(std::log(ratio.value)) <= floor) text = "≈ " + text;
    if (std::isnan(ratio.bounds.low)) return text;
    return text + fmt::format(" [{}, {}]", format_number(ratio.bounds.low), format_number(ratio.bounds.high));
}

std::string time_text(double value) { return format_number(value); }

double memory_mb(const MethodResult& row) {
    const std::int64_t most = std::max(row.heap_bytes, row.resident_bytes);
    return most < 0 ? not_known : 1e-6 * static_cast<double>(most);
}

/// "yes", or what is wrong with the pair sets.
std::string pairs_text(const MethodResult& row) {
    if (!row.outcome.ok()) {
        return std::string(name_of(row.outcome.kind)) + (row.outcome.message.empty() ? "" : ": " + row.outcome.message);
    }
    if (row.exact()) return "exact";
    if (row.missing == 0 && row.extra == 0) {
        return fmt::format("differs on {} of {} steps", row.differing_steps, row.step.size());
    }
    return fmt::format("misses {} and invents {} of {}", row.missing, row.extra, row.true_pairs);
}

bool is_default(const MethodResult& row) {
    return row.label == row.method && row.method.find(':') == std::string::npos;
}
bool is_copy(const MethodResult& row) { return row.label.ends_with(" (again)"); }

const MethodResult* find_row(const CellRecord& cell, std::string_view label) {
    for (const MethodResult& row : cell.measurement.methods) {
        if (row.label == label && !row.step.empty()) return &row;
    }
    return nullptr;
}

class Writer {
public:
    explicit Writer(const std::vector<CellRecord>& records) : records_(records) {}

    BenchReport write() {
        find_floor();
        document_.title = "Detection benchmark";
        page_one();
        origin();
        fairness();
        sizes();
        stages();
        bounded();
        bodies();
        cell_sweep();
        orders();
        settings();
        tuning();
        table_31();
        micro();
        every_cell();
        rebuild();
        report_.files["report.md"] = to_markdown(document_);
        report_.files["report.html"] = to_html(document_);
        report_.files["results.csv"] = csv();
        for (const auto& block : document_.blocks) {
            if (const auto* figure = std::get_if<Figure>(&block)) report_.files[figure->file] = figure->svg;
        }
        return std::move(report_);
    }

private:
    // ---- access ----

    [[nodiscard]] const CellRecord* cell(std::string_view id) const {
        for (const CellRecord& record : records_) {
            if (record.spec.id == id && record.outcome.ok()) return &record;
        }
        return nullptr;
    }
    [[nodiscard]] const MethodResult* row(std::string_view id, std::string_view label) const {
        const CellRecord* record = cell(id);
        return record == nullptr ? nullptr : find_row(*record, label);
    }
    [[nodiscard]] double time(std::string_view id, std::string_view label) const {
        const MethodResult* found = row(id, label);
        return found == nullptr ? not_known : median_time(*found);
    }
    [[nodiscard]] std::vector<const CellRecord*> group(Group wanted) const {
        std::vector<const CellRecord*> list;
        for (const CellRecord& record : records_) {
            if (record.spec.group == wanted) list.push_back(&record);
        }
        return list;
    }
    /// Labels in order of appearance, those for which `wanted` holds.
    [[nodiscard]] std::vector<std::string> labels(const std::vector<const CellRecord*>& cells,
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
    /// Our default detectors that are contestants for speed: those of the cascade, in table order.
    [[nodiscard]] std::vector<std::string> own_labels() const {
        std::vector<const CellRecord*> all;
        for (const CellRecord& record : records_) all.push_back(&record);
        return labels(all, [](const MethodResult& entry) { return entry.family == "ohc" && is_default(entry); });
    }

    void find_floor() {
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

    // ---- text ----

    void add(Paragraph paragraph) { document_.blocks.emplace_back(std::move(paragraph)); }
    void add_text(std::string text) { add({std::move(text), Paragraph::Style::normal}); }
    void add_heading(std::string text) { document_.blocks.emplace_back(Heading{2, std::move(text)}); }
    void add_table(Table table) {
        if (!table.rows.empty()) document_.blocks.emplace_back(std::move(table));
    }
    void add_figure(const std::string& name, const std::string& svg, std::string caption) {
        document_.blocks.emplace_back(Figure{"charts/" + name + ".svg", svg, std::move(caption)});
    }
    static TableRow::Style style_of(const MethodResult& entry) {
        if (!entry.exact()) return TableRow::Style::failed;
        return entry.own ? TableRow::Style::own : TableRow::Style::normal;
    }

    [[nodiscard]] std::string summary_sentence() const {
        const CellRecord* record = cell(main_cell);
        if (record == nullptr)
            return "The main cell, light contact of 20k tissue and 2k instrument triangles, was not measured.";
        std::string text = fmt::format(
            "Tissue of 20k triangles, all moving, vertices renumbered along a curve, instrument of 2k, {} true pairs, "
            "update and detect to the sorted "
            "list "
            "of pairs, one thread:",
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

    void page_one() {
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

    void broken_claim(const std::string& label, const std::string& cell, const std::string& what) {
        report_.broken_claims.push_back(fmt::format("{} in {}: {}", label, cell, what));
        add({"Claims to be exact and is not: " + report_.broken_claims.back(), Paragraph::Style::warning});
    }

    struct Target {
        const char* cell;
        std::string_view anchor;
        double first;
        double goal;
    };

    /// "375, `embree_collide:leaf=cluster`"
    static std::string fastest_rival(const CellRecord& record) {
        const MethodResult* fastest = nullptr;
        for (const MethodResult& entry : record.measurement.methods) {
            if (entry.own || entry.library == "trocar" || is_copy(entry) || !entry.exact() || entry.step.empty())
                continue;
            if (fastest == nullptr || median_time(entry) < median_time(*fastest)) fastest = &entry;
        }
        if (fastest == nullptr) return "n/a";
        return fmt::format("{}, `{}`", time_text(median_time(*fastest)), fastest->label);
    }

    void targets() {
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
        result.caption = "Targets: how many times faster than the rival, same pair sets";
        result.columns = {
            {"case"},      {"rival"}, {"rival (µs)", true}, {"fastest exact rival (µs)", true}, {"first step", true},
            {"goal", true}};
        const std::vector<std::string> own = own_labels();
        for (const std::string& name : own) result.columns.push_back({"`" + name + "`", true});
        for (const Target& target : table) {
            const CellRecord* record = cell(target.cell);
            if (record == nullptr) continue;
            const MethodResult* rival = find_row(*record, target.anchor);
            TableRow line{{target.cell, fmt::format("`{}`", target.anchor),
                           rival == nullptr ? "absent" : time_text(median_time(*rival)), fastest_rival(*record),
                           format_number(target.first), format_number(target.goal)}};
            for (const std::string& name : own) {
                const MethodResult* ours = find_row(*record, name);
                if (rival == nullptr || ours == nullptr) {
                    line.cells.emplace_back("n/a");
                    continue;
                }
                const Ratio ratio = ratio_of(*rival, *ours);
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
        TableRow local{{"10⁶ tissue, deformation local to the contact", "itself at 20k", "", "", "≤ 3", "≤ 1.5"}};
        const auto growth = [this](const std::string& name) {
            const double ratio = time("local: local 1M x 2k", name) / time("local: local 20k x 2k", name);
            const char* const reached = ratio <= 1.5 ? " goal" : ratio <= 3.0 ? " first step" : "";
            return format_number(ratio) + reached;
        };
        for (const std::string& name : own) {
            // Where remembering is an option, it is the one that claims this; the default stands beside it.
            const std::string option = name + ":incremental=on";
            const bool measured = std::isfinite(time("local: local 1M x 2k", option));
            local.cells.push_back(
                measured ? fmt::format("{} `incremental=on`; default {}", growth(option), growth(name)) : growth(name));
        }
        result.rows.push_back(std::move(local));
        for (const CellRecord* record : group(Group::bounded)) {
            TableRow worst{{fmt::format("worst of {} ticks of i2t_drag, in work", record->bounded.ticks),
                            "its own median", "", "", "≤ 3", "≤ 3"}};
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
        result.note =
            "Ratio of median times over the steps that both were measured on, 95 % block bootstrap within one process; "
            "“first step” and “goal” behind a number say which target it reaches. Fastest exact rival: of all foreign "
            "settings in that cell. Vertices and triangles are renumbered along a space-filling curve, for every "
            "method "
            "alike, but in the rows “generated”, which have them face by face and row by row. The rows below the "
            "ratios are cost against cost.";
        add_table(std::move(result));
    }

    /// Every default and every bounding volume gets a colour and a shape of its own, the same in all charts.
    MarkStyle mark_of(const std::string& label) {
        const auto found = std::find(marked_.begin(), marked_.end(), label);
        const auto number = static_cast<int>(found - marked_.begin());
        if (found == marked_.end()) marked_.push_back(label);
        return {.colour = number, .shape = number, .hollow = number >= 8};
    }

    using Axis = std::function<double(const CellRecord&)>;
    ScatterChart chart_over(const std::vector<const CellRecord*>& cells, const std::vector<std::string>& names,
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
                     fmt::format("{}, {}: {} ({})", name, record->spec.id, format_number(value), pairs_text(*entry)),
                     ""});
            }
            std::stable_sort(series.points.begin(), series.points.end(),
                             [](const ChartPoint& a, const ChartPoint& b) { return a.x < b.x; });
            if (!series.points.empty()) chart.series.push_back(std::move(series));
        }
        return chart;
    }
    static double time_of(const MethodResult& entry, const CellRecord& /*record*/) { return median_time(entry); }
    static bool in_charts(const MethodResult& entry) { return !is_copy(entry); }

    void time_against_size() {
        std::vector<const CellRecord*> cells;
        for (const CellRecord* record : group(Group::size)) {
            if (record->spec.scene.variant == Variant::light && record->spec.scene.instrument_triangles == 2000) {
                cells.push_back(record);
            }
        }
        if (cells.empty()) return;
        ScatterChart chart = chart_over(
            cells, labels(cells, in_charts),
            [](const CellRecord& record) { return static_cast<double>(record.triangles); }, time_of);
        chart.x_title = "triangles in the scene (instrument: 2k)";
        chart.y_title = "median time of a step, update and detect (µs)";
        add_figure("time_against_size", draw(chart),
                   "Light contact, every vertex moving every step. A line that stops was left out above that size "
                   "(too slow to be worth the time).");
    }

    void origin() {
        add_heading("Where the numbers come from");
        Table table;
        table.caption = "Environment";
        table.columns = {{"fact"}, {"value"}};
        const CellRecord& record = records_.front();
        for (const auto& [key, value] : record.environment) table.rows.push_back({{key, value}});
        table.rows.push_back({{"binary", record.binary}});
        table.rows.push_back({{"mode", record.spec.quick ? "quick" : "full"}});
        double load = 0.0;
        std::set<std::string> binaries;
        for (const CellRecord& other : records_) {
            load = std::max(load, other.load_after);
            binaries.insert(other.binary);
        }
        table.rows.push_back({{"largest load at a cell's end", format_number(load)}});
        if (binaries.size() > 1) table.rows.push_back({{"warning", "records of several binaries"}});
        add_table(std::move(table));
        add_text(
            "Each cell (one scene, all contestants) is one process. Contestants take turns in random order, 8 blocks "
            "of "
            "consecutive steps each; a step before every block warms the caches up and is kept as the cold time. A "
            "step "
            "is `update` and `detect`, from a double-precision frame that was just written to the sorted list of all "
            "pairs. Stage times are CPU time of the whole process, all threads, so that other programs on the machine "
            "do not count; p99 is wall time. Slow contestants take fewer steps (column n); ratios use the steps that "
            "both sides have. The first step of each block is held against the exact oracle, every other step against "
            "a contestant that agreed with it.");
        Table floor;
        floor.caption = "A/A: the same method twice in one cell";
        floor.columns = {{"cell"}, {"method"}, {"ratio [95 %]", true}};
        for (const Floor& entry : floors_) {
            floor.rows.push_back({{entry.cell, "`" + entry.method + "`", ratio_text(entry.ratio, 0.0)}});
        }
        floor.note = fmt::format("Nine in ten lie within {} %; ratios closer to 1 than that are marked ≈.",
                                 format_number(100.0 * (std::exp(floor_) - 1.0)));
        floor.folded = true;
        add_table(std::move(floor));
    }

    void fairness() {
        add_heading("Who took part");
        Table table;
        table.caption = "Contestants";
        table.columns = {{"method"}, {"library"}, {"pairs decided by"}, {"claims exact"}, {"pair sets over all cells"}};
        std::vector<const CellRecord*> all;
        for (const CellRecord& record : records_) {
            if (record.spec.group != Group::tuning) all.push_back(&record);  // has a table of its own
        }
        for (const std::string& label : labels(all, [](const MethodResult& entry) { return !is_copy(entry); })) {
            const MethodResult* any = nullptr;
            std::int64_t missing = 0;
            std::int64_t extra = 0;
            std::int64_t truth = 0;
            std::int64_t differing = 0;
            std::int64_t steps = 0;
            std::vector<std::string> failures;
            for (const CellRecord& record : records_) {
                for (const MethodResult& entry : record.measurement.methods) {
                    if (entry.label != label) continue;
                    // A contestant that ended its process early has a row without a library.
                    if (any == nullptr || any->library.empty()) any = &entry;
                    missing += entry.missing;
                    extra += entry.extra;
                    truth += entry.true_pairs;
                    differing += entry.differing_steps;
                    steps += static_cast<std::int64_t>(entry.step.size());
                    if (!entry.outcome.ok()) failures.push_back(record.spec.id + ": " + pairs_text(entry));
                }
            }
            std::string verdict = steps == 0       ? "no step measured"
                                  : differing == 0 ? fmt::format("all of {} steps exact", steps)
                                                   : fmt::format(
                                                         "differs on {} of {} steps; misses {} and invents {} of "
                                                         "{} pairs where truth was asked",
                                                         differing, steps, missing, extra, truth);
            if (!failures.empty()) {
                verdict += fmt::format("; failed in {} cells, first in {}", failures.size(), failures.front());
            }
            table.rows.push_back(
                {{"`" + label + "`", any->library, any->narrow, any->claims_exact ? "yes" : "no", verdict},
                 differing > 0 || !failures.empty() ? TableRow::Style::failed
                 : any->own                         ? TableRow::Style::own
                                                    : TableRow::Style::normal});
        }
        table.note =
            "“trocar's exact test” is one narrow phase that all these share, so that among them only broad phases "
            "differ. Every setting of an adapter and its reason stand at the head of its file under baselines/.";
        add_table(std::move(table));
        std::set<std::pair<std::string, std::string>> missing;
        for (const CellRecord& record : records_) {
            for (const Missing& entry : record.missing) missing.emplace(entry.name, entry.reason);
        }
        Table absent;
        absent.caption = "Not here";
        absent.columns = {{"method or setting"}, {"reason"}};
        for (const auto& [name, reason] : missing) absent.rows.push_back({{"`" + name + "`", reason}});
        add_table(std::move(absent));
    }

    void matrix(const std::string& caption, const std::vector<const CellRecord*>& cells, const std::string& note) {
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

    void sizes() {
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
            add_figure("time_against_pairs", draw(chart),
                       "Light and deep contact with instruments of 500, 2k and 10k triangles, ordered by true pairs.");
        }
        matrix("Motion", group(Group::motion),
               "Near: boxes of the bodies overlap, nothing touches; far: they do not. Both are shown for completeness: "
               "a test of two boxes in front of any method gives it most of that.");
        matrix("Several bodies", group(Group::multi), "");
        matrix("Local deformation, moved ranges given", group(Group::local), "");
    }

    void stages() {
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
        add_figure("stages", draw(chart),
                   "Where the time goes. The slowest methods are left out here, not in the tables.");
    }

    void bounded() {
        for (const CellRecord* record : group(Group::bounded)) {
            const BoundedMeasurement& measured = record->bounded;
            if (measured.methods.empty()) continue;
            add_heading("The worst tick");
            add_text(fmt::format(
                "`scenes/i2t_drag.json` driven by a neutral spring per triangle pair, its drag repeated, each time in "
                "another direction: {} ticks with at least one pair of overlapping triangle boxes ({} "
                "box pairs and {} true pairs at the median), one after the other. Work is counted (vertices "
                "read + cells visited + box tests + triangle tests); the target is a worst tick of at most 3 "
                "times the median. The empty loop is arithmetic in registers that takes as long as the "
                "method's median tick, run right after it: what its worst tick shows is the machine.",
                measured.ticks, format_number(measured.box_pairs), format_number(measured.true_pairs)));
            Table table;
            table.caption = fmt::format("Worst tick of {}", measured.ticks);
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
                // What a library does inside is not counted, so a rival's work says nothing about its worst tick.
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

    void bodies() {
        const std::vector<const CellRecord*> cells = group(Group::bodies);
        if (cells.empty()) return;
        add_heading("Many bodies");
        add_text(
            "Bodies of 320 triangles on a lattice, all deforming, all to be tested against all; each touches its "
            "neighbours along one axis only. A broad phase that looks at pairs of bodies grows with their square. The "
            "rows “bodies: …” are broad phases over bodies alone, followed by the same search for triangles.");
        const auto bodies_of = [](const CellRecord& record) { return static_cast<double>(record.spec.bodies); };
        const auto per_body = [](const MethodResult& entry, const CellRecord& record) {
            return median_time(entry) / static_cast<double>(record.spec.bodies);
        };
        ScatterChart chart = chart_over(cells, labels(cells, in_charts), bodies_of, per_body);
        chart.x_title = "bodies";
        chart.y_title = "median time of a step per body (µs)";
        add_figure("time_against_bodies", draw(chart),
                   "A level line is a cost that does not depend on pairs of bodies.");
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
            "Counters do not depend on the machine. Rivals count what can be seen from outside: what a library does "
            "inside is not in these numbers.";
        add_table(std::move(table));
    }

    void cell_sweep() {
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
                const std::string name =
                    fmt::format("{}, {}", entry.method.substr(0, equals - 1), record->spec.scene.name());
                const auto [place, is_new] = series_of.emplace(name, chart.series.size());
                if (is_new) {
                    chart.series.push_back({.name = name, .style = mark_of(name), .points = {}, .connected = true});
                }
                const double factor = std::stod(entry.method.substr(equals + 5)) / record->tissue_edge;
                chart.series[place->second].points.push_back({factor, median_time(entry), entry.label, ""});
            }
        }
        if (!chart.series.empty()) {
            add_figure(
                "cell_size", draw(chart),
                "Too small a cell: triangles lie in many cells. Too large: many triangles share one (thesis §3.3).");
        }
        add_table(std::move(table));
    }

    void orders() {
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
            "All other cells use vertices and triangles renumbered once, at load, along a space-filling curve, for "
            "every "
            "method alike. Generated: face by face, row by row. Shuffled: at random.";
        add_table(std::move(table));
    }

    void settings() {
        const std::vector<const CellRecord*> cells = group(Group::settings);
        if (cells.empty()) return;
        add_heading("Further settings");
        for (const CellRecord* record : cells) {
            Table table;
            table.caption = "Settings, " + record->spec.scene.name();
            table.columns = {{"method"},       {"pairs decided by"}, {"update", true},
                             {"detect", true}, {"time (µs)", true},  {"pairs"}};
            for (const MethodResult& entry : record->measurement.methods) {
                if (is_copy(entry) || entry.step.empty()) continue;
                table.rows.push_back(
                    {{"`" + entry.label + "`", entry.narrow, time_text(median(in_us(entry.update_ns))),
                      time_text(median(in_us(entry.detect_ns))), time_text(median_time(entry)), pairs_text(entry)},
                     style_of(entry)});
            }
            table.note =
                "Rows whose pairs are decided by trocar's exact test are the comparison with one common narrow phase.";
            add_table(std::move(table));
        }
    }

    // ---- default, recommended, tuned ----

    /// Mean time of a step over the first or the second half of a row's steps, µs: periodic rebuilds count.
    static double half_mean(const MethodResult& entry, bool second) {
        const std::vector<double> times = step_times(entry);
        const std::size_t half = times.size() / 2;
        const std::size_t first = second ? half : 0;
        const std::size_t end = second ? times.size() : half;
        if (!entry.outcome.ok() || end == first) return not_known;
        double sum = 0.0;
        for (std::size_t i = first; i < end; ++i) sum += times[i];
        return sum / static_cast<double>(end - first);
    }

    void tuning() {
        const std::vector<const CellRecord*> cells = group(Group::tuning);
        if (cells.empty()) return;
        add_heading("Default, recommended, tuned");
        for (const CellRecord* record : cells) {
            Table table;
            table.caption = "Settings of every library, " + record->spec.scene.name();
            table.columns = {{"detector"},
                             {"library's default"},
                             {"time (µs)", true},
                             {"recommended"},
                             {"time (µs)", true},
                             {"tuned"},
                             {"time (µs)", true},
                             {"default ÷ tuned", true},
                             {"recommended ÷ tuned", true},
                             {"settings tried", true},
                             {"steps", true},
                             {"search (s)", true}};
            Table every;
            every.caption = "All settings tried, " + record->spec.scene.name();
            every.columns = {{"method"},
                             {"steps", true},
                             {"mean, first half (µs)", true},
                             {"mean, second half (µs)", true},
                             {"pairs"}};
            every.folded = true;
            for (const Search& search : searches(record->tissue_edge)) tune(*record, search, table, every);
            table.note =
                "Default: what the library's user gets who chooses nothing, as far as the adapter has it. Recommended: "
                "this project's setting, which the other tables use; reasons at the head of each file of baselines/. "
                "Tuned: the fastest of the settings tried, chosen by the mean of the first half of the steps among "
                "those "
                "with exact pairs (where there is none, †, among all), timed on the second half like the other "
                "two. The search is its settings, steps and seconds of update and detect.";
            add_table(std::move(table));
            add_table(std::move(every));
        }
    }

    void tune(const CellRecord& record, const Search& search, Table& table, Table& every) const {
        const auto& rows = record.measurement.methods;
        const MethodResult* best = nullptr;
        std::size_t tried = 0;
        std::size_t steps = 0;
        double seconds = 0.0;
        const auto better = [](const MethodResult& a, const MethodResult* b) {
            if (std::isnan(half_mean(a, false))) return false;
            if (b == nullptr || a.exact() != b->exact()) return b == nullptr || a.exact();
            return half_mean(a, false) < half_mean(*b, false);
        };
        bool own = false;
        for (const std::string& method : search.tried) {
            const auto entry =
                std::find_if(rows.begin(), rows.end(), [&method](const MethodResult& r) { return r.label == method; });
            if (entry == rows.end()) continue;
            ++tried;
            own = entry->own;
            steps += entry->step.size();
            for (const double time : step_times(*entry)) seconds += 1e-6 * time;
            if (better(*entry, best)) best = &*entry;
            every.rows.push_back(
                {{"`" + method + "`", fmt::format("{}", entry->step.size()), time_text(half_mean(*entry, false)),
                  time_text(half_mean(*entry, true)), pairs_text(*entry)},
                 style_of(*entry)});
        }
        if (best == nullptr) return;
        const auto cells_of = [&](const std::string& method, TableRow& line) {
            const MethodResult* entry = find_row(record, method);
            const double time = entry == nullptr ? not_known : half_mean(*entry, true);
            const std::size_t colon = method.find(':');
            line.cells.push_back(colon == std::string::npos ? "as recommended" : "`" + method.substr(colon + 1) + "`");
            line.cells.push_back(time_text(time) + (entry == nullptr || entry->exact() ? "" : " †"));
            return time;
        };
        TableRow line{{"`" + search.name + "`"}};
        line.style = own ? TableRow::Style::own : TableRow::Style::normal;
        const double by_default = cells_of(search.library_default, line);
        const double recommended = cells_of(search.name, line);
        line.cells[3] = "all defaults of the adapter";
        const double tuned = cells_of(best->label, line);
        line.cells.push_back(format_number(by_default / tuned));
        line.cells.push_back(format_number(recommended / tuned));
        line.cells.push_back(fmt::format("{}", tried));
        line.cells.push_back(fmt::format("{}", steps));
        line.cells.push_back(format_number(seconds));
        table.rows.push_back(std::move(line));
    }

    // ---- the thesis' Table 3.1 ----

    [[nodiscard]] std::string quotient(std::string_view above, std::string_view below, const std::string& label) const {
        return format_number(time(above, label) / time(below, label));
    }
    [[nodiscard]] std::string per_body(const std::string& label, bool work) const {
        const auto value = [&](std::string_view id, double count) {
            const MethodResult* found = row(id, label);
            if (found == nullptr || !found->outcome.ok()) return not_known;
            const double amount = work ? static_cast<double>(found->work.work()) : median_time(*found);
            return amount > 0.0 ? amount / count : not_known;
        };
        return format_number(value("bodies: 128 bodies", 128.0) / value("bodies: 8 bodies", 8.0));
    }

    void table_31() {
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
        line(
            "Broad phase, sub-object level", "pairwise / pairwise / non-pairwise",
            "triangle tests per true pair, where counted", [](const std::string&, const MethodResult& entry) {
                if (entry.work.triangle_tests == 0 || entry.pairs == 0) return std::string("n/a");
                return format_number(static_cast<double>(entry.work.triangle_tests) / static_cast<double>(entry.pairs));
            });
        line("", "", "box tests + cells visited per true pair, where counted",
             [](const std::string&, const MethodResult& entry) {
                 const std::int64_t looks = entry.work.box_tests + entry.work.cells_visited;
                 if (looks <= 1 || entry.pairs == 0) return std::string("n/a");
                 return format_number(static_cast<double>(looks) / static_cast<double>(entry.pairs));
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
             "shuffled numbering ÷ renumbered, 200k (1: no matter)",
             [this](const std::string& label, const MethodResult&) {
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

    void micro() {
        Table table;
        table.caption = "Single stages (Google Benchmark; wall time)";
        table.columns = {{"stage"}, {"ns per item", true}, {"items per call", true}};
        for (const CellRecord* record : group(Group::micro)) {
            for (const MicroResult& result : record->micro) {
                table.rows.push_back({{result.name, format_number(result.ns), fmt::format("{}", result.items)}});
            }
        }
        if (table.rows.empty()) return;
        add_heading("Single stages");
        table.note = "The thesis took 30 to 39 µs per triangle pair for its responses on the computers of 2005.";
        add_table(std::move(table));
    }

    void every_cell() {
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
                      format_number(memory_mb(entry)),
                      entry.allocations < 0 ? "n/a" : fmt::format("{}", entry.allocations),
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

    void rebuild() {
        add_heading("How to rebuild this");
        const bool quick = records_.front().spec.quick;
        document_.blocks.emplace_back(CodeBlock{fmt::format(
            "./run.sh bench detection{}            # measure, write build/reports/detection\n"
            "./run.sh bench report reports/detection    # the same report from records.jsonl, byte for byte",
            quick ? " --quick" : "")});
    }

    [[nodiscard]] std::string csv() const {
        std::string text =
            "cell,variant,tissue_triangles,instrument_triangles,tissues,instruments,order,bodies,true_pairs,method,"
            "outcome,exact,steps,update_us,detect_us,total_us,wall_p50_us,cold_us,ratio_embree,ratio_embree_low,"
            "ratio_embree_high,ratio_fcl,ratio_fcl_low,ratio_fcl_high,vertices_read,cells_visited,box_tests,"
            "triangle_tests,work_max,heap_bytes,resident_bytes,allocations_max,prepare_ms,missing,extra,differing_"
            "steps\n";
        for (const CellRecord& record : records_) {
            const SceneSpec& scene = record.spec.scene;
            const MethodResult* embree = find_row(record, embree_anchor);
            const MethodResult* fcl = find_row(record, fcl_anchor);
            for (const MethodResult& entry : record.measurement.methods) {
                const Ratio to_embree = embree == nullptr ? Ratio{} : ratio_of(*embree, entry);
                const Ratio to_fcl = fcl == nullptr ? Ratio{} : ratio_of(*fcl, entry);
                const bool many = record.spec.group == Group::bodies;
                text += fmt::format(
                    "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}"
                    ","
                    "{},{},{}\n",
                    csv_field(record.spec.id), many ? "bodies" : name_of(scene.variant),
                    many ? 0 : scene.tissue_triangles, many ? 0 : scene.instrument_triangles, many ? 0 : scene.tissues,
                    many ? 0 : scene.instruments, name_of(scene.order), record.spec.bodies,
                    record.measurement.true_pairs, csv_field(entry.label), name_of(entry.outcome.kind),
                    entry.exact() ? 1 : 0, entry.step.size(), format_exact(median(in_us(entry.update_ns))),
                    format_exact(median(in_us(entry.detect_ns))), format_exact(median_time(entry)),
                    format_exact(median(in_us(entry.wall_ns))), format_exact(median(in_us(entry.cold_ns))),
                    format_exact(to_embree.value), format_exact(to_embree.bounds.low),
                    format_exact(to_embree.bounds.high), format_exact(to_fcl.value), format_exact(to_fcl.bounds.low),
                    format_exact(to_fcl.bounds.high), entry.work.vertices_read, entry.work.cells_visited,
                    entry.work.box_tests, entry.work.triangle_tests, entry.work_max, entry.heap_bytes,
                    entry.resident_bytes, entry.allocations, format_exact(1e-6 * entry.prepare_ns), entry.missing,
                    entry.extra, entry.differing_steps);
            }
        }
        return text;
    }

    struct Floor {
        std::string cell;
        std::string method;
        Ratio ratio;
    };

    const std::vector<CellRecord>& records_;
    Document document_;
    BenchReport report_;
    std::vector<Floor> floors_;
    double floor_ = 0.0;  ///< |log ratio| that two runs of the same method stay below in nine of ten cells
    std::vector<std::string> marked_;
};

}  // namespace

BenchReport make_report(const std::vector<CellRecord>& records) { return Writer(records).write(); }

BenchReport write_report(const std::filesystem::path& directory) {
    BenchReport report = make_report(read_cells(directory / "records.jsonl"));
    std::filesystem::create_directories(directory / "charts");
    for (const auto& entry : std::filesystem::directory_iterator(directory / "charts")) {
        if (!report.files.contains("charts/" + entry.path().filename().string())) {
            std::filesystem::remove(entry.path());
        }
    }
    for (const auto& [name, content] : report.files) write_whole(directory / name, content);
    return report;
}

}  // namespace trocar::bench
