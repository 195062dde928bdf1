#include "report/chart.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "support/program.hpp"
#include "web/web.hpp"

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

TEST(Charts, OfNumbersBeyondAllMeasureEndAndHaveAPlaceForEachMark) {
    const std::vector<double> extremes{0.0, 5e-324, 1e-310, 1.0, 1e17, 1e308, std::numeric_limits<double>::infinity()};
    for (const double low : extremes) {
        for (const double high : extremes) {
            ScatterChart scatter = chart();
            scatter.series.front().points = {{.x = low, .y = high, .name = "one", .label = "1"},
                                             {.x = high, .y = low, .name = "other", .label = "2"}};
            LineChart lines;
            lines.lines.push_back({.name = "line", .points = {{low, high}, {high, low}}});
            LineChart log_lines = lines;
            log_lines.log_x = true;
            for (const std::string& svg : {draw(scatter), draw(lines), draw(log_lines)}) {
                const std::regex no_place(R"re([ a-z0-9]+="[^"]*\b(nan|inf)\b[^"]*")re");
                EXPECT_FALSE(std::regex_search(svg, no_place)) << low << " and " << high << ": " << svg;
                EXPECT_LT(svg.size(), 200000U);
            }
        }
    }
}

/// Places of the lines of the grid, ascending: of those that stand upright their x, else their y.
std::vector<double> grid_places(const std::string& svg, bool upright) {
    const std::regex line(
        R"re(<line x1="([-0-9.]+)" y1="([-0-9.]+)" x2="([-0-9.]+)" y2="([-0-9.]+)" stroke="#e3e7eb")re");
    std::vector<double> places;
    for (std::sregex_iterator match(svg.begin(), svg.end(), line); match != std::sregex_iterator(); ++match) {
        if (((*match)[1] == (*match)[3]) == upright) places.push_back(std::stod((*match)[upright ? 1 : 2]));
    }
    std::sort(places.begin(), places.end());
    return places;
}

struct PlacedWord {
    double x;
    double y;
    std::string text;
};

std::vector<PlacedWord> placed_words(const std::string& svg) {
    const std::regex pattern(R"re(<text x="([-0-9.]+)" y="([-0-9.]+)"[^>]*>([^<]*)</text>)re");
    std::vector<PlacedWord> words;
    for (std::sregex_iterator match(svg.begin(), svg.end(), pattern); match != std::sregex_iterator(); ++match) {
        words.push_back({std::stod((*match)[1]), std::stod((*match)[2]), (*match)[3].str()});
    }
    return words;
}

/// One drawing of every kind, with as many series or lines.
std::vector<std::string> drawings(int count) {
    ScatterChart scatter;
    LineChart lines;
    for (std::string* title : {&scatter.x_title, &lines.x_title}) *title = "the quantity";
    for (int i = 1; i <= count; ++i) {
        const std::string name = "s" + std::to_string(i);
        const double value = i;
        const ChartPoint point{.x = value, .y = 2.0, .name = "", .label = ""};
        scatter.series.push_back({.name = name, .style = {}, .points = {point}});
        lines.lines.push_back({.name = name, .points = {{1.0, value}, {2.0, 0.0}}});
    }
    LineChart log_lines = lines;
    log_lines.log_x = true;
    LineChart small_lines = lines;
    small_lines.small = true;
    return {draw(scatter), draw(lines), draw(log_lines), draw(small_lines)};
}

TEST(Charts, EveryMarkStandsBetweenTheFirstAndTheLastLineOfBothAxes) {
    constexpr double rounding = 0.11;  // px, places have one digit behind the point
    for (const double value : {1.0, 1.5, 2.1, 4.9, 5.1, 7.3, 9.99}) {
        for (const double factor : {1.0, 3.7, 250.0}) {
            ScatterChart scatter = chart();
            scatter.series.front().points = {{.x = value, .y = value * factor, .name = "one", .label = ""},
                                             {.x = value * factor, .y = value, .name = "other", .label = ""}};
            const std::string svg = draw(scatter);
            for (const bool upright : {true, false}) {
                const std::vector<double> grid = grid_places(svg, upright);
                ASSERT_GE(grid.size(), 2U);
                for (const char* name : {"one", "other"}) {
                    const double place = attribute(svg, "circle", name, upright ? "cx" : "cy");
                    EXPECT_GE(place, grid.front() - rounding) << value << " times " << factor;
                    EXPECT_LE(place, grid.back() + rounding) << value << " times " << factor;
                }
            }
        }
    }
    // And a line says what stands on it.
    const std::string svg = draw(chart());
    for (const PlacedWord& word : placed_words(svg)) {
        if (word.text == "100") {
            EXPECT_NEAR(word.x, attribute(svg, "circle", "second", "cx"), rounding);
        }
    }
}

TEST(Charts, TheTitleOfTheHorizontalAxisStandsBelowEveryOtherWord) {
    for (const std::string& svg : drawings(2)) {
        double title = 0.0;
        double others = 0.0;
        for (const PlacedWord& word : placed_words(svg)) {
            double& lowest = word.text == "the quantity" ? title : others;
            lowest = std::max(lowest, word.y);
        }
        EXPECT_GT(others, 0.0);
        EXPECT_GT(title, others) << svg;
    }
}

TEST(Charts, EveryWordStandsWithinTheDrawingHoweverManyThereAre) {
    const std::regex size(R"re(viewBox="0 0 ([0-9]+) ([0-9]+)")re");
    for (const int count : {1, 10, 40}) {
        for (const std::string& svg : drawings(count)) {
            std::smatch match;
            ASSERT_TRUE(std::regex_search(svg, match, size));
            for (const PlacedWord& word : placed_words(svg)) {
                EXPECT_TRUE(word.x >= 0.0 && word.x <= std::stod(match[1])) << word.text << " in " << svg;
                EXPECT_TRUE(word.y > 0.0 && word.y <= std::stod(match[2])) << word.text << " in " << svg;
            }
        }
    }
}

/// CIE 1976 L*a*b* of "#rrggbb" (sRGB, white D65), as in CIE 15 and IEC 61966-2-1.
std::array<double, 3> lab_of(const std::string& colour) {
    std::array<double, 3> linear{};
    for (std::size_t i = 0; i < 3; ++i) {
        const double value = std::stoi(colour.substr(1 + 2 * i, 2), nullptr, 16) / 255.0;
        linear.at(i) = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    }
    const auto [r, g, b] = linear;
    const auto f = [](double t) { return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0; };
    const double x = f((0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / 0.95047);
    const double y = f(0.2126729 * r + 0.7151522 * g + 0.0721750 * b);
    const double z = f((0.0193339 * r + 0.1191920 * g + 0.9503041 * b) / 1.08883);
    return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

double distance(const std::string& one, const std::string& other) {
    const auto [l1, a1, b1] = lab_of(one);
    const auto [l2, a2, b2] = lab_of(other);
    return std::hypot(l1 - l2, a1 - a2, b1 - b2);
}

TEST(Marks, TenColoursStandApartFromEachOtherAndFromPaper) {
    EXPECT_NEAR(distance("#000000", "#ffffff"), 100.0, 0.01);
    EXPECT_NEAR(lab_of("#ff0000")[1], 80.1, 0.1);  // red of sRGB: L* 53.2, a* 80.1, b* 67.2
    ASSERT_EQ(chart_colours.size(), 10U);
    for (std::size_t i = 0; i < chart_colours.size(); ++i) {
        EXPECT_GT(distance(chart_colours.at(i), "#ffffff"), 25.0) << chart_colours.at(i);
        for (std::size_t j = 0; j < i; ++j) {
            EXPECT_GT(distance(chart_colours.at(i), chart_colours.at(j)), 15.0)
                << chart_colours.at(i) << " and " << chart_colours.at(j);
        }
    }
}

TEST(Marks, TheFirstTenShareNeitherColourNorShapeAndTheFirstHundredNotBoth) {
    std::set<int> colours;
    std::set<std::vector<std::pair<double, double>>> shapes;
    std::set<std::pair<int, int>> both;
    for (int number = 0; number < 100; ++number) {
        const MarkStyle style = mark_style(number);
        both.emplace(style.colour, style.shape);
        if (number >= 10) continue;
        colours.insert(style.colour);
        shapes.insert(mark_outline(style.shape));
    }
    EXPECT_EQ(colours.size(), 10U);
    EXPECT_EQ(shapes.size(), 10U);
    EXPECT_EQ(both.size(), 100U);
}

TEST(Marks, TheScriptHasTheSameColours) {
    std::string list;
    for (const char* colour : chart_colours) list += (list.empty() ? "\"" : ",\"") + std::string(colour) + "\"";
    EXPECT_NE(web::charts_script().find("[" + list + "]"), std::string_view::npos);
    EXPECT_NE(web::viewer_script().find("[" + list + "]"), std::string_view::npos);
    std::string source = test::read_file(std::filesystem::path(TROCAR_SOURCE_DIR) / "src/web/source/charts.js");
    std::erase_if(source, [](char c) { return c == ' ' || c == '\n'; });
    EXPECT_NE(source.find("palette=[" + list + ",]"), std::string::npos);
}

TEST(Marks, TheInteractiveChartHasThoseOfTheDrawing) {
    ScatterChart scatter;
    LineChart lines;
    for (int number = 0; number < 10; ++number) {
        scatter.series.push_back(
            {.name = "s", .style = mark_style(number), .points = {{.x = 1, .y = 1, .name = "p", .label = ""}}});
        lines.lines.push_back({.name = "l", .colour = number, .dash = number, .points = {{1.0, 1.0}, {2.0, 1.0}}});
    }
    const auto marks = nlohmann::json::parse(interactive(scatter)).at("series");
    const auto dashes = nlohmann::json::parse(interactive(lines)).at("series");
    const std::string drawn = draw(lines);
    std::set<std::string> symbols;
    for (std::size_t i = 0; i < 10; ++i) {
        EXPECT_EQ(marks.at(i).at("color"), chart_colours.at(i));
        symbols.insert(marks.at(i).at("symbol").get<std::string>());
        EXPECT_EQ(dashes.at(i).at("color"), chart_colours.at(i));
        EXPECT_NE(drawn.find("stroke=\"" + std::string(chart_colours.at(i)) + "\""), std::string::npos);
    }
    EXPECT_EQ(symbols.size(), 10U);
    EXPECT_FALSE(dashes.at(0).contains("dash"));
    EXPECT_NE(dashes.at(1).at("dash"), dashes.at(2).at("dash"));
}

}  // namespace
}  // namespace trocar
