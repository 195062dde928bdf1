#include "report/sections.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>

namespace trocar {
namespace {

/// Where the depth that is left is the scene's own, since nothing but the contact gives way there.
std::string compliance_note(const Draft& draft) {
    std::vector<std::string> scenes;
    for (const auto& [name, list] : draft.scenes_by_class()) {
        if (name == "I2I" || name == "I2R") scenes.insert(scenes.end(), list.begin(), list.end());
    }
    if (scenes.empty() || draft.mode != "closed_loop") return {};
    return fmt::format(
        " On {} nothing but the contact gives way: there the residual penetration is the scene's own compliance, the "
        "force of the operator over the scene's k, which the reference of equal k has too; it is no error (the way "
        "from that reference is), and a method that leaves less is stiffer than the scene says.",
        joined(scenes));
}

/// n_sub of every scene: no time of a tick means anything without it.
std::string substeps_note(const Draft& draft) {
    if (draft.mode != "closed_loop") return {};
    std::map<double, std::set<std::string>> scenes;
    for (const RunFigures& run : draft.results.runs()) {
        const RunSpec& spec = run.record->spec;
        if (spec.mode == draft.mode && !std::isnan(run[Metric::substeps]))
            scenes[run[Metric::substeps]].insert(spec.scene);
    }
    std::vector<std::string> parts;
    parts.reserve(scenes.size());
    for (const auto& [substeps, names] : scenes) {
        parts.push_back(count_text(substeps) + " on " + joined({names.begin(), names.end()}));
    }
    return parts.empty() ? std::string()
                         : fmt::format(" Sub-steps of the integrator per tick (n_sub): {}.", fmt::join(parts, "; "));
}

/// Between judged ticks nobody has looked: a worst value is one of those that were.
std::string judged_note(const Draft& draft) {
    const std::int64_t stride = draft.widest_stride(draft.mode);
    const std::int64_t detail = draft.widest_stride(draft.mode, &RunSpec::detail_stride);
    std::string text =
        stride == 1 ? std::string(" Pairs and depths are judged on every tick")
                    : fmt::format(
                          " Pairs and depths are judged on every {}th tick (truth_stride of the study): a peak between "
                          "two of them is not seen, a single run (`trocar run`) judges every tick",
                          stride);
    if (detail > 1) {
        text += fmt::format(
            "; near pairs, depth errors of contacts and overlaps, by which nothing is ranked, on every {}th of these",
            detail);
    }
    return text + ".";
}

std::string verdict_note(const Draft& draft) {
    return "Error over scenes: the geometric mean of the residual penetrations at worst, each at least 1 µm; in I2I "
           "and I2R of the largest distance from the reference of equal stiffness. Grey: another row is at least as "
           "fast and has as small an error over scenes, and is better in one of the two. Times are geometric means "
           "over the scenes of the medians (p50) and 99 % values (p99) of a tick; a row that failed on a scene has "
           "none. Residual penetration: median over scenes / worst of all. Tears: ruptures reported, summed over the "
           "scenes; a depth in torn tissue counts like any other. Force errors: worst over the scenes whose reference "
           "can report; ≤: all lie within the references' own bound. " +
           draft.interval_note(draft.mode) +
           fmt::format(
               " Ratio: median tick over that of {} with the same response and contact generator (of native contacts: "
               "with intersection ones), process by process; {}. Moving alike: the same motion and forces on every "
               "scene, bit by bit; such rows stand once, with the tick p50 / p99 of each that is named. n/a = does "
               "not apply; \"no reference\" = no reference solution in this study.",
               code(draft.reference),
               std::isnan(draft.results.noise_floor())
                   ? "with one process per method the noise of the machine is not known, and ratios near 1 say "
                     "nothing"
                   : fmt::format("≈ = within the noise floor of {} (factor between processes of the same method, "
                                 "95 %)",
                                 format_number(draft.results.noise_floor()))) +
           judged_note(draft) + substeps_note(draft) + compliance_note(draft);
}

}  // namespace

void add_all_methods(Draft& draft, const Verdict& overall) {
    if (overall.rows.empty()) return;
    draft.heading(2, "All methods");
    Table table = verdict_table(overall, fmt::format("Every method over all {} scenes", overall.scenes.size()),
                                draft.results.noise_floor());
    table.note = verdict_note(draft) + (table.note.empty() ? "" : " " + table.note);
    draft.add(std::move(table));
    draft.add(partial_table(overall,
                            "Methods that were run on some of the scenes only: no row of these compares "
                            "with one of other scenes",
                            draft.results.noise_floor()));
    add_targets_over_time(draft, overall);
}

void add_verdict_by_class(Draft& draft) {
    const auto classes = draft.scenes_by_class();
    if (classes.size() < 2) return;
    draft.heading(2, "Verdict per class");
    for (const auto& [name, scenes] : classes) {
        const Verdict verdict = make_verdict(draft.results, draft.reference, draft.mode, scenes);
        draft.add(
            verdict_table(verdict, fmt::format("{}: {}", name, joined(verdict.scenes)), draft.results.noise_floor()));
        draft.add(
            partial_table(verdict, fmt::format("{}, on some of these scenes only", name), draft.results.noise_floor()));
    }
    draft.paragraph(
        "In I2I and I2R scenes the instruments are driven by a simulated operator and pushed back by the contact; a "
        "scene whose bodies all follow a script has no depth of its own making, so it is n/a there. Columns as under "
        "\"All methods\".",
        Paragraph::Style::small);
}

}  // namespace trocar
