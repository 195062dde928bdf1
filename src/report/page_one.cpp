// The rows of page 1, from the results of the runs; page_one_tables.cpp prints them.
#include "report/page_one.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "report/verdict_order.hpp"

namespace trocar {
namespace {

void keep_known(std::vector<double>& values, double value) {
    if (!std::isnan(value)) values.push_back(value);
}

/// The detector that most methods have: the one that page 1 need not name.
std::map<std::string, int> count_by_detector(const std::vector<Method>& methods) {
    std::map<std::string, int> count;
    for (const Method& method : methods) ++count[method.detector];
    return count;
}

ResponseRow make_row(const Results& results, const Method& method, const std::vector<std::string>& scenes) {
    ResponseRow row;
    row.who = {method};
    row.setting = results.fact(method, "response.setting");
    row.ours = method.response == results.fact(method, "study.ours");
    row.control = results.fact(method, "response.control") == "yes";
    std::vector<double> depths;
    std::vector<double> forces;
    for (const std::string& scene : scenes) {
        const SceneResult* result = results.find(method, scene);
        if (result == nullptr || result->not_applicable()) {
            ++row.not_run;
            continue;
        }
        for (const RunFigures& run : result->runs) {
            ++row.runs;
            row.failed += run.ok() ? 0 : 1;
        }
        // What a run did before it failed is no answer; the row is reported as failed.
        if (!result->ok()) continue;
        const RunFigures& first = result->runs.front();
        keep_known(depths, first[Metric::residual_penetration_median_m]);
        if (!std::isnan(first[Metric::residual_penetration_max_m]) &&
            !(first[Metric::residual_penetration_max_m] <= row.residual_penetration_max)) {
            row.residual_penetration_max = first[Metric::residual_penetration_max_m];
            row.worst_on = scene;
        }
        keep_known(forces, first[Metric::force_error_rms_hard]);
        add_known(row.tears, first[Metric::ruptures]);
        take_larger(row.force_without_touch_m, first[Metric::force_without_touch_m]);
        take_larger(row.force_jump, first[Metric::force_jump_max_n]);
        take_larger(row.total_p99_ns, result->of(Metric::total_p99_ns).value);
    }
    row.depth_median = quantile(depths, 0.5);
    row.force_error = quantile(forces, 0.5);
    return row;
}

/// On every scene of either.
bool same_bits(const Results& results, const Method& a, const Method& b, const std::vector<std::string>& scenes) {
    bool any = false;
    for (const std::string& scene : scenes) {
        const SceneResult* first = results.find(a, scene);
        const SceneResult* second = results.find(b, scene);
        if ((first == nullptr) != (second == nullptr)) return false;
        if (first == nullptr) continue;
        if (!first->ok() || !second->ok() || !same_motion(first->runs.front(), second->runs.front())) return false;
        any = true;
    }
    return any;
}

}  // namespace

std::vector<ResponseRow> response_rows(const Draft& draft, bool tissue) {
    const Results& results = draft.results;
    std::vector<std::string> scenes = judged_scenes(results, results.scenes("closed_loop"), tissue);
    std::erase(scenes, "");
    std::vector<Method> methods;
    for (const Method& method : results.methods("closed_loop")) {
        if (method.response.empty() || results.fact(method, "detector.control") == "yes") continue;
        methods.push_back(method);
    }
    const std::map<std::string, int> common = count_by_detector(methods);
    std::stable_sort(methods.begin(), methods.end(), [&common](const Method& a, const Method& b) {
        return common.at(a.detector) > common.at(b.detector);
    });
    std::vector<ResponseRow> rows;
    for (const Method& method : methods) {
        const auto twin = std::find_if(rows.begin(), rows.end(), [&](const ResponseRow& row) {
            return same_bits(results, row.who.front(), method, scenes);
        });
        if (twin != rows.end()) {
            twin->who.push_back(method);
            continue;
        }
        ResponseRow row = make_row(results, method, scenes);
        if (row.runs > 0) rows.push_back(std::move(row));
    }
    const auto rank = [](const ResponseRow& row) {
        return std::pair(response_order({.control = row.control,
                                         .failed = row.failed > 0,
                                         .not_run = row.not_run > 0,
                                         .worst = row.residual_penetration_max,
                                         .median = row.depth_median,
                                         .total_p99_ns = row.total_p99_ns}),
                         row.who.front());
    };
    std::sort(rows.begin(), rows.end(),
              [&rank](const ResponseRow& a, const ResponseRow& b) { return rank(a) < rank(b); });
    return rows;
}

std::vector<std::size_t> rows_that_matter(const std::vector<ResponseRow>& rows) {
    std::set<std::size_t> shown;
    std::set<std::string> methods;
    for (std::size_t i = 0; i < rows.size() && shown.size() < page_one_rows; ++i) {
        if (methods.insert(rows[i].method()).second) shown.insert(i);
    }
    for (std::size_t i = 0; i < rows.size() && shown.size() < page_one_rows; ++i) shown.insert(i);
    return {shown.begin(), shown.end()};
}

Headline headline_of(const std::vector<ResponseRow>& rows) {
    const auto usable = [](const ResponseRow& row) {
        return !row.control && row.failed == 0 && row.not_run == 0 && !std::isnan(row.residual_penetration_max);
    };
    Headline headline;
    for (const ResponseRow& row : rows) {
        if (headline.first == nullptr && row.ours && !std::isnan(row.residual_penetration_max)) headline.first = &row;
    }
    headline.named = headline.first != nullptr;
    for (const ResponseRow& row : rows) {
        if (headline.first == nullptr && usable(row)) headline.first = &row;
    }
    if (headline.first == nullptr) return headline;
    for (const ResponseRow& row : rows) {
        const bool same = &row == headline.first || (headline.named && row.method() == headline.first->method());
        if (headline.other == nullptr && usable(row) && !same) headline.other = &row;
    }
    return headline;
}

}  // namespace trocar
