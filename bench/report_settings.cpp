// Where the numbers come from: machine, libraries, and every library in default, recommended and tuned settings.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "measure/statistics.hpp"
#include "report_writer.hpp"

namespace trocar::bench {

void Writer::origin() {
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
        "Each cell (one scene, all methods) is one process. Methods take turns in random order, 8 blocks of "
        "consecutive steps each; a step before every block warms the caches up and is kept as the cold time. A step "
        "is `update` and `detect`, from a double-precision frame that was just written to the sorted list of all "
        "pairs. Stage times are CPU time of the whole process, all threads, so that other programs on the machine do "
        "not count; p99 is wall time. Slow methods take fewer steps (column n); ratios use the steps that both sides "
        "have. The first step of each block is held against the exact oracle, every other step against a method that "
        "agreed with it.");
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

void Writer::fairness() {
    add_heading("Who took part");
    Table table;
    table.caption = "Methods";
    table.columns = {{"method"}, {"library"}, {"pairs decided by"}, {"claims exact"}, {"pair sets over all cells"}};
    std::vector<const CellRecord*> all;
    for (const CellRecord& record : records_) {
        if (record.spec.group != Group::tuning) all.push_back(&record);  // has a table of its own
    }
    for (const std::string& label : labels(all, [](const MethodResult& entry) { return !is_copy(entry); })) {
        const MethodResult* any = nullptr;
        std::int64_t false_negatives = 0;
        std::int64_t false_positives = 0;
        std::int64_t truth = 0;
        std::int64_t differing = 0;
        std::int64_t steps = 0;
        std::vector<std::string> failures;
        for (const CellRecord& record : records_) {
            for (const MethodResult& entry : record.measurement.methods) {
                if (entry.label != label) continue;
                // A method that ended its process early has a row without a library.
                if (any == nullptr || any->library.empty()) any = &entry;
                false_negatives += entry.false_negatives;
                false_positives += entry.false_positives;
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
                                                     differing, steps, false_negatives, false_positives, truth);
        if (!failures.empty()) {
            verdict += fmt::format("; failed in {} cells, first in {}", failures.size(), failures.front());
        }
        table.rows.push_back({{"`" + label + "`", any->library, any->narrow, any->claims_exact ? "yes" : "no", verdict},
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

void Writer::settings() {
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

double Writer::half_mean(const MethodResult& entry, bool second) {
    const std::vector<double> times = step_times(entry);
    const std::size_t half = times.size() / 2;
    const std::size_t first = second ? half : 0;
    const std::size_t end = second ? times.size() : half;
    if (!entry.outcome.ok() || end == first) return not_known;
    double sum = 0.0;
    for (std::size_t i = first; i < end; ++i) sum += times[i];
    return sum / static_cast<double>(end - first);
}

void Writer::tuning() {
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
        every.columns = {
            {"method"}, {"steps", true}, {"mean, first half (µs)", true}, {"mean, second half (µs)", true}, {"pairs"}};
        every.folded = true;
        for (const Search& search : searches(record->tissue_edge)) tune(*record, search, table, every);
        table.note =
            "Default: what the library's user gets who chooses nothing, as far as the adapter has it. Recommended: "
            "this project's setting, which the other tables use; reasons at the head of each file of baselines/. "
            "Tuned: the fastest of the settings tried, chosen by the mean of the first half of the steps among those "
            "with exact pairs (where there is none, †, among all), timed on the second half like the other two. The "
            "search is its settings, steps and seconds of update and detect.";
        add_table(std::move(table));
        add_table(std::move(every));
    }
}

void Writer::tune(const CellRecord& record, const Search& search, Table& table, Table& every) const {
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

}  // namespace trocar::bench
