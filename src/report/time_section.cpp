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
        " p99 needs 1000 ticks, p99.9 a hundred thousand: a long study. " +
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
    BarChart chart{.x_title = "median time per stage, mean over the scenes (µs)"};
    const auto stages_of = [](const ResultSet& results) {
        std::vector<double> means;
        for (std::size_t stage = 0; stage < stage_count; ++stage) {
            means.push_back(us * value_over(Over::mean, results.values(Processes::median, stage_median(stage))));
        }
        return means;
    };
    std::vector<MetricColumn> columns;
    for (std::size_t stage = 0; stage < stage_count; ++stage) {
        chart.parts.emplace_back(stage_names.at(stage));
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
            if (mode == draft.mode) chart.bars.push_back({.name = method.label(), .parts = stages});
        }
    }
    if (rows.empty()) return;
    columns.push_back({.header = "sum (µs)", .text = [&](const ResultSet& results) {
                           return scaled(known_sum(stages_of(results))) +
                                  (results.failed_runs() > 0 ? " (some scenes failed)" : "");
                       }});
    draft.heading(2, "Stage split");
    if (!chart.bars.empty()) {
        draft.drawing("stages", draw(chart),
                      "Where the time of a tick goes; numbers in the table below, which says whose bars are of fewer "
                      "scenes.");
    }
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

namespace {

/// Median tick, ns, by detector and replayed scene; a failed run counts as infinitely slow.
using Times = std::map<std::string, std::map<std::string, double>>;

Times times_of(const Draft& draft) {
    Times times;
    for (const Method& detector : draft.results.methods("replay")) {
        for (const auto& [scene, result] : draft.results.of(detector)) {
            times[detector.detector][scene] =
                result.ok() ? result.of(Metric::total_median_ns).value : std::numeric_limits<double>::infinity();
        }
    }
    return times;
}

/// By scene that a detector answered.
std::map<std::string, double> fastest_of(const Times& times) {
    std::map<std::string, double> fastest;
    for (const auto& [detector, by_scene] : times) {
        for (const auto& [scene, time] : by_scene) {
            if (!std::isfinite(time)) continue;
            double& least = fastest.try_emplace(scene, time).first->second;
            least = std::min(least, time);
        }
    }
    return fastest;
}

/// Those with the larger share of scenes within twice the fastest of them first, then by name.
std::vector<std::string> profile_order(const Times& times) {
    const std::map<std::string, double> fastest = fastest_of(times);
    std::map<std::string, std::ptrdiff_t> within;
    std::vector<std::string> order;
    for (const auto& [detector, by_scene] : times) {
        within[detector] = std::count_if(by_scene.begin(), by_scene.end(), [&fastest](const auto& one) {
            return std::isfinite(one.second) && one.second <= 2.0 * fastest.at(one.first);
        });
        order.push_back(detector);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&within](const std::string& a, const std::string& b) { return within[a] > within[b]; });
    return order;
}

/// Does the order among the others change when one is left out?
Table profile_robustness(const Times& times) {
    Table table;
    table.caption = "Order by the share of scenes within twice the fastest, one detector left out at a time";
    table.columns = {{"left out", false}, {"order of the rest", false}, {"as with it", false}};
    const std::vector<std::string> all = profile_order(times);
    if (all.size() < 3) return table;
    table.rows.push_back({.cells = {"none", joined_code(all), ""}});
    for (const std::string& out : all) {
        Times rest = times;
        rest.erase(out);
        std::vector<std::string> expected = all;
        std::erase(expected, out);
        const std::vector<std::string> order = profile_order(rest);
        table.rows.push_back({.cells = {code(out), joined_code(order), yes_no(order == expected)}});
    }
    return table;
}

}  // namespace

void add_work_profile(Draft& draft) {
    Times times = times_of(draft);
    const std::map<std::string, double> best = fastest_of(times);
    if (times.size() < 2 || best.empty()) return;
    LineChart chart{.x_title = "factor over the fastest detector of the scene",
                    .y_title = "share of scenes",
                    .steps = true,
                    .log_x = true};
    std::vector<std::vector<double>> factors;
    double widest = 1.0;
    for (const auto& [detector, by_scene] : times) {
        factors.emplace_back();
        for (const auto& [scene, time] : by_scene) {
            if (std::isfinite(time)) factors.back().push_back(time / best.at(scene));
        }
        std::sort(factors.back().begin(), factors.back().end());
        if (!factors.back().empty()) widest = std::max(widest, factors.back().back());
    }
    // A detector that was not planned on every scene has no share of them.
    const auto has_gap = [&best](const auto& detector) {
        return std::any_of(best.begin(), best.end(),
                           [&detector](const auto& scene) { return !detector.second.contains(scene.first); });
    };
    int number = 0;
    for (const auto& detector : times) {
        const int style = number++;
        if (has_gap(detector)) continue;
        LineChart::Line line{.name = detector.first, .colour = style, .dash = style, .points = {{1.0, 0.0}}};
        double share = 0.0;
        for (const double factor : factors[static_cast<std::size_t>(style)]) {
            share += 1.0 / static_cast<double>(best.size());
            line.points.emplace_back(factor, share);
        }
        line.points.emplace_back(widest * 1.2, share);
        chart.lines.push_back(std::move(line));
    }
    std::erase_if(times, has_gap);
    draft.heading(2, "Performance profile");
    draft.figure(
        "profile", chart,
        "Dolan–Moré profile of the detectors: share of the replayed scenes on which a detector's median tick is "
        "within a factor of the fastest; a failed run counts as infinitely slow. The order among detectors that "
        "are not the best can change when the best is removed.");
    draft.add(profile_robustness(times));
}

}  // namespace trocar
