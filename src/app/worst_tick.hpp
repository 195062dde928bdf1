// Runs the two runs of a study's picture once more and cuts through the deepest place (report/worst_tick.hpp).
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "measure/record.hpp"
#include "report/worst_tick.hpp"

namespace trocar::app {

/// Nothing when the study has no closed loop that ended well. `study_folder`: where the scenes of the records are named
/// from. Throws InputError when a scene has changed or the run ends otherwise than its record says.
std::optional<WorstTick> see_worst_tick(const std::vector<Record>& records, const std::filesystem::path& study_folder,
                                        const std::optional<std::filesystem::path>& data);

}  // namespace trocar::app
