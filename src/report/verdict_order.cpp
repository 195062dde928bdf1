#include "report/verdict_order.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>

namespace trocar {
namespace {

constexpr double least_error = 1.0e-6;  // m

}  // namespace

double error_on(const SceneResult& result, const std::string& pair_class) {
    const double path = result.first(Metric::position_error_worst_equal_k);
    const bool rigid = pair_class == "I2I" || pair_class == "I2R";
    // NaN stays NaN: std::max gives its first argument when neither is larger.
    return std::max(rigid && !std::isnan(path) ? path : result.first(Metric::residual_penetration_max_m), least_error);
}

std::vector<std::string> judged_scenes(const Results& results, const std::vector<std::string>& scenes, bool tissue) {
    std::vector<std::string> judged;
    std::copy_if(scenes.begin(), scenes.end(), std::back_inserter(judged),
                 [&](const std::string& scene) { return meets_tissue(results.class_of(scene)) == tissue; });
    return tissue && judged.empty() ? scenes : judged;
}

ResponseOrder response_order(const VerdictRow& row, bool not_run) {
    return {row.control,
            row.failed_runs > 0,
            not_run,
            or_last(as_printed(row.residual_max())),
            or_last(as_printed(row.residual_median())),
            or_last(row.slowest_tick)};
}

bool have_depths(const std::vector<VerdictRow>& rows) {
    return std::any_of(rows.begin(), rows.end(), [](const VerdictRow& row) { return !std::isnan(row.error); });
}

double error_of(const VerdictRow& row, bool depth) { return depth ? as_printed(row.error) : row.wrong(); }

void compare_rows(const Results& results, const std::vector<std::string>& scenes, std::vector<VerdictRow>& rows) {
    const bool depth = have_depths(rows);
    const auto of_response = [](const VerdictRow& row) {
        return std::pair(response_order(row, row.not_applicable), row.method);
    };
    const auto of_detector = [](const VerdictRow& row) {
        return std::tuple(row.control, row.failed_runs > 0, std::isnan(row.p50.value), or_last(row.wrong()),
                          or_last(row.p50.value), row.method);
    };
    std::sort(rows.begin(), rows.end(), [&](const VerdictRow& a, const VerdictRow& b) {
        return depth ? of_response(a) < of_response(b) : of_detector(a) < of_detector(b);
    });
    for (std::size_t i = 0; i < rows.size(); ++i) {
        VerdictRow& row = rows[i];
        for (std::size_t j = 0; j < i && row.identical_to < 0; ++j) {
            if (rows[j].identical_to < 0 && results.move_alike(row.method, rows[j].method, scenes)) {
                row.identical_to = static_cast<int>(j);
            }
        }
        const double error = error_of(row, depth);
        const double time = row.p50.value;
        if (row.control || std::isnan(error) || std::isnan(time)) continue;
        row.dominated = std::any_of(rows.begin(), rows.end(), [&](const VerdictRow& other) {
            if (other.control) return false;
            const double other_error = error_of(other, depth);
            const double other_time = other.p50.value;
            return other_error <= error && other_time <= time && (other_error < error || other_time < time);
        });
    }
}

}  // namespace trocar
