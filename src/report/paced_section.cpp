// The haptic table of loops that a clock releases every millisecond, beside an empty loop at the same time: what a
// deadline means on this machine.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "report/sections.hpp"

namespace trocar {
namespace {

/// One figure of several processes of the same run.
Estimate figure_of(const std::vector<const Record*>& runs, Metric metric) {
    std::vector<double> values;
    values.reserve(runs.size());
    for (const Record* run : runs) values.push_back(summary_of(*run, metric));
    return across_processes(values);
}

bool all_ok(const std::vector<const Record*>& runs) {
    return std::all_of(runs.begin(), runs.end(), [](const Record* run) { return run->outcome.ok(); });
}

Table paced_table(const Draft& draft) {
    using Processes = std::vector<const Record*>;
    std::map<std::pair<std::string, std::string>, Processes> runs;
    // Update and detect of the reference, on the ticks of the same scene, response and stepper.
    std::map<std::array<std::string, 3>, Processes> reference;
    for (const Record& record : draft.records) {
        const RunSpec& spec = record.spec;
        if (spec.mode != "paced" || record.outcome.kind == OutcomeKind::absent ||
            record.outcome.kind == OutcomeKind::unsupported) {
            continue;
        }
        runs[{spec.scene, code(spec.detector + " + " + spec.response) + by_stepper(spec.stepper)}].push_back(&record);
        if (spec.detector == draft.reference && record.outcome.ok()) {
            reference[{spec.scene, spec.response, spec.stepper}].push_back(&record);
        }
    }
    Table table;
    if (runs.empty()) return table;
    table.caption = "Paced loop: one tick released per millisecond, timed from its scheduled release";
    table.columns = {{"scene", false},
                     {"detector + response", false},
                     {"n per process (ticks)", true, Metric::timed_ticks},
                     {"sub-steps per tick", true, Metric::substeps},
                     {"p50 (µs)", true, Metric::paced_median_ns},
                     {"p99 (µs)", true, Metric::paced_p99_ns},
                     {"p99.9 (µs)", true, Metric::paced_p999_ns},
                     {"max (µs)", true, Metric::paced_max_ns},
                     {"deadline misses", true, Metric::paced_misses},
                     {"longest burst (ticks)", true, Metric::paced_burst},
                     {"empty loop: p50 / p99 / max (µs)", true, Metric::empty_median_ns},
                     {"empty loop: misses", true, Metric::empty_misses}};
    if (!reference.empty()) {
        table.columns.push_back({"tick / update and detect of " + code(draft.reference) + ", p50", true});
    }
    for (const char* stage : stage_names) table.columns.push_back({std::string(stage) + ", p50 / p99 (µs)", true});
    for (const auto& entry : runs) {
        const auto& [key, list] = entry;
        const Processes& processes = list;
        std::vector<std::string> cells{key.first, key.second};
        if (!all_ok(processes)) {
            for (const Record* run : processes) {
                if (run->outcome.ok()) continue;
                cells.push_back(outcome_text(run->outcome));
                break;
            }
            cells.resize(table.columns.size());
            table.rows.push_back({.cells = std::move(cells), .style = TableRow::Style::failed});
            continue;
        }
        const auto tail = [&processes](Metric metric) {
            const Estimate estimate = figure_of(processes, metric);
            return std::isnan(estimate.value) ? std::string("n too small") : estimate_text(estimate, us);
        };
        const auto worst = [&processes](Metric metric) {
            double most = not_known;
            for (const Record* run : processes) most = std::fmax(most, summary_of(*run, metric));
            return most;
        };
        const auto sum = [&processes](Metric metric) {
            double all = 0.0;
            for (const Record* run : processes) all += summary_of(*run, metric);
            return all;
        };
        const double ticks = sum(Metric::timed_ticks);
        cells.insert(
            cells.end(),
            {count_text(figure_of(processes, Metric::timed_ticks).value),
             count_text(summary_of(*processes.front(), Metric::substeps)),
             estimate_text(figure_of(processes, Metric::paced_median_ns), us), tail(Metric::paced_p99_ns),
             tail(Metric::paced_p999_ns), scaled(worst(Metric::paced_max_ns), us),
             count_text(sum(Metric::paced_misses)) + " of " + count_text(ticks), count_text(worst(Metric::paced_burst)),
             scaled(figure_of(processes, Metric::empty_median_ns).value, us) + " / " +
                 scaled(figure_of(processes, Metric::empty_p99_ns).value, us) + " / " +
                 scaled(worst(Metric::empty_max_ns), us),
             count_text(sum(Metric::empty_misses)) + " of " + count_text(ticks)});
        if (!reference.empty()) {
            const RunSpec& spec = processes.front()->spec;
            const auto found = reference.find({spec.scene, spec.response, spec.stepper});
            double detection = not_known;
            if (found != reference.end()) {
                detection = figure_of(found->second, Metric::update_median_ns).value +
                            figure_of(found->second, Metric::detect_median_ns).value;
            }
            cells.push_back(scaled(figure_of(processes, Metric::total_median_ns).value / detection));
        }
        for (std::size_t stage = 0; stage < stage_count; ++stage) {
            cells.push_back(scaled(figure_of(processes, stage_median(stage)).value, us) + " / " +
                            scaled(figure_of(processes, stage_p99(stage)).value, us));
        }
        table.rows.push_back({.cells = std::move(cells)});
    }
    table.note =
        "A tick that ends after the next one's release is a miss, and the next one starts late: its time counts from "
        "its own release, so that no lateness is left out. The empty loop of the same length runs at the same time in "
        "a thread of its own and is not prolonged where the other falls behind: what it shows is the machine's beside "
        "that work. A ratio holds a whole tick, without waiting, against what the reference takes to update and "
        "detect on the same scene with the same response and stepper. n too small: p99 needs 1000 ticks, p99.9 a "
        "hundred thousand.";
    return table;
}

}  // namespace

void add_paced(Draft& draft) {
    Table table = paced_table(draft);
    if (table.rows.empty()) return;
    draft.heading(2, "Paced loop");
    draft.add(std::move(table));
}

Table paced_page(const Draft& draft) {
    const Table all = paced_table(draft);
    Table table{.caption = all.caption, .columns = {}, .rows = {}, .note = {}};
    std::vector<std::size_t> kept;
    for (std::size_t c = 0; c < all.columns.size(); ++c) {
        const std::string& head = all.columns[c].header;
        const bool is_reported = head == "scene" || head == "detector + response" || head == "p50 (µs)" ||
                                 head == "p99 (µs)" || head == "deadline misses" || head == "empty loop: misses" ||
                                 head.starts_with("tick / ");
        if (!is_reported) continue;
        kept.push_back(c);
        table.columns.push_back(all.columns[c]);
    }
    for (const TableRow& row : all.rows) {
        TableRow short_row{.cells = {}, .style = row.style};
        for (const std::size_t c : kept) short_row.cells.push_back(row.cells[c]);
        table.rows.push_back(std::move(short_row));
    }
    return table;
}

}  // namespace trocar
