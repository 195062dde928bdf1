#include "report/chart.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "report/document.hpp"

namespace trocar {
namespace {

constexpr const char* ink = "#1b2027";
constexpr const char* grid = "#e3e7eb";
constexpr const char* soft = "#5c6672";

/// The drawing under construction; all coordinates in pixels, y down.
class Canvas {
public:
    Canvas(double width, double height, std::string_view name) {
        out_ = fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
            "height=\"{1:.0f}\" role=\"img\" aria-label=\"{2}\" font-family=\"system-ui, 'Noto Sans', 'DejaVu Sans', "
            "Arial, sans-serif\" font-size=\"13\" fill=\"{3}\">\n<rect width=\"{0:.0f}\" height=\"{1:.0f}\" "
            "fill=\"#ffffff\"/>\n",
            width, height, escape_xml(std::string(name)), ink);
    }
    void line(double x1, double y1, double x2, double y2, const char* colour, double width = 1.0,
              const char* dash = "") {
        out_ += fmt::format(
            "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"{:.1f}\"{}/>\n",
            x1, y1, x2, y2, colour, width, dash_attribute(dash));
    }
    void path(const std::vector<std::pair<double, double>>& points, const char* colour, double width,
              const char* dash = "", const std::string& name = {}) {
        if (points.size() < 2) return;
        std::string d;
        for (const auto& [x, y] : points) d += fmt::format("{}{:.1f} {:.1f}", d.empty() ? "M" : "L", x, y);
        out_ += fmt::format(
            "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.1f}\" stroke-linejoin=\"round\"{}", d, colour,
            width, dash_attribute(dash));
        out_ += name.empty() ? "/>\n" : "><title>" + escape_xml(name) + "</title></path>\n";
    }
    void rectangle(double x, double y, double width, double height, const char* colour) {
        out_ += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>\n", x, y,
                            width, height, colour);
    }
    /// anchor: start, middle or end.
    void text(double x, double y, const std::string& content, const char* anchor = "start", const char* colour = ink,
              double size = 13.0, std::string_view extra = "") {
        out_ += fmt::format(
            "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\" font-size=\"{:.0f}\"{}>{}</text>\n", x, y,
            anchor, colour, size, extra, escape_xml(content));
    }
    void text_upright(double x, double y, const std::string& content) {
        out_ +=
            fmt::format("<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                        x, y, escape_xml(content));
    }
    void mark(double x, double y, const MarkStyle& style, const std::string& name) {
        const char* colour = chart_colour(style.colour);
        const std::string paint = style.hollow
                                      ? fmt::format("fill=\"#ffffff\" stroke=\"{}\" stroke-width=\"2\"", colour)
                                      : fmt::format("fill=\"{}\" stroke=\"#ffffff\" stroke-width=\"1\"", colour);
        const auto& outline = mark_outline(style.shape);
        if (outline.empty()) {
            out_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"6\" {}", x, y, paint);
        } else {
            std::string list;
            for (const auto& [right, down] : outline) {
                list += fmt::format("{}{:.1f},{:.1f}", list.empty() ? "" : " ", x + right, y + down);
            }
            out_ += fmt::format("<polygon points=\"{}\" {}", list, paint);
        }
        out_ += name.empty()
                    ? "/>\n"
                    : "><title>" + escape_xml(name) + "</title></" + (outline.empty() ? "circle" : "polygon") + ">\n";
    }
    std::string finish() { return out_ + "</svg>\n"; }

private:
    static std::string dash_attribute(const char* dash) {
        return *dash == '\0' ? std::string() : fmt::format(" stroke-dasharray=\"{}\"", dash);
    }
    std::string out_;
};

/// Axes end here: numbers beyond are those of a run that went wrong, and sums of them would overflow.
constexpr double most_drawn = 1e30;
constexpr double least_drawn = 1e-30;

double drawn(double value) { return std::clamp(value, -most_drawn, most_drawn); }

/// Linear or logarithmic, from one round number to another.
class Axis {
public:
    /// From 0 (or the lowest value, when negative).
    static Axis linear(double low, double high, double from, double to) {
        Axis axis(from, to);
        if (!(high >= low)) low = high = 0.0;
        low = drawn(low);
        high = drawn(high);
        if (!(high - low > least_drawn)) high = low + std::max(1.0, 1e-6 * std::abs(low));
        const double raw = (high - low) / 6.0;
        const double decade = std::pow(10.0, std::floor(std::log10(raw)));
        axis.step_ = decade * (raw / decade <= 1.0   ? 1.0
                               : raw / decade <= 2.0 ? 2.0
                               : raw / decade <= 5.0 ? 5.0
                                                     : 10.0);
        axis.low_ = std::floor(low / axis.step_ + 1e-9) * axis.step_;
        axis.high_ = std::ceil(high / axis.step_ - 1e-9) * axis.step_;
        return axis;
    }
    /// Its ends are 1, 2 or 5 times a power of ten.
    static Axis logarithmic(double low, double high, double from, double to) {
        Axis axis(from, to);
        if (!(low > 0.0) || !(high >= low)) low = high = 1.0;
        axis.low_ = nice(drawn_log(low) / 1.25, false);
        axis.high_ = nice(drawn_log(high) * 1.25, true);
        return axis;
    }
    [[nodiscard]] double at(double value) const {
        const double path = is_linear() ? drawn(value) - low_ : std::log(drawn_log(value) / low_);
        return from_ + (to_ - from_) * path / (is_linear() ? high_ - low_ : std::log(high_ / low_));
    }
    /// Values to draw lines at, with a label for the ones that a reader needs.
    [[nodiscard]] std::vector<std::pair<double, std::string>> ticks() const {
        std::vector<std::pair<double, std::string>> list;
        if (is_linear()) {
            for (int i = 0; low_ + i * step_ <= high_ + 0.5 * step_; ++i) {
                list.emplace_back(low_ + i * step_, label(low_ + i * step_));
            }
            return list;
        }
        const bool few = std::log10(high_ / low_) < 2.5;
        for (int decade = static_cast<int>(std::floor(std::log10(low_) + 1e-9));
             std::pow(10.0, decade) <= high_ * 1.0001; ++decade) {
            for (int digit = 1; digit < 10; ++digit) {
                const double value = digit * std::pow(10.0, decade);
                if (value < low_ * 0.9999 || value > high_ * 1.0001) continue;
                const bool labelled = digit == 1 || (few && (digit == 2 || digit == 5));
                list.emplace_back(value, labelled ? label(value) : std::string());
            }
        }
        return list;
    }

private:
    Axis(double from, double to) : from_(from), to_(to) {}
    [[nodiscard]] bool is_linear() const { return step_ > 0.0; }
    static double drawn_log(double value) { return std::clamp(value, least_drawn, most_drawn); }
    static std::string label(double value) { return fmt::format("{:g}", rounded(value, 3)); }
    static double nice(double value, bool up) {
        const double decade = std::pow(10.0, std::floor(std::log10(value)));
        const double digits = value / decade;
        constexpr std::array<double, 4> steps{1.0, 2.0, 5.0, 10.0};
        double chosen = up ? 10.0 : 1.0;
        for (const double step : steps) {
            if (up && step >= digits * 0.9999) {
                chosen = step;
                break;
            }
            if (!up && step <= digits * 1.0001) chosen = step;
        }
        return chosen * decade;
    }
    double from_;
    double to_;
    double low_ = 1.0;
    double high_ = 10.0;
    double step_ = 0.0;  ///< between lines of a linear axis; 0: logarithmic
};

/// Upright lines at the ticks of a horizontal axis, labelled below.
void draw_grid_over(Canvas& canvas, const Axis& x, double top, double bottom) {
    for (const auto& [value, label] : x.ticks()) {
        canvas.line(x.at(value), top, x.at(value), bottom, grid, label.empty() ? 0.5 : 1.0);
        if (!label.empty()) canvas.text(x.at(value), bottom + 18, label, "middle", soft, 12);
    }
}

/// Lines at the ticks of an upright axis, labelled to the left.
void draw_grid_beside(Canvas& canvas, const Axis& y, double left, double right) {
    for (const auto& [value, label] : y.ticks()) {
        canvas.line(left, y.at(value), right, y.at(value), grid, label.empty() ? 0.5 : 1.0);
        if (!label.empty()) canvas.text(left - 8, y.at(value) + 4, label, "end", soft, 12);
    }
}

/// Both axes, with their titles.
void draw_axes(Canvas& canvas, double left, double right, double top, double bottom, const std::string& x_title,
               const std::string& y_title) {
    canvas.line(left, bottom, right, bottom, ink);
    canvas.line(left, top, left, bottom, ink);
    canvas.text((left + right) / 2, bottom + 42, x_title, "middle");
    canvas.text_upright(18, (top + bottom) / 2, y_title);
}

void legend_entry(Canvas& canvas, double x, double y, const MarkStyle& style, const std::string& name) {
    canvas.mark(x, y - 4.5, style, {});
    canvas.text(x + 13, y, name, "start", ink, 12);
}

void draw_limit(Canvas& canvas, double x, double top, double bottom, const std::string& name) {
    canvas.line(x, top, x, bottom, "#a32020", 1.5, "5 4");
    canvas.text(x - 5, top + 13, name, "end", "#a32020", 12);
}

}  // namespace

const char* chart_colour(int index) { return chart_colours.at(static_cast<std::size_t>(index) % chart_colours.size()); }

MarkStyle mark_style(int number) {
    constexpr auto colours = static_cast<int>(chart_colours.size());
    return {.colour = number % colours, .shape = (number + number / colours) % mark_shape_count};
}

const std::vector<std::pair<double, double>>& mark_outline(int shape) {
    static const std::array<std::vector<std::pair<double, double>>, mark_shape_count> outlines{{
        {},                                                            // circle
        {{-5.25, -5.25}, {5.25, -5.25}, {5.25, 5.25}, {-5.25, 5.25}},  // square
        {{0, -7}, {6.5, 5}, {-6.5, 5}},                                // triangle up
        {{0, -7.5}, {6.5, 0}, {0, 7.5}, {-6.5, 0}},                    // diamond
        {{0, 7}, {6.5, -5}, {-6.5, -5}},                               // triangle down
        {{-2, -7}, {2, -7}, {2, -2}, {7, -2}, {7, 2}, {2, 2}, {2, 7}, {-2, 7}, {-2, 2}, {-7, 2}, {-7, -2}, {-2, -2}},
        {{3.5, -6.4},
         {6.4, -3.5},
         {2.8, 0},
         {6.4, 3.5},
         {3.5, 6.4},
         {0, 2.8},  // the same turned: cross
         {-3.5, 6.4},
         {-6.4, 3.5},
         {-2.8, 0},
         {-6.4, -3.5},
         {-3.5, -6.4},
         {0, -2.8}},
        {{0, -7.5},
         {1.9, -2.6},
         {7.1, -2.3},
         {3, 1},
         {4.4, 6.1},  // star
         {0, 3.2},
         {-4.4, 6.1},
         {-3, 1},
         {-7.1, -2.3},
         {-1.9, -2.6}},
        {{-6, -6.5}, {6, -6.5}, {1, 0}, {6, 6.5}, {-6, 6.5}, {-1, 0}},  // hourglass
        {{-5, -6.5}, {7, 0}, {-5, 6.5}},                                // triangle to the right
    }};
    return outlines.at(static_cast<std::size_t>(shape) % outlines.size());
}

const std::vector<double>& line_dash(int number) {
    static const std::array<std::vector<double>, 4> dashes{{{}, {6, 3}, {2, 3}, {8, 3, 2, 3}}};
    return dashes.at(static_cast<std::size_t>(number) % dashes.size());
}

ScatterExtent extent_of(const ScatterChart& chart) {
    ScatterExtent extent;
    const auto add_x = [&extent](double x) {
        extent.low_x = std::min(extent.low_x, x);
        extent.high_x = std::max(extent.high_x, x);
    };
    if (chart.x_limit) add_x(*chart.x_limit);
    for (const ChartSeries& series : chart.series) {
        for (const ChartPoint& point : series.points) {
            add_x(point.x);
            extent.failed = extent.failed || point.failed;
            extent.zero = extent.zero || (point.y <= 0.0 && !point.failed);
            if (point.y <= 0.0 || point.failed) continue;
            extent.low_y = std::min(extent.low_y, point.y);
            extent.high_y = std::max(extent.high_y, point.y);
        }
    }
    return extent;
}

std::string draw(const ScatterChart& chart) {
    constexpr double width = 1100;
    constexpr double left = 78;
    constexpr double right = 790;
    constexpr double top = 20;
    const double height = std::max(540.0, top + 40.0 + 20.0 * static_cast<double>(chart.series.size()) + 60.0);
    const auto [low_x, high_x, low_y, high_y, zero, failed] = extent_of(chart);
    const double bottom = height - 56.0;
    const double band = zero ? 44.0 : 0.0;
    const Axis x = Axis::logarithmic(low_x, high_x, left, right);
    const Axis y = Axis::logarithmic(low_y, high_y, bottom - band, failed ? top + 44.0 : top);
    const auto y_at = [&y, bottom](double value) { return value > 0.0 ? y.at(value) : bottom - 20.0; };
    const auto place_of = [&y_at](const ChartPoint& point) { return point.failed ? top + 18.0 : y_at(point.y); };

    Canvas canvas(width, height, chart.y_title + " against " + chart.x_title);
    draw_grid_over(canvas, x, top, bottom);
    draw_grid_beside(canvas, y, left, right);
    if (zero) {
        canvas.rectangle(left, bottom - 38, right - left, 38, "#f0f3f6");
        canvas.line(left, bottom - 38, right, bottom - 38, soft, 1.0, "3 3");
        canvas.text(left - 8, bottom - 16, "exactly 0", "end", soft, 12);
    }
    if (failed) {
        canvas.rectangle(left, top, right - left, 36, "#fbeeee");
        canvas.line(left, top + 36, right, top + 36, "#a32020", 1.0, "3 3");
        canvas.text(left - 8, top + 22, "failed", "end", "#a32020", 12);
    }
    draw_axes(canvas, left, right, top, bottom, chart.x_title, chart.y_title);
    if (chart.x_limit) draw_limit(canvas, x.at(*chart.x_limit), failed ? top + 36 : top, bottom, chart.x_limit_name);

    std::vector<std::pair<double, double>> stairs;
    for (const auto& [front_x, front_y] : chart.front) {
        if (!stairs.empty()) stairs.emplace_back(x.at(front_x), stairs.back().second);
        stairs.emplace_back(x.at(front_x), y_at(front_y));
    }
    if (!stairs.empty()) {
        stairs.emplace_back(right, stairs.back().second);
        stairs.insert(stairs.begin(), {stairs.front().first, top});
    }
    canvas.path(stairs, "#9aa4ae", 2.0, "1 4", "front: no row is both faster and better");

    for (const ChartSeries& series : chart.series) {
        if (!series.connected) continue;
        std::vector<std::pair<double, double>> curve;
        for (const ChartPoint& point : series.points) curve.emplace_back(x.at(point.x), place_of(point));
        canvas.path(curve, chart_colour(series.style.colour), 1.2, "", series.name);
    }
    // Labels of neighbours share one line to the right of the last of them, so that none is printed over another.
    struct Labelled {
        double x = 0.0;
        double y = 0.0;
        std::string text;
    };
    std::vector<Labelled> labels;
    for (const ChartSeries& series : chart.series) {
        for (const ChartPoint& point : series.points) {
            canvas.mark(x.at(point.x), place_of(point), series.style, point.name);
            if (!point.label.empty()) labels.push_back({x.at(point.x), place_of(point), point.label});
        }
    }
    std::sort(labels.begin(), labels.end(),
              [](const Labelled& a, const Labelled& b) { return std::pair(a.x, a.text) < std::pair(b.x, b.text); });
    std::vector<std::array<double, 4>> taken;  // x from, x to, y from, y to
    for (const Labelled& item : labels) {
        const double length = 6.5 * static_cast<double>(item.text.size());
        constexpr std::array<std::pair<double, double>, 8> places{
            {{9, -7}, {9, 15}, {-9, -7}, {-9, 15}, {9, -20}, {9, 28}, {-9, -20}, {-9, 28}}};
        for (std::size_t i = 0; i < places.size(); ++i) {
            const double from = item.x + (places.at(i).first > 0 ? places.at(i).first : places.at(i).first - length);
            const double base = item.y + places.at(i).second;
            const std::array<double, 4> box{from, from + length, base - 9, base + 1};
            const bool free = std::none_of(taken.begin(), taken.end(), [&box](const auto& other) {
                return box[0] < other[1] && other[0] < box[1] && box[2] < other[3] && other[2] < box[3];
            });
            if (!free && i + 1 < places.size()) continue;
            canvas.text(from, base, item.text, "start", soft, 11);
            taken.push_back(box);
            break;
        }
    }
    double line = top + 12;
    for (const ChartSeries& series : chart.series) {
        legend_entry(canvas, right + 26, line, series.style, series.name);
        line += 20;
    }
    if (!chart.front.empty()) {
        canvas.line(right + 18, line - 4, right + 34, line - 4, "#9aa4ae", 2.0, "1 4");
        canvas.text(right + 39, line, "front: none is faster and better", "start", ink, 12);
    }
    return canvas.finish();
}

std::string draw(const LineChart& chart) {
    constexpr double width = 1100;
    constexpr double left = 78;
    constexpr double right = 790;
    constexpr double top = 20;
    const double height =
        std::max(chart.small ? 220.0 : 400.0, top + 80.0 + 20.0 * static_cast<double>(chart.lines.size()));
    const double bottom = height - 56.0;
    double low_x = std::numeric_limits<double>::infinity();
    double high_x = -low_x;
    double low_y = 0.0;
    double high_y = 0.0;
    for (const LineChart::Line& line : chart.lines) {
        for (const auto& [px, py] : line.points) {
            low_x = std::min(low_x, px);
            high_x = std::max(high_x, px);
            if (!std::isfinite(py)) continue;
            low_y = std::min(low_y, py);
            high_y = std::max(high_y, py);
        }
    }
    if (!(high_x >= low_x)) low_x = high_x = 1.0;
    const Axis x =
        chart.log_x ? Axis::logarithmic(low_x, high_x, left, right) : Axis::linear(low_x, high_x, left, right);
    const Axis y = Axis::linear(low_y, high_y, bottom, top);
    Canvas canvas(width, height, chart.y_title + " over " + chart.x_title);
    draw_grid_over(canvas, x, top, bottom);
    draw_grid_beside(canvas, y, left, right);
    draw_axes(canvas, left, right, top, bottom, chart.x_title, chart.y_title);
    double legend = top + 12;
    for (const LineChart::Line& line : chart.lines) {
        const std::string dashes = fmt::format("{:g}", fmt::join(line_dash(line.dash), " "));
        const char* const dash = dashes.c_str();
        std::vector<std::pair<double, double>> piece;
        for (const auto& [px, py] : line.points) {
            if (!std::isfinite(py)) {
                canvas.path(piece, chart_colour(line.colour), 1.8, dash, line.name);
                piece.clear();
                continue;
            }
            if (chart.steps && !piece.empty()) piece.emplace_back(x.at(px), piece.back().second);
            piece.emplace_back(x.at(px), y.at(py));
        }
        canvas.path(piece, chart_colour(line.colour), 1.8, dash, line.name);
        canvas.line(right + 16, legend - 4, right + 40, legend - 4, chart_colour(line.colour), 2.2, dash);
        canvas.text(right + 47, legend, line.name, "start", ink, 12);
        legend += 20;
    }
    return canvas.finish();
}

}  // namespace trocar
