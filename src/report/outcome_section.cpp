#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "report/metric_table.hpp"

namespace trocar {
namespace {

/// How a run stands 200 ms after the tool has come to rest, the worst last.
enum class Settled { ends_before, cleared, torn, not_cleared };

Settled settled(const RunFigures& run) {
    if (std::isnan(run[Metric::residual_penetration_settled_m])) return Settled::ends_before;
    if (run[Metric::residual_penetration_settled_m] <= clear_depth) return Settled::cleared;
    return run[Metric::ruptures] > 0.0 ? Settled::torn : Settled::not_cleared;
}

std::string settled_text(const RunFigures& run) {
    switch (settled(run)) {
        case Settled::ends_before:
            return "run ends before";
        case Settled::cleared:
            return "cleared";
        case Settled::torn:
            return "rupture reported";
        case Settled::not_cleared:
            break;
    }
    if (!(run[Metric::wrong_side_vertices_last] > 0.0)) return "not cleared";
    return fmt::format("not cleared: {} vertices stay on the wrong side, no rupture reported",
                       count_text(run[Metric::wrong_side_vertices_last]));
}

std::string hard_reference_text(const RunFigures& run) {
    return yes_no(run[Metric::reference_clears_hard], "no reference");
}

std::string uncleared_text(const RunFigures& run) { return yes_no(run[Metric::uncleared], unknown_text); }

std::string wrong_side_text(const RunFigures& run) {
    return count_text(run[Metric::wrong_side_vertices_max]) + " / " +
           count_text(run[Metric::wrong_side_vertices_last]) + undecided_text(run[Metric::side_undecided_max]);
}

/// One response on one scene, over the detectors of the study. Precondition: at least one result.
const RunFigures& worst_of(const ResultSet& results) {
    const auto rank = [](const SceneResult* result) {
        const RunFigures& run = result->runs.front();
        return std::pair(settled(run), run[Metric::residual_penetration_settled_m]);
    };
    return (*std::max_element(results.results.begin(), results.results.end(),
                              [&rank](const SceneResult* a, const SceneResult* b) { return rank(a) < rank(b); }))
        ->runs.front();
}

std::string settled_cell(const ResultSet& results) {
    if (results.results.empty()) return "not run";
    const RunFigures& worst = worst_of(results);
    const bool cleared = settled(worst) == Settled::cleared;
    return fmt::format("{} ({} mm {})", settled_text(worst),
                       scaled(cleared ? results.largest(Metric::residual_penetration_max_m)
                                      : worst[Metric::residual_penetration_settled_m],
                              mm),
                       cleared ? "at worst before" : "residual");
}

/// Response by scene at a glance.
Table settled_matrix(const Draft& draft) {
    std::map<Method, std::map<std::string, ResultSet>> by_response;
    for (Method method : draft.results.methods("closed_loop")) {
        // What a blind or half blind detector costs stands under "lost by the detector".
        if (draft.results.fact(method, "detector.control") == "yes") continue;
        const ResultSet results = possible(draft.results, method).ok();
        method.detector.clear();
        for (const SceneResult* result : results.results) {
            if (settled(result->runs.front()) != Settled::ends_before)
                by_response[method][result->scene()].results.push_back(result);
        }
    }
    Table table;
    table.caption = "Which scenes are clear 200 ms after the last key of the motion";
    if (by_response.empty()) return table;
    table.columns = {{"response", false}};
    table.rows.push_back({.cells = {"hard contact, within the strain limit"}});
    for (const auto& [response, scenes] : by_response) table.rows.push_back({.cells = {response_name(response)}});
    for (const std::string& scene : draft.results.scenes("closed_loop")) {
        std::vector<std::string> cells{""};
        for (auto& [response, scenes] : by_response) {
            const ResultSet& results = scenes[scene];
            if (!results.results.empty()) cells[0] = hard_reference_text(worst_of(results));
            cells.push_back(settled_cell(results));
        }
        if (cells[0].empty()) continue;
        table.columns.push_back({scene, false});
        for (std::size_t i = 0; i < cells.size(); ++i) table.rows[i].cells.push_back(std::move(cells[i]));
    }
    table.note =
        "The worst over the detectors of the study, controls left out. Cleared: at most 0.1 mm on every judged tick "
        "from 200 ms after the last key on; in brackets the largest residual penetration before. A scene that hard "
        "contact itself does not clear within the strain limit ends well only with a rupture reported. Runs that end "
        "before are left out.";
    return table;
}

/// Depth 200 ms after the tool has come to rest, and why it is what it is.
MetricTable settled_table() {
    return {.caption = "200 ms after the last key of the motion, motion by motion",
            .mode = "closed_loop",
            .rows = MetricTable::Rows::motion,
            .columns = {value_column("residual penetration (mm)", Metric::residual_penetration_settled_m, mm),
                        text_column("hard contact clears it within the strain limit", Metric::reference_clears_hard,
                                    hard_reference_text),
                        count_column("ruptures", Metric::ruptures),
                        text_column("verdict", Metric::residual_penetration_settled_m, settled_text)},
            .keep = [](const RunFigures& run) { return settled(run) != Settled::ends_before; }};
}

MetricTable clearing_table() {
    return {
        .caption = "Clearing",
        .mode = "closed_loop",
        .rows = MetricTable::Rows::motion,
        .columns = {two_column("ticks to clear, median / max", Metric::ticks_to_clear_median,
                               Metric::ticks_to_clear_max),
                    text_column("residual at the end", Metric::uncleared, uncleared_text),
                    count_column("re-penetrations", Metric::re_penetrations),
                    value_column("overshoot, max (mm)", Metric::overshoot_max_m, mm),
                    text_column("wrong-side vertices, max / last", Metric::wrong_side_vertices_max, wrong_side_text),
                    value_column("overlap volume, max (mm³)", Metric::overlap_volume_max_m3, mm * mm * mm),
                    value_column("minimum translation, max (mm)", Metric::min_translation_max_m, mm),
                    value_column("strain over the limit, max", Metric::strain_over_max)},
        .note =
            "Ticks to clear: from the first tick of a spell to the first clear one; n/a: no spell ended. "
            "Overshoot: gap within 20 ticks after a depth, less what scripts moved. Overlap volume and minimum "
            "translation (over 26 directions) need two closed bodies."};
}

MetricTable signal_table() {
    return {.caption = "Force quality and audit",
            .mode = "closed_loop",
            .rows = MetricTable::Rows::motion,
            .columns = {two_column("force error, worst, equal k / hard (N)", Metric::force_error_worst_equal_k,
                                   Metric::force_error_worst_hard, "no reference"),
                        two_column("force above 30 Hz, RMS (N) / share", Metric::force_above_30hz_rms_n,
                                   Metric::force_above_30hz_share),
                        count_column("direction flips (ticks)", Metric::force_flips),
                        value_column("momentum error (share)", Metric::momentum_residual_share),
                        value_column("energy error (share)", Metric::energy_residual_share)},
            .note =
                "Before any filter. Momentum error: largest momentum at any time that the audit of tissue and "
                "operators does not account for, over the summed impulses. Energy error: the same of energy, over "
                "all energy entered; n/a where nothing yields."};
}

}  // namespace

void add_outcome(Draft& draft) {
    if (draft.results.methods("closed_loop").empty()) return;
    draft.heading(2, "Residual penetration and strain");
    draft.paragraph(
        "All from geometry on the frame after the step, never from a response's own words. A spell is a stretch of "
        "ticks with more than 0.1 mm of depth; its length is known to the judged ticks. Scripts that hold the tool in "
        "the tissue make long spells for every response: compare rows of one scene.");
    Table clearing = table_of(draft, clearing_table());
    note_undecided(draft, clearing);
    draft.add(std::move(clearing));
    draft.add(table_of(draft, signal_table()));
    draft.add(settled_matrix(draft));
    draft.add(table_of(draft, settled_table()));
}

}  // namespace trocar
