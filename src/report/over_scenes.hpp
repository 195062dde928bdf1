// One figure of a method over several scenes: the geometric mean for every process and, where replays were
// resampled, for every resample, so that intervals of means and of ratios come from the same draws.
#pragma once

#include <vector>

#include "report/figures.hpp"

namespace trocar {

/// A figure of one scene: of every process, and resampled where the scene was replayed by processes enough.
struct ProcessSample {
    std::vector<double> by_process;
    Resamples resamples;
};

ProcessSample sample_of(const SceneResult& result, double RunFigures::*figure);

/// a / b, process by process and, resampled, tick by tick: both were drawn alike.
ProcessSample ratio_of(const ProcessSample& a, const ProcessSample& b);

/// Geometric mean over scenes for each process, then across processes; the interval from the resamples where every
/// scene has them. n/a as soon as one value is.
Estimate over_scenes(const std::vector<ProcessSample>& by_scene);

}  // namespace trocar
