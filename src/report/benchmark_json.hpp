// Stored runs in formats that other programs read: Google Benchmark's, and that of dashboards.
#pragma once

#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

/// Google Benchmark's JSON of the runs with a known time of a tick. An entry is a process, so that the repetitions of a
/// run share its name. `real_time` is the median tick (ns), `cpu_time` the same where the CPU was not timed. Further
/// figures of the clock are counters. Throws InputError for no such run, and for runs of several machines.
std::string google_benchmark_json(const std::vector<const Record*>& runs);

/// A list of {"name", "unit", "value", "range"}, as github-action-benchmark reads it (customSmallerIsBetter). A value
/// is the median over the processes of a run, in the unit of its metric, `range` their minimum and maximum. `metrics`:
/// names; empty: times, depth and missed pairs. Values that are not known are left out. Throws InputError for a metric
/// of which smaller is not better, for no value at all, and for times of several machines.
std::string smaller_is_better_json(const std::vector<const Record*>& runs, const std::vector<std::string>& metrics);

}  // namespace trocar
