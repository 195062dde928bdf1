// Charts as descriptions that the script of a page draws, so that they answer to the pointer.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "report/chart.hpp"
#include "report/document.hpp"

namespace trocar {
namespace {

using Json = nlohmann::ordered_json;

/// Four digits are more than a screen has.
Json short_number(double value) {
    if (!std::isfinite(value)) return nullptr;
    return rounded(value, 4);
}

/// "tick p99 (ms)" apart: name and unit.
Json axis(const std::string& title, bool log) {
    const std::size_t open = title.rfind(" (");
    Json result{{"name", title.substr(0, open)}, {"log", log}};
    if (open != std::string::npos && title.ends_with(")")) {
        result["unit"] = title.substr(open + 2, title.size() - open - 3);
    }
    return result;
}

/// ECharts' name of a mark.
std::string symbol(int shape) {
    std::string path;
    for (const auto& [x, y] : mark_outline(shape)) path += fmt::format("{}{:g} {:g}", path.empty() ? "M" : "L", x, y);
    return path.empty() ? "circle" : "path://" + path + "Z";
}

}  // namespace

std::string interactive(const ScatterChart& chart) {
    if (chart.series.empty()) return {};
    auto [first, last, low, high, any_zero, any_failed] = extent_of(chart);
    if (!(high > 0.0)) low = high = 1.0;
    // Room for a rail of its own at either end.
    const double bottom = low / (any_zero ? 5.0 : 1.5);
    const double top = high * (any_failed ? 3.0 : 1.5);
    Json series = Json::array();
    for (const ChartSeries& one : chart.series) {
        Json points = Json::array();
        for (const ChartPoint& point : one.points) {
            const double y = point.failed ? top : point.y > 0.0 ? point.y : bottom;
            points.push_back({short_number(point.x), short_number(y), point.name});
        }
        series.push_back({{"name", one.name},
                          {"kind", "line"},
                          {"markers", true},
                          {"size", 12},
                          {"color", chart_colour(one.style.colour)},
                          {"symbol", symbol(one.style.shape)},
                          {"points", std::move(points)}});
    }
    Json lines = Json::array();
    if (chart.x_limit) lines.push_back({{"x", *chart.x_limit}, {"name", chart.x_limit_name}});
    if (any_failed) lines.push_back({{"y", short_number(top)}, {"name", "failed"}});
    if (any_zero) lines.push_back({{"y", short_number(bottom)}, {"name", "exactly 0"}});
    Json y = axis(chart.y_title, true);
    y["min"] = short_number(bottom);
    y["max"] = short_number(top);
    Json x = axis(chart.x_title, true);
    x["min"] = short_number(first / 1.3);
    x["max"] = short_number(last * 1.3);
    return Json{{"x", std::move(x)}, {"y", std::move(y)}, {"series", series}, {"lines", lines}}.dump();
}

std::string interactive(const LineChart& chart) {
    if (chart.lines.empty()) return {};
    Json series = Json::array();
    for (const LineChart::Line& line : chart.lines) {
        Json points = Json::array();
        for (std::size_t i = 0; i < line.points.size(); ++i) {
            const auto& [x, y] = line.points[i];
            if (chart.steps && i > 0) points.push_back({short_number(x), points.back()[1]});
            points.push_back({short_number(x), short_number(y)});
        }
        series.push_back(
            {{"name", line.name}, {"kind", "line"}, {"color", chart_colour(line.colour)}, {"points", points}});
        if (const auto& dash = line_dash(line.dash); !dash.empty()) series.back()["dash"] = dash;
    }
    return Json{{"x", axis(chart.x_title, chart.log_x)},
                {"y", axis(chart.y_title, false)},
                {"series", series},
                {"tooltip", chart.steps ? "item" : "axis"},
                {"height", chart.small ? 260 : 460}}
        .dump();
}

}  // namespace trocar
