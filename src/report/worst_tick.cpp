// Picture B of page 1: which runs it shows, and how it is drawn.
#include "report/worst_tick.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/inline_text.hpp"
#include "report/page_one.hpp"

namespace trocar {
namespace {

constexpr double panel_width = 340.0;   // px
constexpr double panel_height = 270.0;  // px
constexpr double panel_top = 46.0;      // px

/// From pale to dark, readable without colour; the clear part of a body is not on the scale.
std::string colour_of_depth(double depth, double most) {
    struct Stop {
        double at, red, green, blue;
    };
    constexpr std::array<Stop, 4> stops{Stop{0.0, 253, 208, 90}, Stop{0.4, 240, 120, 40}, Stop{0.75, 190, 30, 60},
                                        Stop{1.0, 80, 0, 80}};
    const double share = most > 0.0 ? std::clamp(depth / most, 0.0, 1.0) : 0.0;
    std::size_t next = 1;
    while (next + 1 < stops.size() && share > stops.at(next).at) ++next;
    const Stop& from = stops.at(next - 1);
    const Stop& to = stops.at(next);
    const double part = (share - from.at) / (to.at - from.at);
    const auto mix = [part](double a, double b) { return static_cast<int>(std::lround(a + part * (b - a))); };
    return fmt::format("#{:02x}{:02x}{:02x}", mix(from.red, to.red), mix(from.green, to.green),
                       mix(from.blue, to.blue));
}

double deepest(const WorstTick& seen) {
    double most = 0.0;
    for (const WorstTick::State& state : seen.states) {
        most = std::fmax(most, state.depth);
        for (const WorstTick::Body& body : state.bodies) {
            for (const WorstTick::Segment& one : body.segments) most = std::fmax(most, one.depth);
        }
    }
    return most;
}

std::string text_at(double x, double y, const std::string& text, const char* extra = "") {
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\"{}>{}</text>\n", x, y, extra, escape_xml(text));
}

/// A name that is too long for its panel goes on in a second line, broken at a space.
std::string name_lines(double x, const std::string& name) {
    constexpr std::size_t most = 42;
    const std::string plain = without_code(name);
    if (plain.size() <= most) return text_at(x, 30, plain, " font-weight=\"600\"");
    const std::size_t space = plain.rfind(' ', most);
    const std::size_t cut = space == std::string::npos ? most : space;
    return text_at(x, 14, plain.substr(0, cut), " font-weight=\"600\"") +
           text_at(x, 30, plain.substr(cut), " font-weight=\"600\"");
}

/// What is deep is drawn last, so that nothing hides it.
std::string lines_of(const WorstTick::State& state, double most, double scale, double centre_x, double centre_y) {
    std::string clear;
    std::string deep;
    for (const WorstTick::Body& body : state.bodies) {
        const bool tissue = body.kind == "tissue";
        for (const WorstTick::Segment& one : body.segments) {
            const bool is_deep = one.depth > 0.0;
            (is_deep ? deep : clear) += fmt::format(
                "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"{}\"/>\n",
                centre_x + scale * one.ends[0], centre_y - scale * one.ends[1], centre_x + scale * one.ends[2],
                centre_y - scale * one.ends[3],
                is_deep  ? colour_of_depth(one.depth, most)
                : tissue ? "#2f7d5b"
                         : "#5c6672",
                is_deep ? "4" : "2");
        }
    }
    return clear + deep;
}

/// mm from the deepest place to the edge of a panel.
double half_width(const WorstTick& seen, double most) {
    double extent = std::max(2.5 * most, 6.0);
    for (const WorstTick::State& state : seen.states) {
        for (const auto& point : state.points) extent = std::max({extent, std::abs(point[0]), std::abs(point[1])});
    }
    return std::min(extent * 1.1, std::max(40.0, 1.5 * most));
}

}  // namespace

std::string draw(const WorstTick& seen) {
    const double most = deepest(seen);
    const double extent = half_width(seen, most);
    const double scale = panel_width / 2.0 / extent;
    const double width = 12.0 + (panel_width + 12.0) * static_cast<double>(seen.states.size());
    const double height = panel_top + panel_height + 62.0;
    std::string out = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
        "height=\"{1:.0f}\" "
        "role=\"img\" aria-label=\"{2}\" font-family=\"system-ui, 'Noto Sans', 'DejaVu Sans', Arial, sans-serif\" "
        "font-size=\"13\" fill=\"#1b2027\">\n<rect width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"#ffffff\"/>\n",
        width, height, escape_xml(fmt::format("Cut through {} at its worst tick", seen.scene)));
    for (std::size_t i = 0; i < seen.states.size(); ++i) {
        const WorstTick::State& state = seen.states[i];
        const double left = 12.0 + (panel_width + 12.0) * static_cast<double>(i);
        const double centre_x = left + panel_width / 2.0;
        // What is deep hangs from above.
        const double centre_y = panel_top + 0.7 * panel_height;
        out += name_lines(left, state.name);
        out += fmt::format(
            "<clipPath id=\"worst-{0}\"><rect x=\"{1:.1f}\" y=\"{2}\" width=\"{3}\" height=\"{4}\"/></clipPath>\n"
            "<rect x=\"{1:.1f}\" y=\"{2}\" width=\"{3}\" height=\"{4}\" fill=\"#fafbfc\" stroke=\"#d8dde3\"/>\n"
            "<g clip-path=\"url(#worst-{0})\" stroke-linecap=\"round\">\n",
            i, left, panel_top, panel_width, panel_height);
        out += lines_of(state, most, scale, centre_x, centre_y);
        for (const auto& point : state.points) {
            out += fmt::format(
                "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"none\" stroke=\"#0072b2\" stroke-width=\"1.6\"/>\n",
                centre_x + scale * point[0], centre_y - scale * point[1]);
        }
        out += "</g>\n";
        const std::string depth =
            std::isnan(state.depth) ? std::string() : fmt::format("{} mm deep. ", format_number(state.depth));
        out += text_at(left, panel_top + panel_height + 18, depth + state.note, " fill=\"#5c6672\" font-size=\"12\"");
    }
    // One scale for all, and a bar of round length.
    const double bar_y = height - 24.0;
    constexpr int steps = 40;
    for (int step = 0; step < steps; ++step) {
        out += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"5.2\" height=\"10\" fill=\"{}\"/>\n",
                           12.0 + 5.0 * step, bar_y, colour_of_depth(most * (step + 0.5) / steps, most));
    }
    out +=
        text_at(12.0 + 5.0 * steps + 8.0, bar_y + 10,
                fmt::format("depth 0 to {} mm; green: tissue, grey: tool, where nothing is deep", format_number(most)),
                " font-size=\"12\"");
    const double bar = extent > 150.0 ? 100.0 : extent > 15.0 ? 10.0 : extent > 7.0 ? 5.0 : 2.0;  // mm
    out += fmt::format(
        "<line x1=\"{0:.1f}\" y1=\"{2:.1f}\" x2=\"{1:.1f}\" y2=\"{2:.1f}\" stroke=\"#1b2027\" "
        "stroke-width=\"2\"/>\n",
        width - 60.0 - bar * scale, width - 60.0, bar_y + 6);
    out += text_at(width - 52.0, bar_y + 10, fmt::format("{:g} mm", bar), " font-size=\"12\"");
    return out + "</svg>\n";
}

std::optional<WorstTickRuns> worst_tick_runs(const std::vector<Record>& records) {
    if (records.empty()) return std::nullopt;
    const Draft draft(records);
    const std::vector<ResponseRow> rows = response_rows(draft);
    const Headline headline = headline_of(rows);
    if (headline.first == nullptr) return std::nullopt;
    const Method& first = headline.first->who.front();
    const Method& other = (headline.other == nullptr ? headline.first : headline.other)->who.front();
    std::optional<WorstTickRuns> chosen;
    std::pair<bool, double> best{false, -1.0};
    for (const std::string& scene : draft.results.scenes("closed_loop")) {
        const SceneResult* ours = draft.results.find(first, scene);
        const SceneResult* theirs = draft.results.find(other, scene);
        if (ours == nullptr || theirs == nullptr || !ours->ok() || !theirs->ok()) continue;
        const double our_depth = ours->runs.front()[Metric::residual_penetration_max_m];
        const double their_depth = theirs->runs.front()[Metric::residual_penetration_max_m];
        if (std::isnan(our_depth) || std::isnan(their_depth)) continue;
        const std::pair rank{!std::isnan(theirs->runs.front()[Metric::force_error_rms_hard]),
                             std::max(our_depth, their_depth)};
        if (rank <= best) continue;
        best = rank;
        chosen = WorstTickRuns{.first = ours->runs.front().record,
                               .other = headline.other == nullptr ? nullptr : theirs->runs.front().record,
                               .first_is_deeper = our_depth >= their_depth,
                               .first_name = response_name(first),
                               .other_name = headline.other == nullptr ? "" : response_name(other)};
    }
    return chosen;
}

void add_worst_tick(Draft& draft, const std::string& worst_tick) {
    if (worst_tick.empty()) {
        if (worst_tick_runs(draft.records)) {
            draft.paragraph(fmt::format("No picture of the worst tick lies beside these records; it is made by {}.",
                                        code("trocar report reports/" + draft.study + " --picture")),
                            Paragraph::Style::small);
        }
        return;
    }
    const WorstTick seen = worst_tick_from_json(worst_tick, worst_tick_file);
    draft.drawing(
        "worst_tick", draw(seen),
        fmt::format("{} at its worst tick ({}, {} s), cut through the deepest place. Rings: the vertices whose places "
                    "the stored solution of hard contact holds, projected onto the cut.",
                    code(seen.scene), seen.tick, format_number(seen.time)));
    LineChart force;
    force.x_title = "time (s)";
    force.y_title = "tool force (N)";
    force.small = true;
    for (const WorstTick::Curve& curve : seen.force) {
        const int style = static_cast<int>(force.lines.size());
        force.lines.push_back(
            {.name = without_code(curve.name), .colour = style, .dash = style, .points = curve.points});
    }
    draft.figure("worst_tick_force", force, "The force on the tool over the same run.");
}

}  // namespace trocar
