// A metric over several scenes. Times of methods that are compared are geometric means per process and per resample.
// Intervals of means and of ratios therefore use the same draws.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "report/figures.hpp"

namespace trocar {

/// How the processes of one run become one value, or stay apart.
enum class Processes : std::uint8_t {
    first,  ///< for metrics that no clock is in
    median,
    interval,  ///< the median, with its bounds where a cell is about one scene (Estimate)
    every      ///< a value per process
};

/// How the values become one. Values that are not known are left out; NaN without any.
enum class Over : std::uint8_t { sum, largest, median, mean };
double value_over(Over over, const std::vector<double>& values);

/// Results that one row of a table is about, of one or more scenes.
struct ResultSet {
    std::vector<const SceneResult*> results = {};
    [[nodiscard]] std::vector<double> values(Processes processes, Metric metric) const;
    /// Values of the first processes become one.
    [[nodiscard]] double sum(Metric metric) const { return over(Over::sum, metric); }
    [[nodiscard]] double largest(Metric metric) const { return over(Over::largest, metric); }
    [[nodiscard]] double median(Metric metric) const { return over(Over::median, metric); }
    [[nodiscard]] double over(Over how, Metric metric) const {
        return value_over(how, values(Processes::first, metric));
    }
    [[nodiscard]] std::size_t count() const { return results.size(); }  ///< results
    [[nodiscard]] int runs() const;                                     ///< over all processes
    [[nodiscard]] int failed_runs() const;
    /// The results whose processes all ended well.
    [[nodiscard]] ResultSet ok() const;
    /// First process of the first result, for a row about one scene.
    [[nodiscard]] const RunFigures& first() const { return results.front()->runs.front(); }
};

/// One value per result, infinite where a run failed: a method that fails is worse than every other there. `value`: of
/// a SceneResult that ended well.
template <typename Value>
std::vector<double> failed_as_infinite(const ResultSet& results, const Value& value) {
    std::vector<double> values;
    values.reserve(results.count());
    for (const SceneResult* result : results.results) {
        values.push_back(result->ok() ? value(*result) : std::numeric_limits<double>::infinity());
    }
    return values;
}

/// Results of the method that are not without an answer (SceneResult::not_applicable), by scene.
ResultSet possible(const Results& results, const Method& method);

/// Figure of one scene per process, with resamples for a replay with enough processes.
struct ProcessSample {
    std::vector<double> by_process;
    Resamples resamples;
};

ProcessSample sample_of(const SceneResult& result, Metric metric);

/// a / b per process and per resample; both use the same draws.
ProcessSample ratio_of(const ProcessSample& a, const ProcessSample& b);

/// Geometric mean over scenes per process, then over processes. The interval uses resamples when every scene has them.
/// NaN when any value is NaN.
Estimate over_scenes(const std::vector<ProcessSample>& by_scene);

}  // namespace trocar
