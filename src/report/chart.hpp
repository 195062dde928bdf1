// Small drawings as SVG text: the few kinds of chart a report needs, with the same bytes for the same numbers on every
// machine. Every mark carries its name, shown when it is touched.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace trocar {

/// Marks differ by colour and shape, so that a chart survives a black-and-white printer.
struct MarkStyle {
    int colour = 0;  ///< index into a palette that colour-blind readers can distinguish
    int shape = 0;   ///< circle, square, triangle, diamond, cross …
    bool hollow = false;
};

struct ChartPoint {
    double x = 0.0;
    double y = 0.0;       ///< exactly 0 is drawn on a band of its own under a logarithmic axis
    std::string name;     ///< shown when touched
    std::string label;    ///< printed beside the mark; may be empty
    bool failed = false;  ///< stands on the rail above the chart, whatever its y
};

struct ChartSeries {
    std::string name;
    MarkStyle style;
    std::vector<ChartPoint> points;
    bool connected = false;  ///< one method over its knob
};

/// Both axes logarithmic.
struct ScatterChart {
    std::string x_title;
    std::string y_title;
    std::vector<ChartSeries> series;
    std::vector<std::pair<double, double>> front;  ///< Pareto front, ascending x
    std::optional<double> x_limit;                 ///< vertical line
    std::string x_limit_name;
    std::string rail = "failed";  ///< name of the rail on which failed points stand
};
std::string draw(const ScatterChart& chart);
/// The same for window.trocarCharts.draw, JSON (src/web/README.md). What is exactly 0 or failed has no place on a
/// logarithmic axis: it stands at its end, and its words say so.
std::string interactive(const ScatterChart& chart);

/// One row per category, one mark per series at `value` with a whisker to `upper`; x logarithmic.
struct DotChart {
    struct Dot {
        double value = 0.0;
        double upper = std::numeric_limits<double>::quiet_NaN();  ///< NaN: no whisker
        std::string name;
    };
    struct Series {
        std::string name;
        MarkStyle style;
        std::vector<std::optional<Dot>> dots;  ///< one per category
    };
    std::string x_title;
    std::vector<std::string> categories;
    std::vector<Series> series;
    std::optional<double> x_limit;
    std::string x_limit_name;
};
std::string draw(const DotChart& chart);

/// Horizontal bars made of parts; x linear from 0.
struct BarChart {
    struct Bar {
        std::string name;
        std::vector<double> parts;  ///< NaN: part not present
    };
    std::string x_title;
    std::vector<std::string> parts;
    std::vector<Bar> bars;
};
std::string draw(const BarChart& chart);

/// Lines over a common linear x; NaN breaks a line.
struct LineChart {
    struct Line {
        std::string name;
        int colour = 0;
        int dash = 0;
        std::vector<std::pair<double, double>> points;
    };
    std::string x_title;
    std::string y_title;
    std::vector<Line> lines;
    bool steps = false;  ///< hold a value until the next point
    bool log_x = false;
    bool small = false;  ///< half as high
};
std::string draw(const LineChart& chart);
std::string interactive(const LineChart& chart);

}  // namespace trocar
