#include "report/sections.hpp"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>

namespace trocar {
namespace {

std::string two(double first, double second, double scale = 1.0) {
    if (std::isnan(first) && std::isnan(second)) return "n/a";
    return scaled(first, scale) + " / " + scaled(second, scale);
}

using Cells = std::function<std::vector<std::string>(const RunFigures&)>;

/// Methods on one scene that moved alike, bit by bit.
struct Motion {
    const RunFigures* run = nullptr;  ///< of the first method, first process
    std::vector<const Method*> methods;
};

/// The different motions of the closed-loop runs that ended well, in the order of `methods`, which they point into.
std::vector<Motion> motions_of(const Draft& draft, const std::string& scene, const std::vector<Method>& methods) {
    std::vector<Motion> motions;
    for (const Method& method : methods) {
        const SceneResult* result = draft.results.find(method, scene);
        if (result == nullptr || !result->ok()) continue;
        const RunFigures& run = result->runs.front();
        const auto found = std::find_if(motions.begin(), motions.end(),
                                        [&run](const Motion& motion) { return same_motion(*motion.run, run); });
        if (found == motions.end()) {
            motions.push_back({&run, {&method}});
        } else {
            found->methods.push_back(&method);
        }
    }
    return motions;
}

/// "`fcl_bvh + penalty (intersection)`, moving alike: `ohc`"
std::string who_text(const Motion& motion) {
    const Method& first = *motion.methods.front();
    std::string text = code(first.label());
    for (std::size_t i = 1; i < motion.methods.size(); ++i) {
        const Method& other = *motion.methods[i];
        text +=
            (i == 1 ? ", moving alike: " : ", ") +
            code(other.contacts == first.contacts && other.response == first.response ? other.detector : other.label());
    }
    return text;
}

/// One row per different motion.
Table rows_per_motion(const Draft& draft, const std::string& caption, const std::vector<Column>& columns,
                      const Cells& cells_of) {
    Table table;
    table.caption = caption;
    table.folded = true;
    table.columns = {{"class", false}, {"scene", false}, {"detector + response (contact generator)", false}};
    table.columns.insert(table.columns.end(), columns.begin(), columns.end());
    const std::vector<Method> methods = draft.results.methods("closed_loop");
    for (const auto& [name, scenes] : draft.scenes_by_class()) {
        for (const std::string& scene : scenes) {
            for (const Motion& motion : motions_of(draft, scene, methods)) {
                std::vector<std::string> cells{name, scene, who_text(motion)};
                const std::vector<std::string> figures = cells_of(*motion.run);
                cells.insert(cells.end(), figures.begin(), figures.end());
                table.rows.push_back({.cells = std::move(cells)});
            }
        }
    }
    return table;
}

/// How a run stands 200 ms after the tool has come to rest, the worst last.
enum class Settled { ends_before, cleared, torn, not_cleared };

Settled settled(const RunFigures& run) {
    constexpr double cleared = 1.0e-4;  // m
    if (std::isnan(run[Metric::residual_penetration_settled_m])) return Settled::ends_before;
    if (run[Metric::residual_penetration_settled_m] <= cleared) return Settled::cleared;
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
    return std::isnan(run[Metric::reference_clears_hard]) ? "no reference"
                                                          : yes_no(run[Metric::reference_clears_hard] > 0.0);
}

/// One response on one scene, over the detectors of the study.
struct WorstOfDetectors {
    const RunFigures* settled = nullptr;
    double residual_penetration_max_m = not_known;  ///< m, of the whole run
};

/// By response (and contact generator), then scene; runs that end too early are left out.
std::map<std::string, std::map<std::string, WorstOfDetectors>> worst_of_detectors(const Draft& draft) {
    std::map<std::string, std::map<std::string, WorstOfDetectors>> all;
    const auto rank = [](const RunFigures& run) {
        return std::pair(settled(run), run[Metric::residual_penetration_settled_m]);
    };
    for (const Method& method : draft.results.methods("closed_loop")) {
        // What a blind or half blind detector costs stands under "lost by the detector".
        if (draft.results.fact(method, "detector.control") == "yes") continue;
        for (const std::string& scene : draft.results.scenes("closed_loop")) {
            const SceneResult* result = draft.results.find(method, scene);
            if (result == nullptr || !result->ok()) continue;
            const RunFigures& run = result->runs.front();
            if (settled(run) == Settled::ends_before) continue;
            WorstOfDetectors& worst =
                all[method.response + " (" + method.contacts + ")" + by_stepper(method.stepper)][scene];
            worst.residual_penetration_max_m =
                std::fmax(worst.residual_penetration_max_m, run[Metric::residual_penetration_max_m]);
            // The figures live in the results, as long as the draft.
            if (worst.settled == nullptr || rank(*worst.settled) < rank(run)) worst.settled = &run;
        }
    }
    return all;
}

/// Scene by response at a glance.
Table settled_matrix(const Draft& draft) {
    Table table;
    table.caption = "Which scenes are clear 200 ms after the last key of the motion";
    table.columns = {{"scene", false},
                     {"hard contact clears it within the strain limit", false, Metric::reference_clears_hard}};
    const auto worst = worst_of_detectors(draft);
    for (const auto& [response, scenes] : worst) table.columns.push_back({code(response), false});
    for (const std::string& scene : draft.results.scenes("closed_loop")) {
        std::vector<std::string> cells{scene, ""};
        for (const auto& [response, scenes] : worst) {
            const auto found = scenes.find(scene);
            if (found == scenes.end()) {
                cells.emplace_back("not run");
                continue;
            }
            const RunFigures& run = *found->second.settled;
            cells[1] = hard_reference_text(run);
            const bool cleared = settled(run) == Settled::cleared;
            cells.push_back(fmt::format(
                "{} ({} mm {})", settled_text(run),
                scaled(cleared ? found->second.residual_penetration_max_m : run[Metric::residual_penetration_settled_m],
                       mm),
                cleared ? "at worst before" : "residual"));
        }
        if (!cells[1].empty()) table.rows.push_back({.cells = std::move(cells)});
    }
    table.note =
        "The worst over the detectors of the study, controls left out. Cleared: at most 0.1 mm on every judged tick "
        "from 200 ms after the last key on; in brackets the largest residual penetration before. A scene that hard "
        "contact itself does not clear within the strain limit ends well only with a rupture reported. Runs that end "
        "before are left out.";
    return table;
}

/// Depth 200 ms after the tool has come to rest, and why it is what it is.
Table settled_table(const Draft& draft) {
    Table table =
        rows_per_motion(draft, "200 ms after the last key of the motion, motion by motion",
                        {{"residual penetration (mm)", true},
                         {"hard contact clears it within the strain limit", false, Metric::reference_clears_hard},
                         {"ruptures", true, Metric::ruptures},
                         {"verdict", false}},
                        [](const RunFigures& run) -> std::vector<std::string> {
                            return {scaled(run[Metric::residual_penetration_settled_m], mm), hard_reference_text(run),
                                    count_text(run[Metric::ruptures]), settled_text(run)};
                        });
    std::erase_if(table.rows, [](const TableRow& row) { return row.cells.back() == "run ends before"; });
    return table;
}

}  // namespace

void add_outcome(Draft& draft) {
    if (draft.results.methods("closed_loop").empty()) return;
    draft.heading(2, "Residual penetration and strain");
    draft.paragraph(
        "All from geometry on the frame after the step, never from a response's own words. A spell is a stretch of "
        "ticks with more than 0.1 mm of depth; its length is known to the judged ticks. Scripts that hold the tool in "
        "the tissue make long spells for every response: compare rows of one scene.");
    bool any_undecided = false;
    Table clearing =
        rows_per_motion(draft, "Clearing",
                        {{"ticks to clear, median / max", true, Metric::ticks_to_clear_max},
                         {"residual at the end", false, Metric::residual_penetration_final_m},
                         {"re-penetrations", true, Metric::re_penetrations},
                         {"overshoot, max (mm)", true, Metric::overshoot_max_m},
                         {"wrong-side vertices, max / last", true, Metric::wrong_side_vertices_max},
                         {"overlap volume, max (mm³)", true, Metric::overlap_volume_max_m3},
                         {"minimum translation, max (mm)", true, Metric::min_translation_max_m},
                         {"strain over the limit, max", true, Metric::strain_over_max}},
                        [&any_undecided](const RunFigures& run) -> std::vector<std::string> {
                            any_undecided = any_undecided || run[Metric::side_undecided_max] > 0.0;
                            return {two(run[Metric::ticks_to_clear_median], run[Metric::ticks_to_clear_max]),
                                    std::isnan(run[Metric::uncleared]) ? "n/a" : yes_no(run[Metric::uncleared] > 0.0),
                                    count_text(run[Metric::re_penetrations]),
                                    scaled(run[Metric::overshoot_max_m], mm),
                                    count_text(run[Metric::wrong_side_vertices_max]) + " / " +
                                        count_text(run[Metric::wrong_side_vertices_last]) +
                                        undecided_text(run[Metric::side_undecided_max]),
                                    scaled(run[Metric::overlap_volume_max_m3], mm * mm * mm),
                                    scaled(run[Metric::min_translation_max_m], mm),
                                    scaled(run[Metric::strain_over_max])};
                        });
    clearing.note =
        "Ticks to clear: from the first tick of a spell to the first clear one; n/a: no spell ended. Overshoot: gap "
        "within 20 ticks after a depth, less what scripts moved. Overlap volume and minimum translation (over 26 "
        "directions) need two closed bodies.";
    if (any_undecided) clearing.note += " " + std::string(undecided_note);
    draft.add(std::move(clearing));
    Table signal = rows_per_motion(
        draft, "Force quality and audit",
        {{"force error, worst, equal k / hard (N)", true, Metric::force_error_worst_equal_k},
         {"force above 30 Hz, RMS (N) / share", true, Metric::force_above_30hz_rms_n},
         {"direction flips (ticks)", true, Metric::force_flips},
         {"momentum error (share)", true, Metric::momentum_residual_share},
         {"energy error (share)", true, Metric::energy_residual_share}},
        [](const RunFigures& run) -> std::vector<std::string> {
            const bool reference =
                !std::isnan(run[Metric::force_error_worst_equal_k]) || !std::isnan(run[Metric::force_error_worst_hard]);
            return {reference ? two(run[Metric::force_error_worst_equal_k], run[Metric::force_error_worst_hard])
                              : "no reference",
                    two(run[Metric::force_above_30hz_rms_n], run[Metric::force_above_30hz_share]),
                    count_text(run[Metric::force_flips]), scaled(run[Metric::momentum_residual_share]),
                    scaled(run[Metric::energy_residual_share])};
        });
    signal.note =
        "Before any filter. Momentum error: largest momentum at any time that the audit of tissue and operators does "
        "not account for, over the summed impulses. Energy error: the same of energy, over all energy entered; n/a "
        "where nothing yields.";
    draft.add(std::move(signal));
    draft.add(settled_matrix(draft));
    draft.add(settled_table(draft));
}

}  // namespace trocar
