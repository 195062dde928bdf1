// What the rows of a verdict hold, from the results of the runs; verdict_page.cpp reports them.
#include "report/verdict.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "measure/statistics.hpp"
#include "report/verdict_order.hpp"

namespace trocar {
namespace {

bool on_all_scenes(const VerdictRow& row, const Verdict& verdict) {
    return row.planned.count() == verdict.scenes.size();
}

}  // namespace

VerdictRow make_row(const Results& results, const Method& method, const std::string& reference,
                    const std::vector<std::string>& scenes) {
    VerdictRow row;
    row.method = method;
    row.ours = !method.response.empty() && method.response == results.fact(method, "study.ours");
    row.control = results.fact(method, "detector.control") == "yes" ||
                  (!method.response.empty() && results.fact(method, "response.control") == "yes");
    row.reference = !reference.empty() && method.detector == reference;
    Method yardstick = method;
    yardstick.detector = reference;
    // The reference may have no rows with another generator's contacts. Its row with intersection contacts is then the
    // yardstick.
    const auto has_rows = [&] {
        return std::any_of(scenes.begin(), scenes.end(),
                           [&](const std::string& scene) { return results.find(yardstick, scene) != nullptr; });
    };
    if (method.mode == "closed_loop" && (method.contacts == "native" || !has_rows()))
        yardstick.contacts = "intersection";

    std::vector<ProcessSample> p50;
    std::vector<ProcessSample> p99;
    std::vector<ProcessSample> ratio;
    std::vector<double> errors;
    const std::vector<std::string> judged = judged_scenes(results, scenes, true);
    for (const std::string& scene : scenes) {
        const SceneResult* result = results.find(method, scene);
        if (result == nullptr) continue;
        if (result->not_applicable()) {
            row.not_applicable = true;
            continue;
        }
        row.planned.results.push_back(result);
        if (!result->ok()) continue;
        row.ok.results.push_back(result);
        if (std::find(judged.begin(), judged.end(), scene) != judged.end()) row.judged.results.push_back(result);
        if (!std::isnan(result->first(Metric::residual_penetration_max_m))) {
            errors.push_back(error_on(*result, results.class_of(scene)));
        }
        p50.push_back(sample_of(*result, Metric::total_median_ns));
        p99.push_back(sample_of(*result, Metric::total_p99_ns));
        const SceneResult* other = reference.empty() ? nullptr : results.find(yardstick, scene);
        if (other != nullptr && other->ok()) {
            ratio.push_back(ratio_of(p50.back(), sample_of(*other, Metric::total_median_ns)));
        } else {
            ratio.push_back({.by_process = std::vector(p50.back().by_process.size(), not_known), .resamples = {}});
        }
    }
    row.failed_runs = row.planned.failed_runs();
    row.slowest_tick = known_largest(row.judged.values(Processes::median, results.tail_metric()));
    if (!errors.empty()) row.error = geometric_mean(errors);
    // A method that failed somewhere has no mean over the scenes: leaving the scene out would flatter it.
    if (row.ok.count() == row.planned.count()) {
        row.p50 = over_scenes(p50);
        row.p99 = over_scenes(p99);
        row.ratio = over_scenes(ratio);
    }
    return row;
}

std::vector<std::string> VerdictRow::scene_names() const {
    std::vector<std::string> names;
    for (const SceneResult* result : planned.results) names.push_back(result->scene());
    return names;
}

VerdictRow::ForceError VerdictRow::force_error(Metric of, Metric bound) const {
    ForceError force;
    for (const SceneResult* result : ok.results) {
        const bool within = result->first(of) <= result->first(bound);
        double& largest = within ? force.within : force.worst;
        largest = std::fmax(largest, result->first(within ? bound : of));
    }
    return force;
}

double VerdictRow::wrong() const {
    const double missed = planned.sum(Metric::contact_events_missed);
    return planned.sum(Metric::false_negatives) + planned.sum(Metric::false_positives) +
           (std::isnan(missed) ? 0.0 : missed);
}

bool Verdict::error_is_depth() const { return have_depths(rows); }

Verdict make_verdict(const Results& results, const std::string& reference, const std::string& mode,
                     const std::vector<std::string>& scenes) {
    Verdict verdict;
    verdict.mode = mode;
    for (const std::string& scene : scenes) {
        // A scene that nobody could run (no data) is reported elsewhere and takes no part.
        const std::vector<Method> all = results.methods(mode);
        const bool possible = std::any_of(all.begin(), all.end(), [&](const Method& method) {
            const SceneResult* result = results.find(method, scene);
            return result != nullptr && !result->not_applicable();
        });
        if (possible) verdict.scenes.push_back(scene);
    }
    for (const Method& method : results.methods(mode)) {
        VerdictRow row = make_row(results, method, reference, verdict.scenes);
        if (row.planned.count() > 0) verdict.rows.push_back(std::move(row));
    }
    if (std::any_of(verdict.rows.begin(), verdict.rows.end(),
                    [&verdict](const VerdictRow& row) { return on_all_scenes(row, verdict); })) {
        const auto first =
            std::stable_partition(verdict.rows.begin(), verdict.rows.end(),
                                  [&verdict](const VerdictRow& row) { return on_all_scenes(row, verdict); });
        verdict.partial.assign(std::make_move_iterator(first), std::make_move_iterator(verdict.rows.end()));
        verdict.rows.erase(first, verdict.rows.end());
    }
    compare_rows(results, verdict.scenes, verdict.rows);
    // Of the others, only those of the same scenes compare.
    std::map<std::vector<std::string>, std::vector<VerdictRow>> by_scenes;
    for (VerdictRow& row : verdict.partial) by_scenes[row.scene_names()].push_back(std::move(row));
    verdict.partial.clear();
    for (auto& [names, rows] : by_scenes) {
        compare_rows(results, names, rows);
        const auto before = static_cast<int>(verdict.partial.size());
        for (VerdictRow& row : rows) row.identical_to += row.identical_to >= 0 ? before : 0;
        std::move(rows.begin(), rows.end(), std::back_inserter(verdict.partial));
    }
    return verdict;
}

}  // namespace trocar
