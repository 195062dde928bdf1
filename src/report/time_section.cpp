#include "report/sections.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "measure/statistics.hpp"
#include "report/chart.hpp"
#include "report/metric_table.hpp"

namespace trocar {
namespace {

MetricTable latency_table(const std::string& mode, const std::string& caption) {
    constexpr auto interval = Processes::interval;
    MetricTable table{.caption = caption, .mode = mode, .columns = {}};
    table.columns = {{.header = "n per process (ticks)", .metric = Metric::timed_ticks, .count = true}};
    if (mode == "closed_loop")
        table.columns.push_back({.header = "sub-steps per tick", .metric = Metric::substeps, .count = true});
    const std::vector<MetricColumn> times{
        {.header = "p50 (µs)", .metric = Metric::total_median_ns, .processes = interval, .scale = us},
        {.header = "p90 (µs)", .metric = Metric::total_p90_ns, .processes = interval, .scale = us},
        {.header = "p99 (µs)",
         .metric = Metric::total_p99_ns,
         .processes = interval,
         .scale = us,
         .unknown = "n too small"},
        {.header = "max (µs)", .metric = Metric::total_max_ns, .processes = Processes::highest, .scale = us},
        {.header = "first contact (µs)", .metric = Metric::total_cold_ns, .processes = interval, .scale = us},
        misses_column("misses at 1 ms", Metric::deadline_misses),
        {.header = "longest burst (ticks)",
         .metric = Metric::longest_burst,
         .processes = Processes::highest,
         .count = true},
        work_ratio_column("work, max / median"),
        {.header = "allocations per tick", .metric = Metric::allocations_median}};
    table.columns.insert(table.columns.end(), times.begin(), times.end());
    return table;
}

}  // namespace

void add_latency(Draft& draft) {
    if (draft.results.methods("replay").empty() && draft.results.methods("closed_loop").empty()) return;
    const bool paced = std::any_of(draft.records.begin(), draft.records.end(),
                                   [](const Record& record) { return record.spec.mode == "paced"; });
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
    Table table;
    table.caption = "Median time per stage, mean over the scenes (µs)";
    table.columns = {{"detector + response (contact generator)", false}, {"scenes", true}};
    BarChart chart;
    chart.x_title = "median time per stage, mean over the scenes (µs)";
    for (const char* name : stage_names) {
        table.columns.push_back({name, true});
        chart.parts.emplace_back(name);
    }
    table.columns.push_back({"sum (µs)", true});
    for (const std::string mode : {"closed_loop", "replay"}) {
        for (const Method& method : draft.results.methods(mode)) {
            std::array<std::vector<double>, stage_count> values;
            int scenes = 0;
            bool failed = false;
            for (const std::string& scene : draft.results.scenes(mode)) {
                const SceneResult* result = draft.results.find(method, scene);
                if (result == nullptr || result->not_applicable()) continue;
                failed = failed || !result->ok();
                ++scenes;
                for (std::size_t s = 0; s < stage_count; ++s) {
                    std::vector<double> by_process;
                    for (const RunFigures& run : result->runs) by_process.push_back(run[stage_median(s)]);
                    const double value = across_processes(by_process).value;
                    if (!std::isnan(value)) values.at(s).push_back(value * us);
                }
            }
            BarChart::Bar bar{.name = method.label(), .parts = {}};
            std::vector<std::string> cells{code(method.label()) + (mode == "replay" ? " (replay)" : ""),
                                           std::to_string(scenes)};
            double sum = 0.0;
            for (const auto& stage : values) {
                const double mean = stage.empty() ? not_known
                                                  : std::accumulate(stage.begin(), stage.end(), 0.0) /
                                                        static_cast<double>(stage.size());
                bar.parts.push_back(mean);
                sum += std::isnan(mean) ? 0.0 : mean;
                cells.push_back(format_number(mean));
            }
            if (sum == 0.0) continue;
            cells.push_back(format_number(sum) + (failed ? " (some scenes failed)" : ""));
            table.rows.push_back({.cells = std::move(cells)});
            if (mode == draft.mode) chart.bars.push_back(std::move(bar));
        }
    }
    if (table.rows.empty()) return;
    draft.heading(2, "Stage split");
    table.note =
        "n/a: the stage does not exist in that kind of run. move and derive are the same code for every method; "
        "derive runs even where native contacts are used, so that both can be judged. A stage that exists only in "
        "some scenes (advance needs tissue) is averaged over those. Rows of unlike numbers of scenes do not compare.";
    if (!chart.bars.empty()) {
        draft.figure("stages", draw(chart),
                     "Where the time of a tick goes; numbers in the table below, which says whose bars are of fewer "
                     "scenes.");
    }
    draft.add(std::move(table));
}

namespace {

/// Detectors that were planned on all scenes, those with the larger share of scenes within twice the fastest of them
/// first, then by name; a failed run counts as infinitely slow.
std::vector<std::string> profile_order(const Draft& draft, const std::vector<Method>& detectors,
                                       const std::set<std::string>& scenes) {
    std::map<std::string, double> within;
    for (const std::string& scene : scenes) {
        std::map<std::string, double> times;
        for (const Method& detector : detectors) {
            const SceneResult* result = draft.results.find(detector, scene);
            if (result == nullptr) continue;
            times[detector.detector] =
                result->ok() ? result->of(Metric::total_median_ns).value : std::numeric_limits<double>::infinity();
        }
        double fastest = std::numeric_limits<double>::infinity();
        for (const auto& [name, time] : times) fastest = std::min(fastest, time);
        for (const auto& [name, time] : times) within[name] += time <= 2.0 * fastest && std::isfinite(time) ? 1.0 : 0.0;
    }
    std::vector<std::string> order;
    order.reserve(within.size());
    for (const auto& [name, share] : within) order.push_back(name);
    std::stable_sort(order.begin(), order.end(),
                     [&within](const std::string& a, const std::string& b) { return within[a] > within[b]; });
    return order;
}

/// Does the order among the others change when one is left out?
Table profile_robustness(const Draft& draft, const std::vector<Method>& detectors,
                         const std::set<std::string>& scenes) {
    Table table;
    table.caption = "Order by the share of scenes within twice the fastest, one detector left out at a time";
    table.columns = {{"left out", false}, {"order of the rest", false}, {"as with it", false}};
    const std::vector<std::string> all = profile_order(draft, detectors, scenes);
    if (all.size() < 3) return table;
    const auto row = [&table](const std::string& out, const std::vector<std::string>& order, const std::string& same) {
        std::vector<std::string> names;
        names.reserve(order.size());
        for (const std::string& name : order) names.push_back(code(name));
        table.rows.push_back({.cells = {out, joined(names), same}});
    };
    row("none", all, "");
    for (const std::string& out : all) {
        std::vector<Method> rest;
        std::copy_if(detectors.begin(), detectors.end(), std::back_inserter(rest),
                     [&out](const Method& one) { return one.detector != out; });
        std::vector<std::string> expected = all;
        expected.erase(std::find(expected.begin(), expected.end(), out));
        const std::vector<std::string> order = profile_order(draft, rest, scenes);
        row(code(out), order, yes_no(order == expected));
    }
    return table;
}

}  // namespace

void add_work_profile(Draft& draft) {
    const std::vector<Method> detectors = draft.results.methods("replay");
    const std::vector<std::string> scenes = draft.results.scenes("replay");
    if (detectors.size() < 2) return;
    LineChart chart{.x_title = "factor over the fastest detector of the scene",
                    .y_title = "share of scenes",
                    .lines = {},
                    .steps = true,
                    .log_x = true};
    std::map<std::string, double> best;
    std::set<std::string> judged;
    for (const std::string& scene : scenes) {
        double fastest = std::numeric_limits<double>::infinity();
        for (const Method& detector : detectors) {
            const SceneResult* result = draft.results.find(detector, scene);
            if (result == nullptr || !result->ok()) continue;
            fastest = std::min(fastest, result->of(Metric::total_median_ns).value);
        }
        if (!std::isfinite(fastest)) continue;
        best[scene] = fastest;
        judged.insert(scene);
    }
    if (judged.empty()) return;
    double widest = 1.0;
    std::vector<std::vector<double>> factors;
    for (const Method& detector : detectors) {
        std::vector<double> list;
        for (const std::string& scene : judged) {
            const SceneResult* result = draft.results.find(detector, scene);
            if (result == nullptr || !result->ok()) continue;
            list.push_back(result->of(Metric::total_median_ns).value / best.at(scene));
            widest = std::max(widest, list.back());
        }
        std::sort(list.begin(), list.end());
        factors.push_back(std::move(list));
    }
    for (std::size_t d = 0; d < detectors.size(); ++d) {
        // A detector that was not planned on every scene has no share of them.
        if (std::any_of(judged.begin(), judged.end(),
                        [&](const std::string& scene) { return draft.results.find(detectors[d], scene) == nullptr; })) {
            continue;
        }
        LineChart::Line line{.name = detectors[d].detector,
                             .colour = static_cast<int>(d),
                             .dash = static_cast<int>(d),
                             .points = {{1.0, 0.0}}};
        double share = 0.0;
        for (const double factor : factors[d]) {
            share += 1.0 / static_cast<double>(judged.size());
            line.points.emplace_back(factor, share);
        }
        line.points.emplace_back(widest * 1.2, share);
        chart.lines.push_back(std::move(line));
    }
    draft.heading(2, "Performance profile");
    draft.figure(
        "profile", chart,
        "Dolan–Moré profile of the detectors: share of the replayed scenes on which a detector's median tick is "
        "within a factor of the fastest; a failed run counts as infinitely slow. The order among detectors that "
        "are not the best can change when the best is removed.");
    std::vector<Method> everywhere;
    std::copy_if(detectors.begin(), detectors.end(), std::back_inserter(everywhere), [&](const Method& detector) {
        return std::all_of(judged.begin(), judged.end(),
                           [&](const std::string& scene) { return draft.results.find(detector, scene) != nullptr; });
    });
    draft.add(profile_robustness(draft, everywhere, judged));
}

}  // namespace trocar
