#include "report/sections.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>

namespace trocar {
namespace {

std::string scaled(double value, double scale = 1.0) {
    return std::isnan(value) ? std::string("n/a") : format_number(value * scale);
}

std::string two(double first, double second, double scale = 1.0) {
    if (std::isnan(first) && std::isnan(second)) return "n/a";
    return scaled(first, scale) + " / " + scaled(second, scale);
}

using Cells = std::function<std::vector<std::string>(const RunFigures&)>;

/// One row per closed-loop run that ended well (first process); runs with the same motion are told once.
Table rows_per_run(const Draft& draft, const std::string& caption, const std::vector<Column>& columns,
                   const Cells& cells_of) {
    Table table;
    table.caption = caption;
    table.folded = true;
    table.columns = {{"class", false}, {"scene", false}, {"detector + response (contact source)", false}};
    table.columns.insert(table.columns.end(), columns.begin(), columns.end());
    for (const auto& [name, scenes] : draft.scenes_by_class()) {
        for (const std::string& scene : scenes) {
            std::map<std::string, std::string> seen;  // response and state hash -> label
            for (const Contestant& contestant : draft.results.contestants("closed_loop")) {
                const SceneResult* result = draft.results.find(contestant, scene);
                if (result == nullptr || !result->ok()) continue;
                const RunFigures& run = result->runs.front();
                std::vector<std::string> cells{name, scene, code(contestant.label())};
                const std::string& hash = run.record->state_hash;
                const auto [twin, is_new] = seen.try_emplace(contestant.response + hash, contestant.label());
                if (!hash.empty() && !is_new) {
                    cells.push_back("identical to " + code(twin->second));
                    cells.resize(table.columns.size());
                } else {
                    const std::vector<std::string> figures = cells_of(run);
                    cells.insert(cells.end(), figures.begin(), figures.end());
                }
                table.rows.push_back({.cells = std::move(cells)});
            }
        }
    }
    return table;
}

/// Depth 200 ms after the tool has come to rest, and why it is what it is.
Table settled_table(const Draft& draft) {
    constexpr double cleared = 1.0e-4;  // m
    Table table =
        rows_per_run(draft, "200 ms after the last key of the motion",
                     {{"left (mm)", true},
                      {"hard reference clears it within the strain limit", false},
                      {"ruptures", true},
                      {"verdict", false}},
                     [](const RunFigures& run) -> std::vector<std::string> {
                         const bool known = !std::isnan(run.reference_clears);
                         const std::string can = known ? yes_no(run.reference_clears > 0.0) : "no reference";
                         std::string verdict = "not cleared";
                         if (std::isnan(run.left_settled)) {
                             verdict = "run ends before";
                         } else if (run.left_settled <= cleared) {
                             verdict = "cleared";
                         } else if (run.ruptures > 0.0) {
                             verdict = "rupture told";
                         } else if (run.wrong_vertices_last > 0.0) {
                             verdict = fmt::format("not cleared: {} vertices stay on the wrong side, no rupture told",
                                                   count_text(run.wrong_vertices_last));
                         }
                         return {scaled(run.left_settled, mm), can, count_text(run.ruptures), verdict};
                     });
    std::erase_if(table.rows, [](const TableRow& row) { return row.cells.back() == "run ends before"; });
    table.note =
        "Cleared: at most 0.1 mm on every judged tick from 200 ms after the last key on. Runs that end before "
        "that are left out.";
    return table;
}

}  // namespace

void add_outcome(Draft& draft) {
    if (draft.results.contestants("closed_loop").empty()) return;
    draft.heading(2, "What is left behind, and what it costs");
    draft.paragraph(
        "All from geometry on the frame after the step, never from a response's own words. A spell is a stretch of "
        "ticks with more than 0.1 mm of depth; its length is known to the judged ticks. Scripts that hold the tool in "
        "the tissue make long spells for every response: compare rows of one scene.");
    Table clearing =
        rows_per_run(draft, "Clearing",
                     {{"ticks to clear, median / max", true},
                      {"left at the end", false},
                      {"re-penetrations", true},
                      {"overshoot, max (mm)", true},
                      {"wrong-side vertices, max / last", true},
                      {"overlap volume, max (mm³)", true},
                      {"minimum translation, max (mm)", true},
                      {"strain over the limit, max", true}},
                     [](const RunFigures& run) -> std::vector<std::string> {
                         return {two(run.ticks_to_clear_p50, run.ticks_to_clear_max),
                                 std::isnan(run.uncleared) ? "n/a" : yes_no(run.uncleared > 0.0),
                                 count_text(run.re_penetrations),
                                 scaled(run.overshoot, mm),
                                 count_text(run.wrong_vertices_max) + " / " + count_text(run.wrong_vertices_last),
                                 scaled(run.overlap_volume, mm * mm * mm),
                                 scaled(run.min_translation, mm),
                                 scaled(run.strain_over)};
                     });
    clearing.note =
        "Ticks to clear: from the first tick of a spell to the first clear one; n/a: no spell ended. Overshoot: gap "
        "within 20 ticks after a depth, less what scripts moved. Overlap volume and minimum translation (over 26 "
        "directions) need two closed bodies.";
    draft.add(std::move(clearing));
    Table signal = rows_per_run(
        draft, "The haptic signal and its books",
        {{"force error, worst, equal k / hard (N)", true},
         {"force above 30 Hz, RMS (N) / share", true},
         {"direction flips (ticks)", true},
         {"momentum error, worst spell (share)", true},
         {"energy created, worst spell (share)", true},
         {"net work on a closed path (mJ)", true},
         {"most energy given to the hand (mJ)", true}},
        [](const RunFigures& run) -> std::vector<std::string> {
            constexpr double mj = 1.0e3;
            const bool reference = !std::isnan(run.force_worst_equal_k) || !std::isnan(run.force_worst_hard);
            return {reference ? two(run.force_worst_equal_k, run.force_worst_hard) : "no reference",
                    two(run.force_fast_rms, run.force_fast_share),
                    count_text(run.force_flips),
                    scaled(run.momentum_share),
                    scaled(run.energy_share),
                    scaled(run.net_work, mj),
                    scaled(run.energy_given, mj)};
        });
    signal.note =
        "Before any filter. Momentum error: what one side of a contact gained and the other did not lose, over the "
        "summed impulse. Energy created: what tissue and instruments gained together, dampers left out, over the "
        "summed "
        "work; n/a where an instrument turns. Net work above 0: the contact feeds the hand.";
    draft.add(std::move(signal));
    draft.add(settled_table(draft));
}

}  // namespace trocar
