#include "report/over_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace trocar {
namespace {

/// Geometric mean over scenes for each process. n/a as soon as one value is.
std::vector<double> mean_over_scenes(const std::vector<const std::vector<double>*>& by_scene) {
    std::size_t processes = by_scene.empty() ? 0 : by_scene.front()->size();
    for (const auto* scene : by_scene) processes = std::min(processes, scene->size());
    std::vector<double> by_process;
    std::vector<double> values(by_scene.size());
    for (std::size_t process = 0; process < processes; ++process) {
        for (std::size_t s = 0; s < by_scene.size(); ++s) values[s] = (*by_scene[s])[process];
        const bool known = std::none_of(values.begin(), values.end(), [](double v) { return std::isnan(v); });
        by_process.push_back(known ? geometric_mean(values) : not_known);
    }
    return by_process;
}

std::vector<double> divided(const std::vector<double>& a, const std::vector<double>& b) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) ratios.push_back(a[i] / b[i]);
    return ratios;
}

}  // namespace

double value_over(Over over, const std::vector<double>& values) {
    switch (over) {
        case Over::sum:
            return known_sum(values);
        case Over::largest:
            return known_largest(values);
        case Over::median:
            return median(values);
        case Over::mean:
            break;
    }
    const auto known = std::count_if(values.begin(), values.end(), [](double value) { return !std::isnan(value); });
    return known_sum(values) / static_cast<double>(known);
}

std::vector<double> ResultSet::values(Processes processes, Metric metric) const {
    std::vector<double> list;
    for (const SceneResult* result : results) {
        switch (processes) {
            case Processes::first:
                list.push_back(result->first(metric));
                break;
            case Processes::median:
            case Processes::interval:
                list.push_back(result->of(metric).value);
                break;
            case Processes::every:
                for (const RunFigures& run : result->runs) list.push_back(run[metric]);
                break;
        }
    }
    return list;
}

int ResultSet::runs() const {
    int count = 0;
    for (const SceneResult* result : results) count += static_cast<int>(result->runs.size());
    return count;
}

int ResultSet::failed_runs() const {
    std::ptrdiff_t count = 0;
    for (const SceneResult* result : results) {
        count +=
            std::count_if(result->runs.begin(), result->runs.end(), [](const RunFigures& run) { return !run.ok(); });
    }
    return static_cast<int>(count);
}

ResultSet ResultSet::ok() const {
    ResultSet list;
    std::copy_if(results.begin(), results.end(), std::back_inserter(list.results),
                 [](const SceneResult* result) { return result->ok(); });
    return list;
}

ResultSet possible(const Results& results, const Method& method) {
    ResultSet set;
    for (const auto& [scene, result] : results.of(method)) {
        if (!result.not_applicable()) set.results.push_back(&result);
    }
    return set;
}

ProcessSample sample_of(const SceneResult& result, Metric metric) {
    ProcessSample sample{.by_process = {}, .resamples = result.resamples_of(metric)};
    for (const RunFigures& run : result.runs) sample.by_process.push_back(run[metric]);
    return sample;
}

ProcessSample ratio_of(const ProcessSample& a, const ProcessSample& b) {
    ProcessSample ratio{.by_process = divided(a.by_process, b.by_process), .resamples = {}};
    for (std::size_t r = 0; r < std::min(a.resamples.size(), b.resamples.size()); ++r) {
        ratio.resamples.push_back(divided(a.resamples[r], b.resamples[r]));
    }
    return ratio;
}

Estimate over_scenes(const std::vector<ProcessSample>& by_scene) {
    std::vector<const std::vector<double>*> measured;
    std::size_t count = by_scene.empty() ? 0 : by_scene.front().resamples.size();
    for (const ProcessSample& scene : by_scene) {
        measured.push_back(&scene.by_process);
        count = std::min(count, scene.resamples.size());
    }
    Resamples resamples;
    for (std::size_t r = 0; r < count; ++r) {
        std::vector<const std::vector<double>*> drawn;
        drawn.reserve(by_scene.size());
        for (const ProcessSample& scene : by_scene) drawn.push_back(&scene.resamples[r]);
        resamples.push_back(mean_over_scenes(drawn));
    }
    return across_processes(mean_over_scenes(measured), resamples);
}

}  // namespace trocar
