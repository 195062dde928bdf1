// Repeats the two runs of a study's picture and cuts through the deepest point (report/worst_tick.hpp).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "measure/record.hpp"
#include "playback/playback.hpp"
#include "report/worst_tick.hpp"

namespace trocar::app {

/// Empty when no closed loop ended well. `study_folder`: base of the scene paths in the records. Throws InputError when
/// a scene has changed or a run ends differently from its record.
std::optional<WorstTick> see_worst_tick(const std::vector<Record>& records, const std::filesystem::path& study_folder,
                                        const std::optional<std::filesystem::path>& data);

/// Cut through the deepest vertex of one frame, without curves of forces. `name`: of the frames.
WorstTick cut_frame(const Topology& topology, const PlayedFrame& frame, const std::string& name);

}  // namespace trocar::app
