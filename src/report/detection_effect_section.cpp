// What a response loses by the detector: depth and force of its rows with a detector that misses pairs, or is blind,
// against the same row with an exact one. Where nothing is lost, the response does not work from its detector's answer.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/sections.hpp"

namespace trocar {
namespace {

/// A row and the same row with an exact detector, on one scene.
struct OnScene {
    std::string scene;
    const RunFigures* exact = nullptr;
    const RunFigures* other = nullptr;
    /// m, by how much deeper the worst tick is.
    [[nodiscard]] double depth_lost() const {
        return (*other)[Metric::residual_penetration_max_m] - (*exact)[Metric::residual_penetration_max_m];
    }
    /// N, by how much the largest force differs, in either direction: a blind tool shows none.
    [[nodiscard]] double force_lost() const {
        return std::abs((*other)[Metric::force_max_n] - (*exact)[Metric::force_max_n]);
    }
};

struct Loss {
    Method exact;
    Method other;
    std::vector<OnScene> scenes;  ///< both ended well
    std::size_t alike = 0;        ///< of these: the same motion, bit by bit
    double true_pairs = not_known;
    double false_negatives = not_known;
    double true_proximity_pairs = not_known;
    double proximity_false_negatives = not_known;
    std::size_t failed = 0;  ///< scenes on which the row alone failed
    [[nodiscard]] bool moves_alike() const { return failed == 0 && alike == scenes.size(); }
};

bool is_exact(const Results& results, const Method& method) {
    return results.fact(method, "detector.claims_exact") == "yes" && results.fact(method, "detector.control") != "yes";
}

/// The judged row with an exact detector and everything else the same; null without one.
const Method* exact_row(const Results& results, const std::vector<Method>& all, const Method& of) {
    const auto judged = [&results](const Method& method) {
        const std::vector<std::string> scenes = results.scenes(method.mode);
        return std::any_of(scenes.begin(), scenes.end(), [&](const std::string& scene) {
            const SceneResult* result = results.find(method, scene);
            return result != nullptr && result->ok() && result->runs.front().judged();
        });
    };
    for (const Method& one : all) {
        if (one.response == of.response && one.contacts == of.contacts && one.stepper == of.stepper &&
            is_exact(results, one) && judged(one)) {
            return &one;
        }
    }
    return nullptr;
}

void add_to(double& sum, double value) {
    if (!std::isnan(value)) sum = std::isnan(sum) ? value : sum + value;
}

std::vector<Loss> losses_of(const Results& results) {
    std::vector<Loss> losses;
    const std::vector<Method> all = results.methods("closed_loop");
    for (const Method& other : all) {
        if (other.response.empty() || is_exact(results, other)) continue;
        const Method* exact = exact_row(results, all, other);
        if (exact == nullptr) continue;
        Loss loss{.exact = *exact, .other = other, .scenes = {}};
        for (const std::string& scene : results.scenes("closed_loop")) {
            const SceneResult* first = results.find(*exact, scene);
            const SceneResult* second = results.find(other, scene);
            if (first == nullptr || second == nullptr || !first->ok() || second->not_applicable()) continue;
            if (!second->ok()) {
                ++loss.failed;
                continue;
            }
            loss.scenes.push_back({.scene = scene, .exact = &first->runs.front(), .other = &second->runs.front()});
            const RunFigures& run = *loss.scenes.back().other;
            loss.alike += same_motion(*loss.scenes.back().exact, run) ? 1 : 0;
            add_to(loss.true_pairs, run[Metric::true_pairs]);
            add_to(loss.false_negatives, run[Metric::false_negatives]);
            add_to(loss.true_proximity_pairs, run[Metric::true_proximity_pairs]);
            add_to(loss.proximity_false_negatives, run[Metric::proximity_false_negatives]);
        }
        if (!loss.scenes.empty() || loss.failed > 0) losses.push_back(std::move(loss));
    }
    return losses;
}

std::string of_text(double part, double whole) {
    return std::isnan(whole) ? std::string("n/a") : fmt::format("{:.0f} of {:.0f}", part, whole);
}

std::string from_to(double from, double to, double scale) { return scaled(from, scale) + " → " + scaled(to, scale); }

/// Where `lost` is largest; null where it is not known on any scene.
template <typename Lost>
const OnScene* worst(const Loss& loss, const Lost& lost) {
    const OnScene* found = nullptr;
    for (const OnScene& one : loss.scenes) {
        if (std::isnan(lost(one))) continue;
        if (found == nullptr || lost(one) > lost(*found)) found = &one;
    }
    return found;
}

double most_left(const Loss& loss, const RunFigures* OnScene::*of) {
    double most = not_known;
    for (const OnScene& one : loss.scenes) most = std::fmax(most, (*(one.*of))[Metric::residual_penetration_max_m]);
    return most;
}

TableRow row_of(const Loss& loss) {
    const OnScene* deepest = worst(loss, [](const OnScene& one) { return one.depth_lost(); });
    const OnScene* forced = worst(loss, [](const OnScene& one) { return one.force_lost(); });
    TableRow row{.cells = {code(loss.other.label()), code(loss.exact.detector),
                           of_text(loss.false_negatives, loss.true_pairs),
                           of_text(loss.proximity_false_negatives, loss.true_proximity_pairs)}};
    row.cells.push_back(from_to(most_left(loss, &OnScene::exact), most_left(loss, &OnScene::other), mm));
    row.cells.push_back(deepest == nullptr
                            ? "n/a"
                            : fmt::format("{} ({}: {})", scaled(deepest->depth_lost(), mm), deepest->scene,
                                          from_to((*deepest->exact)[Metric::residual_penetration_max_m],
                                                  (*deepest->other)[Metric::residual_penetration_max_m], mm)));
    row.cells.push_back(forced == nullptr ? "n/a"
                                          : fmt::format("{} ({}: {})", scaled(forced->force_lost()), forced->scene,
                                                        from_to((*forced->exact)[Metric::force_max_n],
                                                                (*forced->other)[Metric::force_max_n], 1.0)));
    row.cells.push_back(fmt::format("{} of {}", loss.alike, loss.scenes.size()) +
                        (loss.failed > 0 ? fmt::format(", fails on {}", loss.failed) : std::string()));
    return row;
}

std::string change_text(double from, double to, double scale) {
    if (std::isnan(from) && std::isnan(to)) return "n/a";
    return from == to ? "the same" : from_to(from, to, scale);
}

Table by_scene(const std::vector<Loss>& losses) {
    Table table;
    table.caption = "The same scene by scene: with the exact detector → with this one";
    table.folded = true;
    table.columns = {{"scene", false},
                     {"detector + response (contact generator)", false},
                     {"false negatives", true, Metric::false_negatives},
                     {"proximity false negatives", true, Metric::proximity_false_negatives},
                     {"residual penetration, max (mm)", true, Metric::residual_penetration_max_m},
                     {"largest force (N)", true, Metric::force_max_n},
                     {"force error to hard contact (N RMS)", true, Metric::force_error_rms_hard}};
    for (const Loss& loss : losses) {
        if (loss.moves_alike()) continue;
        for (const OnScene& one : loss.scenes) {
            table.rows.push_back(
                {.cells = {one.scene, code(loss.other.label()),
                           of_text((*one.other)[Metric::false_negatives], (*one.other)[Metric::true_pairs]),
                           of_text((*one.other)[Metric::proximity_false_negatives],
                                   (*one.other)[Metric::true_proximity_pairs]),
                           change_text((*one.exact)[Metric::residual_penetration_max_m],
                                       (*one.other)[Metric::residual_penetration_max_m], mm),
                           change_text((*one.exact)[Metric::force_max_n], (*one.other)[Metric::force_max_n], 1.0),
                           change_text((*one.exact)[Metric::force_error_rms_hard],
                                       (*one.other)[Metric::force_error_rms_hard], 1.0)}});
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
    table.columns = {
        {"detector + response (contact generator)", false},
        {"exact detector", false},
        {"false negatives of true pairs", true, Metric::false_negatives},
        {"proximity false negatives of those within the query distance", true, Metric::proximity_false_negatives},
        {"residual penetration, max over the scenes (mm)", true, Metric::residual_penetration_max_m},
        {"largest increase of residual penetration (mm)", true, Metric::residual_penetration_max_m},
        {"most force changed (N)", true, Metric::force_max_n},
        {"scenes that move alike", true}};
    std::vector<std::string> nothing_lost;
    for (const Loss& loss : losses) {
        if (loss.moves_alike()) {
            nothing_lost.push_back(code(loss.other.label()));
        } else {
            table.rows.push_back(row_of(loss));
        }
    }
    if (!nothing_lost.empty()) {
        draft.paragraph(
            fmt::format("Detection errors change nothing, bit by bit on every scene, in {}.", joined(nothing_lost)));
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
