// One figure of a method over several scenes: the geometric mean per process and per resample. Intervals of means and
// of ratios therefore use the same draws.
#pragma once

#include <vector>

#include "report/figures.hpp"

namespace trocar {

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
