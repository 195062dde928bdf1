// What a response loses by the detector: depth and force of its rows with a detector that misses pairs, or is blind,
// against the same row with an exact one. Where nothing is lost, the response does not work from its detector's answer.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/sections.hpp"

namespace trocar {
namespace {

/// A row and the same row with an exact detector.
struct Loss {
    Method exact;
    Method other;
    ResultSet from;          ///< with the exact detector, on the scenes where both ended well
    ResultSet to;            ///< on the same scenes
    std::size_t alike = 0;   ///< scenes of the same motion, bit by bit
    std::size_t failed = 0;  ///< scenes on which the row alone failed
    [[nodiscard]] bool moves_alike() const { return failed == 0 && alike == to.count(); }
};

bool is_exact(const Results& results, const Method& method) {
    return results.fact(method, "detector.claims_exact") == "yes" && results.fact(method, "detector.control") != "yes";
}

/// The judged row with an exact detector and everything else the same; null without one.
const Method* exact_row(const Results& results, const std::vector<Method>& all, const Method& of) {
    const auto judged = [&results](const Method& method) {
        const ResultSet done = possible(results, method).ok();
        return std::any_of(done.results.begin(), done.results.end(),
                           [](const SceneResult* result) { return result->runs.front().judged(); });
    };
    for (const Method& one : all) {
        if (one.response == of.response && one.contacts == of.contacts && one.stepper == of.stepper &&
            is_exact(results, one) && judged(one)) {
            return &one;
        }
    }
    return nullptr;
}

std::vector<Loss> losses_of(const Results& results) {
    std::vector<Loss> losses;
    const std::vector<Method> all = results.methods("closed_loop");
    for (const Method& other : all) {
        if (other.response.empty() || is_exact(results, other)) continue;
        const Method* exact = exact_row(results, all, other);
        if (exact == nullptr) continue;
        Loss loss{.exact = *exact, .other = other, .from = {}, .to = {}};
        for (const SceneResult* second : possible(results, other).results) {
            const SceneResult* first = results.find(*exact, second->scene());
            if (first == nullptr || !first->ok()) continue;
            if (!second->ok()) {
                ++loss.failed;
                continue;
            }
            loss.from.results.push_back(first);
            loss.to.results.push_back(second);
            loss.alike += same_motion(first->runs.front(), second->runs.front()) ? 1 : 0;
        }
        if (loss.to.count() > 0 || loss.failed > 0) losses.push_back(std::move(loss));
    }
    return losses;
}

std::string from_to(double from, double to, double scale) { return scaled(from, scale) + " → " + scaled(to, scale); }

/// "2.00 (poke: 0.500 → 2.50)": on the scene where `lost` is largest; n/a where it is not known on any.
std::string most_lost(const Loss& loss, Metric metric, double scale, double (*lost)(double from, double to)) {
    double most = not_known;
    std::string text = unknown_text;
    for (std::size_t i = 0; i < loss.to.count(); ++i) {
        const double from = loss.from.results[i]->first(metric);
        const double to = loss.to.results[i]->first(metric);
        if (std::isnan(lost(from, to)) || lost(from, to) <= most) continue;
        most = lost(from, to);
        text = fmt::format("{} ({}: {})", scaled(most, scale), loss.to.results[i]->scene(), from_to(from, to, scale));
    }
    return text;
}

std::string missed_text(const ResultSet& results, Metric missed, Metric whole) {
    return of_text(results.sum(missed), results.sum(whole));
}

void add_row(const Loss& loss, Table& table) {
    constexpr Metric depth = Metric::residual_penetration_max_m;
    table.rows.push_back({});
    add_cell(table, {"detector + response (contact generator)", false}, code(loss.other.label()));
    add_cell(table, {"exact detector", false}, code(loss.exact.detector));
    add_number(table, "false negatives of true pairs", Metric::false_negatives,
               missed_text(loss.to, Metric::false_negatives, Metric::true_pairs));
    add_number(table, "proximity false negatives of those within the query distance", Metric::proximity_false_negatives,
               missed_text(loss.to, Metric::proximity_false_negatives, Metric::true_proximity_pairs));
    add_number(table, "residual penetration, max over the scenes (mm)", depth,
               from_to(loss.from.largest(depth), loss.to.largest(depth), mm));
    add_number(table, "largest increase of residual penetration (mm)", depth,
               most_lost(loss, depth, mm, [](double from, double to) { return to - from; }));
    // In either direction: a blind tool shows no force.
    add_number(table, "most force changed (N)", Metric::force_max_n,
               most_lost(loss, Metric::force_max_n, 1.0, [](double from, double to) { return std::abs(to - from); }));
    add_cell(table, {"scenes that move alike", true},
             fmt::format("{} of {}", loss.alike, loss.to.count()) +
                 (loss.failed > 0 ? fmt::format(", fails on {}", loss.failed) : std::string()));
}

Table by_scene(const std::vector<Loss>& losses) {
    Table table{.caption = "The same scene by scene: with the exact detector → with this one", .folded = true};
    for (const Loss& loss : losses) {
        if (loss.moves_alike()) continue;
        for (std::size_t i = 0; i < loss.to.count(); ++i) {
            const SceneResult* const result = loss.to.results[i];
            table.rows.push_back({});
            const auto change = [&](Metric metric, double scale = 1.0) -> std::string {
                const double from = loss.from.results[i]->first(metric);
                const double to = result->first(metric);
                if (std::isnan(from) && std::isnan(to)) return unknown_text;
                return from == to ? "the same" : from_to(from, to, scale);
            };
            add_cell(table, {"scene", false}, result->scene());
            add_cell(table, {"detector + response (contact generator)", false}, code(loss.other.label()));
            add_number(table, "false negatives", Metric::false_negatives,
                       missed_text({{result}}, Metric::false_negatives, Metric::true_pairs));
            add_number(table, "proximity false negatives", Metric::proximity_false_negatives,
                       missed_text({{result}}, Metric::proximity_false_negatives, Metric::true_proximity_pairs));
            add_number(table, "residual penetration, max (mm)", Metric::residual_penetration_max_m,
                       change(Metric::residual_penetration_max_m, mm));
            add_number(table, "largest force (N)", Metric::force_max_n, change(Metric::force_max_n));
            add_number(table, "force error to hard contact (N RMS)", Metric::force_error_rms_hard,
                       change(Metric::force_error_rms_hard));
        }
    }
    return table;
}

}  // namespace

void add_lost_by_the_detector(Draft& draft) {
    const std::vector<Loss> losses = losses_of(draft.results);
    if (losses.empty()) return;
    draft.heading(2, "Effect of detection errors");
    draft.paragraph(
        "Depth and force of every row whose detector is not exact against the same row with an exact one. A response "
        "that loses nothing to a blind detector does not work from the detector's answer, and its row says nothing of "
        "detection.");
    Table table;
    table.caption = "With an exact detector → with this one";
    std::vector<std::string> nothing_lost;
    for (const Loss& loss : losses) {
        if (loss.moves_alike()) {
            nothing_lost.push_back(loss.other.label());
        } else {
            add_row(loss, table);
        }
    }
    if (!nothing_lost.empty()) {
        draft.paragraph(fmt::format("Detection errors change nothing, bit by bit on every scene, in {}.",
                                    joined_code(nothing_lost)));
    }
    table.note =
        "Largest increase of residual penetration: on the scene where the worst tick is deeper by most; negative: "
        "less deep on every scene. Most force changed: on the scene where the largest force differs most, more or "
        "less. Moving alike: bit by bit, so that detection errors change nothing there. Near pairs are those within "
        "the query distance that the contact generator asks for; n/a: it works from pairs that meet, or the study "
        "judges no pairs of this row.";
    draft.add(std::move(table));
    draft.add(by_scene(losses));
}

}  // namespace trocar
