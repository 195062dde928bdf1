// Charts of a report as SVG text. Equal numbers give equal bytes on every machine. Every mark has a tooltip.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace trocar {

/// Ten colours that colour-blind readers can distinguish: M. A. Petroff, Accessible Color Sequences for Data
/// Visualization, arXiv:2107.02270, 2021. The script has the same list (src/web/source/charts.js).
inline constexpr std::array<const char*, 10> chart_colours{"#3f90da", "#ffa90e", "#bd1f01", "#94a4a2", "#832db6",
                                                           "#a96b59", "#e76300", "#b9ac70", "#717581", "#92dadd"};
/// Colour of a series; the eleventh has the first again.
const char* chart_colour(int index);
inline constexpr int mark_shape_count = 10;

/// Marks differ by colour and shape, so that black-and-white prints stay readable.
struct MarkStyle {
    int colour = 0;  ///< index into chart_colours
    int shape = 0;   ///< index of a mark_outline
    bool hollow = false;
};
/// Mark of the series of that number. The first ten have colours and shapes of their own, and no two of the first
/// hundred share both.
MarkStyle mark_style(int number);
/// Corners of a shape around (0, 0), in pixels, y down; empty: a circle.
const std::vector<std::pair<double, double>>& mark_outline(int shape);

struct ChartPoint {
    double x = 0.0;
    double y = 0.0;       ///< exact 0 is drawn on a separate band under a logarithmic axis
    std::string name;     ///< tooltip
    std::string label;    ///< printed beside the mark; may be empty
    bool failed = false;  ///< drawn on the rail above the chart, whatever its y
};

struct ChartSeries {
    std::string name;
    MarkStyle style;
    std::vector<ChartPoint> points = {};
    bool connected = false;  ///< one method over its parameter
};

/// Both axes logarithmic.
struct ScatterChart {
    std::string x_title;
    std::string y_title;
    std::vector<ChartSeries> series;
    std::vector<std::pair<double, double>> front;  ///< Pareto front, ascending x
    std::optional<double> x_limit;                 ///< vertical line
    std::string x_limit_name;
};
/// Range of the points and of the limit. A band of its own has what is exactly 0, a rail what failed.
struct ScatterExtent {
    double low_x = std::numeric_limits<double>::infinity();
    double high_x = 0.0;
    double low_y = std::numeric_limits<double>::infinity();  ///< of what has a place on the axis
    double high_y = 0.0;
    bool zero = false;
    bool failed = false;
};
ScatterExtent extent_of(const ScatterChart& chart);
std::string draw(const ScatterChart& chart);
/// JSON for window.trocarCharts.draw (src/web/README.md). Exact 0 and failed points are placed at the end of the
/// logarithmic axis, with a note in the tooltip.
std::string interactive(const ScatterChart& chart);

/// Pixels drawn and left out in turn; empty: a full line.
const std::vector<double>& line_dash(int number);

/// Lines over a common linear x; NaN breaks a line.
struct LineChart {
    struct Line {
        std::string name;
        int colour = 0;  ///< index into chart_colours
        int dash = 0;    ///< number of a line_dash
        std::vector<std::pair<double, double>> points = {};
    };
    std::string x_title;
    std::string y_title;
    std::vector<Line> lines = {};
    bool steps = false;  ///< step plot: constant until the next point
    bool log_x = false;
    bool small = false;  ///< half height
};
std::string draw(const LineChart& chart);
std::string interactive(const LineChart& chart);

}  // namespace trocar
