#include "report/sections.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "report/chart.hpp"
#include "report/metric_table.hpp"

namespace trocar {
namespace {

std::string work_text(const RunFigures& run) {
    const double work = run[Metric::work_max] / run[Metric::work_median];
    return scaled(std::isfinite(work) ? work : not_known);
}

MetricTable latency_table(const std::string& mode, const std::string& caption) {
    MetricTable table{
        .caption = caption,
        .mode = mode,
        .columns = {count_column("n per process (ticks)", Metric::timed_ticks),
                    count_column("sub-steps per tick", Metric::substeps),
                    time_column("p50 (µs)", Metric::total_median_ns), time_column("p90 (µs)", Metric::total_p90_ns),
                    time_column("p99 (µs)", Metric::total_p99_ns, Processes::interval, too_few),
                    time_column("max (µs)", Metric::total_max_ns, Processes::every),
                    time_column("first contact (µs)", Metric::total_cold_ns),
                    misses_column("misses at 1 ms", Metric::deadline_misses),
                    count_column("longest burst (ticks)", Metric::longest_burst, Processes::every),
                    text_column("work, max / median", Metric::work_max, work_text),
                    value_column("allocations per tick", Metric::allocations_median)}};
    if (mode == "replay") table.columns.erase(table.columns.begin() + 1);  // sub-steps are of tissue that moves
    return table;
}

}  // namespace

void add_latency(Draft& draft) {
    if (draft.results.methods("replay").empty() && draft.results.methods("closed_loop").empty()) return;
    const bool paced = !draft.results.methods("paced").empty();
    draft.heading(2, "Haptic table");
    draft.paragraph(
        "Latency of single ticks in the back-to-back loop. " + draft.interval_note("") +
        " p99 needs 1000 ticks, p99.9 ten thousand. " +
        (paced ? "Misses in these tables are ticks that took longer than 1 ms; the loop that the clock releases "
                 "follows them."
               : "The paced 1 kHz loop is not part of this study: misses here are ticks that took longer than 1 ms.") +
        " First contact: the first tick with a pair, warm-up or not. \"max\" is the machine's too: judge a method by "
        "its work column.");
    MetricTable replay = latency_table("replay", "Detectors (update + detect)");
    replay.folded = false;
    draft.add(table_of(draft, replay));
    draft.add(table_of(draft, latency_table("closed_loop", "Whole ticks in the closed loop")));
}

void add_stages(Draft& draft) {
    const auto stages_of = [](const ResultSet& results) {
        std::vector<double> means;
        for (std::size_t stage = 0; stage < stage_count; ++stage) {
            means.push_back(us * value_over(Over::mean, results.values(Processes::median, stage_median(stage))));
        }
        return means;
    };
    std::vector<MetricColumn> columns;
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        columns.push_back(time_column(stage_names.at(stage), stage_median(stage), Processes::median));
        columns.back().over = Over::mean;
    }
    std::vector<MetricRow> rows;
    for (const std::string mode : {"closed_loop", "replay"}) {
        for (const Method& method : draft.results.methods(mode)) {
            const ResultSet results = possible(draft.results, method);
            const std::vector<double> stages = stages_of(results);
            if (!(known_sum(stages) > 0.0)) continue;
            rows.push_back({.names = {code(method.label()) + (mode == "replay" ? " (replay)" : ""),
                                      std::to_string(results.count())},
                            .results = results});
        }
    }
    if (rows.empty()) return;
    columns.push_back({.header = "sum (µs)", .text = [&](const ResultSet& results) {
                           return scaled(known_sum(stages_of(results))) +
                                  (results.failed_runs() > 0 ? " (some scenes failed)" : "");
                       }});
    draft.heading(2, "Stage split");
    draft.add(table_of(
        {.caption = "Median time per stage, mean over the scenes (µs)",
         .columns = {{"detector + response (contact generator)", false}, {"scenes", true}},
         .note =
             "n/a: the stage does not exist in that kind of run. move and derive are the same code for every method; "
             "derive runs even where native contacts are used, so that both can be judged. A stage that exists only in "
             "some scenes (advance needs tissue) is averaged over those. Rows of unlike numbers of scenes do not "
             "compare."},
        columns, rows));
}

}  // namespace trocar
