#include "report/verdict_order.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace trocar {
namespace {

constexpr double least_error = 1.0e-6;  // m
constexpr double alike = 1.1;           // factor between depths

bool move_alike(const Results& results, const VerdictRow& a, const VerdictRow& b,
                const std::vector<std::string>& scenes) {
    bool any = false;
    for (const std::string& scene : scenes) {
        const SceneResult* first = results.find(a.contestant, scene);
        const SceneResult* second = results.find(b.contestant, scene);
        if ((first == nullptr) != (second == nullptr)) return false;
        if (first == nullptr) continue;
        if (!first->ok() || !second->ok() || !same_motion(first->runs.front(), second->runs.front())) return false;
        any = true;
    }
    return any;
}

double time_of(const VerdictRow& row) { return row.p50.value; }

/// Within runs of rows of alike depth, each within a tenth of its first, those come first that miss and add less.
void sort_alike(std::vector<VerdictRow>& rows) {
    for (auto first = rows.begin(); first != rows.end();) {
        const auto last = std::find_if(first, rows.end(), [&first](const VerdictRow& row) {
            return row.control || row.failed_runs > 0 || std::isnan(row.error) || std::isnan(time_of(row)) ||
                   row.error > alike * first->error;
        });
        if (last == first) return;  // the rest has no answer
        std::sort(first, last, [](const VerdictRow& a, const VerdictRow& b) {
            return std::tuple(or_last(a.wrong()), time_of(a), a.contestant) <
                   std::tuple(or_last(b.wrong()), time_of(b), b.contestant);
        });
        first = last;
    }
}

}  // namespace

double error_on(const SceneResult& result, const std::string& pair_class) {
    const double way = result.first(&RunFigures::position_worst_equal_k);
    const bool rigid = pair_class == "I2I" || pair_class == "I2R";
    // NaN stays NaN: std::max gives its first argument when neither is larger.
    return std::max(rigid && !std::isnan(way) ? way : result.first(&RunFigures::left_max), least_error);
}

bool have_depths(const std::vector<VerdictRow>& rows) {
    return std::any_of(rows.begin(), rows.end(), [](const VerdictRow& row) { return !std::isnan(row.error); });
}

double error_of(const VerdictRow& row, bool depth) { return depth ? as_printed(row.error) : row.wrong(); }

void compare_rows(const Results& results, const std::vector<std::string>& scenes, std::vector<VerdictRow>& rows) {
    const bool depth = have_depths(rows);
    const auto rank = [depth](const VerdictRow& row) {
        return std::tuple(row.control, row.failed_runs > 0, std::isnan(time_of(row)), or_last(error_of(row, depth)),
                          or_last(time_of(row)), row.contestant);
    };
    std::sort(rows.begin(), rows.end(),
              [&rank](const VerdictRow& a, const VerdictRow& b) { return rank(a) < rank(b); });
    if (depth) sort_alike(rows);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        VerdictRow& row = rows[i];
        for (std::size_t j = 0; j < i && row.identical_to < 0; ++j) {
            if (rows[j].identical_to < 0 && move_alike(results, row, rows[j], scenes)) {
                row.identical_to = static_cast<int>(j);
            }
        }
        const double error = error_of(row, depth);
        const double time = time_of(row);
        if (row.control || std::isnan(error) || std::isnan(time)) continue;
        row.dominated = std::any_of(rows.begin(), rows.end(), [&](const VerdictRow& other) {
            if (other.control) return false;
            const double other_error = error_of(other, depth);
            const double other_time = time_of(other);
            return other_error <= error && other_time <= time && (other_error < error || other_time < time);
        });
    }
}

}  // namespace trocar
