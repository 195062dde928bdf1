#include "report/chart.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <regex>

namespace trocar {
namespace {

double attribute(const std::string& svg, const std::string& element, const std::string& title,
                 const std::string& name) {
    const std::regex pattern("<" + element + R"([^>]*\b)" + name + R"(="([-0-9.]+)\"[^>]*><title>)" + title);
    std::smatch match;
    EXPECT_TRUE(std::regex_search(svg, match, pattern)) << title << " in " << svg;
    return match.empty() ? 0.0 : std::stod(match[1]);
}

ScatterChart chart() {
    ScatterChart scatter;
    scatter.x_title = "time";
    scatter.y_title = "error";
    scatter.series.push_back({.name = "s",
                              .style = {},
                              .points = {{.x = 10, .y = 1, .name = "first", .label = "1"},
                                         {.x = 100, .y = 1, .name = "second", .label = "2"},
                                         {.x = 1000, .y = 0, .name = "exact", .label = "3"},
                                         {.x = 100, .y = 10, .name = "worse", .label = "4"}}});
    return scatter;
}

TEST(ScatterChart, DecadesAreEquallyFarApart) {
    const std::string svg = draw(chart());
    const double first = attribute(svg, "circle", "first", "cx");
    const double second = attribute(svg, "circle", "second", "cx");
    const double third = attribute(svg, "circle", "exact", "cx");
    EXPECT_GT(second, first);
    EXPECT_NEAR(third - second, second - first, 0.15);
}

TEST(ScatterChart, ExactZeroIsShownBelowEveryOtherError) {
    const std::string svg = draw(chart());
    EXPECT_GT(attribute(svg, "circle", "exact", "cy"), attribute(svg, "circle", "first", "cy"));
    EXPECT_GT(attribute(svg, "circle", "first", "cy"), attribute(svg, "circle", "worse", "cy"));
    EXPECT_NE(svg.find("exactly 0"), std::string::npos);
    ScatterChart without = chart();
    without.series[0].points.erase(without.series[0].points.begin() + 2);
    EXPECT_EQ(draw(without).find("exactly 0"), std::string::npos);
}

TEST(ScatterChart, NamesAreEscaped) {
    ScatterChart scatter = chart();
    scatter.series[0].points[0].name = "a < b & c";
    EXPECT_NE(draw(scatter).find("<title>a &lt; b &amp; c</title>"), std::string::npos);
}

TEST(DotChart, AllMarksOfACategoryStandAboveThoseOfTheNext) {
    DotChart dots;
    dots.x_title = "t";
    dots.categories = {"upper", "lower"};
    for (int count = 1; count <= 8; ++count) {
        const std::string number = std::to_string(count);
        dots.series.push_back({.name = "s" + number,
                               .style = {},
                               .dots = {DotChart::Dot{.value = 1.0, .name = "upper" + number},
                                        DotChart::Dot{.value = 10.0, .name = "lower" + number}}});
        const std::string svg = draw(dots);
        EXPECT_LT(attribute(svg, "circle", "upper" + number, "cy"), attribute(svg, "circle", "lower1", "cy")) << count;
    }
}

TEST(BarChart, LengthsAreProportional) {
    const std::string svg = draw(
        BarChart{.x_title = "t", .parts = {"p"}, .bars = {{.name = "x", .parts = {10}}, {.name = "y", .parts = {30}}}});
    EXPECT_NEAR(attribute(svg, "rect", "y", "width"), 3 * attribute(svg, "rect", "x", "width"), 0.3);
}

TEST(Charts, OfNumbersBeyondAllMeasureEndAndHaveAPlaceForEachMark) {
    const std::vector<double> extremes{0.0, 5e-324, 1e-310, 1.0, 1e17, 1e308, std::numeric_limits<double>::infinity()};
    for (const double low : extremes) {
        for (const double high : extremes) {
            ScatterChart scatter = chart();
            scatter.series.front().points = {{.x = low, .y = high, .name = "one", .label = "1"},
                                             {.x = high, .y = low, .name = "other", .label = "2"}};
            BarChart bars{.x_title = "sum", .parts = {"a", "b"}, .bars = {{.name = "bar", .parts = {low, high}}}};
            LineChart lines;
            lines.lines.push_back({.name = "line", .points = {{low, high}, {high, low}}});
            LineChart log_lines = lines;
            log_lines.log_x = true;
            for (const std::string& svg : {draw(scatter), draw(bars), draw(lines), draw(log_lines)}) {
                const std::regex no_place(R"re([ a-z0-9]+="[^"]*\b(nan|inf)\b[^"]*")re");
                EXPECT_FALSE(std::regex_search(svg, no_place)) << low << " and " << high << ": " << svg;
                EXPECT_LT(svg.size(), 200000U);
            }
        }
    }
}

TEST(Charts, SameNumbersSameBytes) { EXPECT_EQ(draw(chart()), draw(chart())); }

}  // namespace
}  // namespace trocar
