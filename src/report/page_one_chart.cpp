// Picture A of page 1: what accuracy costs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "report/page_one.hpp"

namespace trocar {

ScatterChart depth_against_time(const std::vector<ResponseRow>& rows) {
    double shortest = not_known;
    for (const ResponseRow& row : rows) {
        if (!std::isnan(row.total_p99_ns) && !(row.total_p99_ns >= shortest)) shortest = row.total_p99_ns;
    }
    ScatterChart chart;
    std::map<std::string, std::size_t> series;
    for (const ResponseRow& row : rows) {
        const bool failed = row.failed > 0;
        if (row.not_run > 0 || (!failed && (std::isnan(row.residual_penetration_max) || std::isnan(row.total_p99_ns))))
            continue;
        // A row without a time (it failed everywhere, or too early) stands at the beginning of the rail.
        const double time = std::isnan(row.total_p99_ns) ? shortest : row.total_p99_ns;
        if (std::isnan(time)) continue;
        const auto [place, is_new] = series.emplace(row.method(), chart.series.size());
        if (is_new) {
            const int number = static_cast<int>(chart.series.size());
            chart.series.push_back({.name = row.method(), .style = mark_style(number)});
        }
        const Method& who = row.who.front();
        const std::size_t colon = who.response.find(':');
        std::string label =
            colon == std::string::npos ? who.contacts : who.response.substr(colon + 1) + ", " + who.contacts;
        if (!who.stepper.empty()) label += ", " + who.stepper;
        chart.series[place->second].points.push_back(
            {.x = time * ms,
             .y = row.residual_penetration_max * mm,
             .name = failed ? fmt::format("{}: failed in {} of {} runs", label, row.failed, row.runs)
                            : fmt::format("{}: {} ms, {} mm", label, format_number(time * ms),
                                          format_number(row.residual_penetration_max * mm)),
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
    chart.x_title = "tick p99, slowest scene (ms)";
    chart.y_title = "residual penetration, max (mm)";
    chart.x_limit = 1.0;
    chart.x_limit_name = "1 ms";
    return chart;
}

}  // namespace trocar
