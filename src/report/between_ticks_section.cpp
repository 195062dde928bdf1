// What a detector that examines frames never sees: contacts that come and go between two of them, held against the
// space-time oracle. The share missed is shown against the tick in units of the contact's own length, which is
// v·dt / thickness for a body that crosses another.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "geometry/whole_file.hpp"
#include "report/chart.hpp"
#include "report/sections.hpp"

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

std::string microseconds(double seconds) { return format_number(seconds * 1e6); }

/// One scene: who missed how much, and the share against v·dt / thickness.
void add_scene(Draft& draft, const std::string& scene, const std::vector<const Record*>& runs) {
    Table table;
    table.caption = fmt::format("Contacts between frames, scene {}", scene);
    table.columns = {{"detector", false},
                     {"contacts of bodies", true},
                     {"never reported", true},
                     {"onset latency median (µs)", true},
                     {"onset latency max (µs)", true},
                     {"pairs that begin", true},
                     {"not reported", true},
                     {"reported and not true", true},
                     {"worst time error (ticks)", true}};
    Table by_ratio;
    by_ratio.caption = fmt::format("Share of the contacts missed against v·dt / thickness, scene {}", scene);
    by_ratio.columns = {{"detector", false}};
    LineChart chart{.x_title = "v·dt / thickness (length of a tick / length of the contact)",
                    .y_title = "share of the contacts missed",
                    .lines = {},
                    .steps = false,
                    .log_x = true};
    Shares first_shares{};
    bool have_shares = false;
    std::vector<std::pair<std::string, Shares>> all;
    for (const Record* record : runs) {
        const std::string& name = record->spec.detector;
        if (!record->outcome.ok()) {
            TableRow row{.cells = {code(name)}, .style = TableRow::Style::failed};
            for (std::size_t i = 1; i < table.columns.size(); ++i) row.cells.emplace_back("n/a");
            row.cells.back() = outcome_text(record->outcome);
            table.rows.push_back(row);
            continue;
        }
        const bool own = draft.results.fact({record->spec.mode, name, record->spec.response, record->spec.contacts,
                                             record->spec.stepper},
                                            "detector.own") == "yes";
        const auto count = [record](Metric metric) { return count_text(summary_of(*record, metric)); };
        table.rows.push_back(
            {.cells = {code(name), count(Metric::contact_events), count(Metric::contact_events_missed),
                       microseconds(summary_of(*record, Metric::onset_latency_median_s)),
                       microseconds(summary_of(*record, Metric::onset_latency_max_s)), count(Metric::true_swept),
                       count(Metric::swept_false_negatives), count(Metric::swept_false_positives),
                       format_number(summary_of(*record, Metric::swept_time_error_max))},
             .style = own ? TableRow::Style::own : TableRow::Style::normal});
        Shares shares{};
        add_events(*record, shares);
        if (!have_shares) first_shares = shares;
        have_shares = true;
        all.emplace_back(name, shares);
    }
    draft.add(table);
    if (!have_shares) return;
    std::vector<std::size_t> bins;
    for (std::size_t bin = 0; bin < bin_count; ++bin) {
        if (first_shares.at(bin).events == 0.0) continue;
        bins.push_back(bin);
        by_ratio.columns.push_back({bin_name(bin), true});
    }
    TableRow chance{.cells = {"one sample per tick, by chance"}};
    TableRow events{.cells = {"contacts"}};
    const auto after_all = static_cast<int>(all.size());
    LineChart::Line expectation{
        .name = "one sample per tick, by chance", .colour = after_all, .dash = after_all, .points = {}};
    for (const std::size_t bin : bins) {
        const Share& share = first_shares.at(bin);
        chance.cells.push_back(format_number(share.expected / share.events));
        events.cells.push_back(count_text(share.events));
        expectation.points.emplace_back(std::exp2(share.log_ratio / share.events), share.expected / share.events);
    }
    by_ratio.rows.push_back(events);
    by_ratio.rows.push_back(chance);
    chart.lines.push_back(expectation);
    int colour = 0;
    for (const auto& [name, shares] : all) {
        TableRow row{.cells = {code(name)}};
        LineChart::Line line{.name = name, .colour = colour, .dash = colour, .points = {}};
        for (const std::size_t bin : bins) {
            const Share& share = shares.at(bin);
            const double missed = share.events > 0.0 ? share.missed / share.events : not_known;
            row.cells.push_back(format_number(missed));
            line.points.emplace_back(std::exp2(share.log_ratio / std::max(1.0, share.events)), missed);
        }
        by_ratio.rows.push_back(row);
        chart.lines.push_back(line);
        ++colour;
    }
    by_ratio.note =
        "Columns: length of a tick over length of the contact, both from the space-time oracle, in bins of a factor of "
        "two; for a body that crosses another this is v·dt / thickness. By chance: one sample at the end of each tick "
        "finds a contact that lasts a part p of a tick with probability p, so 1 - p are missed.";
    draft.add(by_ratio);
    draft.figure("between_ticks_" + file_word(scene), chart,
                 fmt::format("Scene {}: share of the contacts that a detector never reports", scene));
}

}  // namespace

void add_between_ticks(Draft& draft) {
    std::vector<std::string> scenes;
    for (const Record& record : draft.records) {
        if (!record.spec.between_ticks || record.spec.repetition > 0 || record.spec.scene.empty()) continue;
        if (std::find(scenes.begin(), scenes.end(), record.spec.scene) == scenes.end()) {
            scenes.push_back(record.spec.scene);
        }
    }
    if (scenes.empty()) return;
    std::sort(scenes.begin(), scenes.end());
    draft.heading(2, "Between the ticks");
    draft.paragraph(
        "Held against exact vertex-face and edge-edge tests along the straight motion of every tick, which no detector "
        "takes part in. A contact of two bodies lasts from their first touch until they are apart; onset latency runs "
        "from that first touch to the frame at which the detector first reports it. Pairs that begin are triangles "
        "apart at one frame that touch before or at the next; they count as reported when they are a pair of the frame "
        "after or when the detector's continuous test names them.");
    for (const std::string& scene : scenes) {
        std::vector<const Record*> runs;
        for (const Record& record : draft.records) {
            if (record.spec.between_ticks && record.spec.repetition == 0 && record.spec.scene == scene) {
                runs.push_back(&record);
            }
        }
        std::stable_sort(runs.begin(), runs.end(),
                         [](const Record* a, const Record* b) { return a->spec.detector < b->spec.detector; });
        add_scene(draft, scene, runs);
    }
}

}  // namespace trocar
