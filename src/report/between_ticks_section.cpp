// What a detector that examines frames never sees: contacts that come and go between two of them, held against the
// space-time oracle. The share missed is shown against the tick in units of the contact's own length, which is
// v·dt / thickness for a body that crosses another.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "geometry/whole_file.hpp"
#include "report/chart.hpp"
#include "report/metric_table.hpp"

namespace trocar {
namespace {

/// Factor-of-two bins around powers of two: [2^(k-1/2), 2^(k+1/2)).
constexpr int lowest_bin = -3;
constexpr int highest_bin = 5;
constexpr std::size_t bin_count = highest_bin - lowest_bin + 1;

struct Share {
    double events = 0;
    double missed = 0;
    double expected = 0;  ///< sum of the chances that one sample per tick misses, at a random moment
    double log_ratio = 0;
};
using Shares = std::array<Share, bin_count>;

/// Seconds per tick of the run, from its rows.
double tick_length(const Record& record) {
    for (const StepRow& row : record.rows) {
        if (row.tick > 0) return row.time / static_cast<double>(row.tick);
    }
    return not_known;
}

void add_events(const Record& record, Shares& shares) {
    const double dt = tick_length(record);
    for (const ContactEvent& event : record.events) {
        const double ratio = dt / (event.end - event.begin);
        if (std::isnan(ratio)) continue;  // did not end
        const double bin = std::clamp(std::round(std::log2(ratio)), double{lowest_bin}, double{highest_bin});
        Share& share = shares.at(static_cast<std::size_t>(static_cast<int>(bin) - lowest_bin));
        share.events += 1;
        share.missed += event.missed() ? 1.0 : 0.0;
        constexpr double rounding = 1e-9;  // a contact of exactly one tick is never missed
        const double chance = 1.0 - 1.0 / ratio;
        share.expected += chance > rounding ? chance : 0.0;
        share.log_ratio += std::log2(std::min(ratio, std::exp2(highest_bin)));
    }
}

std::string bin_name(std::size_t bin) {
    const int exponent = static_cast<int>(bin) + lowest_bin;
    const std::string value = exponent < 0 ? fmt::format("1/{}", 1 << -exponent) : std::to_string(1 << exponent);
    if (exponent == lowest_bin) return "≤ " + value;
    return (exponent == highest_bin ? "≥ " : "") + value;
}

Table contacts_table(const Draft& draft, const std::string& scene, const ResultSet& runs) {
    constexpr double second = 1.0e6;  // to µs
    const std::vector<MetricColumn> columns{
        count_column("contacts of bodies", Metric::contact_events),
        count_column("never reported", Metric::contact_events_missed),
        value_column("onset latency median (µs)", Metric::onset_latency_median_s, second),
        value_column("onset latency max (µs)", Metric::onset_latency_max_s, second),
        count_column("pairs that begin", Metric::true_swept),
        count_column("not reported", Metric::swept_false_negatives),
        count_column("reported and not true", Metric::swept_false_positives),
        value_column("worst time error (ticks)", Metric::swept_time_error_max)};
    std::vector<MetricRow> rows;
    for (const SceneResult* result : runs.results) {
        const Method method = method_of(result->record().spec);
        rows.push_back({.names = {code(method.detector)},
                        .results = {{result}},
                        .failure = result->ok() ? nullptr : &result->failure(),
                        .style = draft.results.fact(method, "detector.own") == "yes" ? TableRow::Style::own
                                                                                     : TableRow::Style::normal});
    }
    return table_of(
        {.caption = fmt::format("Contacts between frames, scene {}", scene), .columns = {{"detector", false}}}, columns,
        rows);
}

/// One scene: who missed how much, and the share against v·dt / thickness.
void add_scene(Draft& draft, const std::string& scene, const ResultSet& runs) {
    draft.add(contacts_table(draft, scene, runs));
    std::vector<std::pair<std::string, Shares>> all;
    for (const SceneResult* result : runs.ok().results) {
        all.emplace_back(result->record().spec.detector, Shares{});
        add_events(result->record(), all.back().second);
    }
    if (all.empty()) return;
    LineChart chart{.x_title = "v·dt / thickness (length of a tick / length of the contact)",
                    .y_title = "share of the contacts missed",
                    .steps = false,
                    .log_x = true};
    Table by_ratio{.caption = fmt::format("Share of the contacts missed against v·dt / thickness, scene {}", scene),
                   .columns = {{"detector", false}},
                   .rows = {{.cells = {"contacts"}}}};
    const Shares& truth = all.front().second;
    const auto add_line = [&](const std::string& name, const std::string& cell, int style, const Shares& shares,
                              double Share::*part) {
        by_ratio.rows.push_back({.cells = {cell}});
        chart.lines.push_back({.name = name, .colour = style, .dash = style});
        for (std::size_t bin = 0; bin < bin_count; ++bin) {
            const Share& share = shares.at(bin);
            if (truth.at(bin).events == 0.0) continue;
            const double missed = share.events > 0.0 ? share.*part / share.events : not_known;
            by_ratio.rows.back().cells.push_back(scaled(missed));
            chart.lines.back().points.emplace_back(std::exp2(share.log_ratio / std::max(1.0, share.events)), missed);
        }
    };
    for (std::size_t bin = 0; bin < bin_count; ++bin) {
        if (truth.at(bin).events == 0.0) continue;
        by_ratio.columns.push_back({bin_name(bin), true});
        by_ratio.rows.front().cells.push_back(count_text(truth.at(bin).events));
    }
    constexpr const char* by_chance = "one sample per tick, by chance";
    add_line(by_chance, by_chance, static_cast<int>(all.size()), truth, &Share::expected);
    int style = 0;
    for (const auto& [name, shares] : all) add_line(name, code(name), style++, shares, &Share::missed);
    by_ratio.note =
        "Columns: length of a tick over length of the contact, both from the space-time oracle, in bins of a factor of "
        "two; for a body that crosses another this is v·dt / thickness. By chance: one sample at the end of each tick "
        "finds a contact that lasts a part p of a tick with probability p, so 1 - p are missed.";
    draft.add(std::move(by_ratio));
    draft.figure("between_ticks_" + file_word(scene), chart,
                 fmt::format("Scene {}: share of the contacts that a detector never reports", scene));
}

}  // namespace

void add_between_ticks(Draft& draft) {
    std::map<std::string, ResultSet> scenes;
    for (const char* mode : {"closed_loop", "replay"}) {
        for (const Method& method : draft.results.methods(mode)) {
            for (const SceneResult* result : possible(draft.results, method).results) {
                if (result->record().spec.between_ticks) scenes[result->scene()].results.push_back(result);
            }
        }
    }
    if (scenes.empty()) return;
    draft.heading(2, "Between the ticks");
    draft.paragraph(
        "Held against exact vertex-face and edge-edge tests along the straight motion of every tick, which no detector "
        "takes part in. A contact of two bodies lasts from their first touch until they are apart; onset latency runs "
        "from that first touch to the frame at which the detector first reports it. Pairs that begin are triangles "
        "apart at one frame that touch before or at the next; they count as reported when they are a pair of the frame "
        "after or when the detector's continuous test names them.");
    for (const auto& [scene, runs] : scenes) add_scene(draft, scene, runs);
}

}  // namespace trocar
