// Picture A of page 1: what accuracy costs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "report/page_one.hpp"

namespace trocar {

const char* tail_name(Metric tail) { return tail == Metric::total_p99_ns ? "p99" : "p90"; }

ScatterChart depth_against_time(const std::vector<ResponseRow>& rows, Metric tail) {
    double shortest = not_known;
    for (const ResponseRow& row : rows) {
        if (!std::isnan(row.slowest_tick) && !(row.slowest_tick >= shortest)) shortest = row.slowest_tick;
    }
    ScatterChart chart;
    std::map<std::string, std::size_t> series;
    for (const ResponseRow& row : rows) {
        const bool failed = row.failed_runs > 0;
        if (row.not_run > 0 || (!failed && (std::isnan(row.residual_max()) || std::isnan(row.slowest_tick)))) continue;
        // A row without a time (it failed everywhere, or too early) stands at the beginning of the rail.
        const double time = std::isnan(row.slowest_tick) ? shortest : row.slowest_tick;
        if (std::isnan(time)) continue;
        const auto [place, is_new] = series.emplace(row.response(), chart.series.size());
        if (is_new) {
            const int number = static_cast<int>(chart.series.size());
            chart.series.push_back({.name = row.response(), .style = mark_style(number)});
        }
        const Method& who = row.who.front();
        const std::size_t colon = who.response.find(':');
        std::string label =
            colon == std::string::npos ? who.contacts : who.response.substr(colon + 1) + ", " + who.contacts;
        if (!who.stepper.empty()) label += ", " + who.stepper;
        chart.series[place->second].points.push_back(
            {.x = time * ms,
             .y = row.residual_max() * mm,
             .name = failed ? fmt::format("{}: failed in {} of {} runs", label, row.failed_runs, row.planned.runs())
                            : fmt::format("{}: {} ms, {} mm", label, format_number(time * ms),
                                          format_number(row.residual_max() * mm)),
             .label = label,
             .failed = failed});
    }
    for (ChartSeries& one : chart.series) {
        std::sort(one.points.begin(), one.points.end(),
                  [](const ChartPoint& a, const ChartPoint& b) { return std::pair(a.x, a.y) < std::pair(b.x, b.y); });
        one.connected = one.points.size() > 1;
        for (ChartPoint& point : one.points) {
            if (!one.connected) point.label = one.name;
        }
    }
    chart.x_title = std::string("tick ") + tail_name(tail) + ", slowest scene (ms)";
    chart.y_title = "residual penetration, max (mm)";
    chart.x_limit = 1.0;
    chart.x_limit_name = "1 ms";
    return chart;
}

}  // namespace trocar
