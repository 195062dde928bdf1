// Targets over time: the share of pairs of a scene and an error limit that a method meets within a time per tick. It is
// the empirical distribution of run times of COCO (Hansen et al., Optimization Methods and Software 36, 2021).
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "report/page_one.hpp"
#include "report/verdict_order.hpp"

namespace trocar {
namespace {

struct ErrorLimits {
    std::array<double, 6> limits;
    const char* text;
};
constexpr ErrorLimits depth_limits{{3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5},
                                   "residual penetration, max, of 3, 1, 0.3, 0.1, 0.03 and 0.01 mm"};
/// Wrong pairs are counted against true ones.
constexpr ErrorLimits pair_limits{{0.3, 0.1, 0.01, 1e-3, 1e-4, 0.0},
                                  "share of wrong pairs of 30, 10, 1, 0.1, 0.01 and 0 %"};

double share_of_wrong_pairs(const SceneResult& result) {
    return (result.first(Metric::false_negatives) + result.first(Metric::false_positives)) /
           std::max(1.0, result.first(Metric::true_pairs));
}

/// Times in µs, one per target met, ascending.
std::vector<double> times_of_targets(const std::vector<const SceneResult*>& results, bool depth, Metric time_metric) {
    std::vector<double> times;
    for (const SceneResult* result : results) {
        if (!result->ok()) continue;
        const double time = result->of(time_metric).value;
        const double error = depth ? result->first(Metric::residual_penetration_max_m) : share_of_wrong_pairs(*result);
        if (std::isnan(time)) continue;
        for (const double limit : (depth ? depth_limits : pair_limits).limits) {
            if (error <= limit) times.push_back(time * us);
        }
    }
    std::sort(times.begin(), times.end());
    return times;
}

struct NamedResults {
    std::string name;
    std::vector<const SceneResult*> results;
};

/// The rows of page 1.
std::vector<NamedResults> shown_rows(const Draft& draft, const Verdict& overall) {
    std::vector<NamedResults> shown;
    if (overall.mode == "replay") {
        for (const VerdictRow& row : overall.rows) {
            if (!row.control && shown.size() < page_one_rows)
                shown.push_back({row.method.detector, row.planned.results});
        }
        return shown;
    }
    const std::vector<ResponseRow> rows = response_rows(draft);
    for (const std::size_t i : rows_that_matter(rows)) {
        shown.push_back({rows[i].method.response + by_stepper(rows[i].method.stepper), rows[i].judged.results});
    }
    return shown;
}

}  // namespace

LineChart targets_over_time(const Draft& draft, const Verdict& overall) {
    const bool depth = overall.mode != "replay";
    const std::size_t scenes =
        depth ? judged_scenes(draft.results, draft.results.scenes("closed_loop"), true).size() : overall.scenes.size();
    const auto targets = static_cast<double>(scenes * depth_limits.limits.size());
    const std::vector<NamedResults> rows = shown_rows(draft, overall);
    const Metric tail = depth ? draft.results.tail_metric() : Metric::total_median_ns;
    LineChart chart{.x_title = std::string("tick ") + (depth ? tail_name(tail) : "p50") + " (µs)",
                    .y_title = "share of targets met",
                    .steps = true,
                    .log_x = true};
    double shortest = not_known;
    double longest = not_known;
    std::vector<std::vector<double>> times;
    times.reserve(rows.size());
    for (const NamedResults& row : rows) {
        times.push_back(times_of_targets(row.results, depth, tail));
        if (times.back().empty()) continue;
        shortest = std::fmin(shortest, times.back().front());
        longest = std::fmax(longest, times.back().back());
    }
    if (std::isnan(shortest)) return chart;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const int style = static_cast<int>(i);
        LineChart::Line line{.name = rows[i].name, .colour = style, .dash = style, .points = {{0.8 * shortest, 0.0}}};
        for (std::size_t met = 0; met < times[i].size(); ++met) {
            line.points.emplace_back(times[i][met], static_cast<double>(met + 1) / targets);
        }
        line.points.emplace_back(1.25 * longest, static_cast<double>(times[i].size()) / targets);
        chart.lines.push_back(std::move(line));
    }
    return chart;
}

void add_targets_over_time(Draft& draft, const Verdict& overall) {
    const LineChart chart = targets_over_time(draft, overall);
    if (chart.lines.empty()) return;
    const bool depth = overall.mode != "replay";
    draft.figure("targets", chart,
                 std::string("Share of the targets that the rows of page 1 meet within a time per tick. A target is a "
                             "scene and a limit; the limits are a ") +
                     (depth ? depth_limits.text : pair_limits.text) +
                     ". A run that failed meets none. Read upright: what is met within 1 ms; read across: what more "
                     "time buys.");
}

}  // namespace trocar
