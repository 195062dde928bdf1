// From scenes, recordings and records to a replay page: which records are shown, and the runs made once more for their
// frames. Shared by `trocar view` and `trocar study`.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "measure/record.hpp"
#include "scene/scene.hpp"
#include "view/page.hpp"

namespace trocar::app {

/// Frames are kept every so many ticks.
inline constexpr std::int64_t viewed_stride = 8;

/// Reported before every tick, with the run's name and the number of ticks done.
using ViewProgress = std::function<void(const std::string&, std::int64_t)>;

/// The records that a page of the scene shows. Without `responses` two: ours (what the study names so, else the best of
/// our own) and the best with another response, by the residual penetration, max; controls never. Else the best
/// record of each response named, a name or a name with all its parameters; throws InputError where there is none.
std::vector<const Record*> chosen_records(const std::vector<Record>& records, const std::string& scene,
                                          const std::vector<std::string>& responses);

/// The scene's file: as it is named from the study's folder, else the one of its name that comes with trocar.
std::optional<std::filesystem::path> scene_file_of(const Record& record, const std::filesystem::path& study_folder);

/// The folder of the study's file as the record knows it: relative to where the study was run, empty for one outside.
std::filesystem::path study_folder_of(const Record& record);

/// The page of a scene without runs: bodies, rest and the stored references.
ViewPage page_of(const Scene& scene);

/// Runs the specification and adds what it shows. With a record, its state hash is held against that of this run, and a
/// record that ended without any (crashed, timed out, absent) is shown as failed without being run.
void add_run(const Scene& scene, const RunSpec& spec, const Record* record, const ViewProgress& progress,
             ViewPage& page);

/// The page of a scene with the runs of these records. A scene whose file has changed since is reported on the page.
ViewPage page_of_records(const Scene& scene, const std::vector<const Record*>& records, const ViewProgress& progress);

/// A recording's frames, without forces. Throws InputError as play_recording.
ViewPage page_of_recording(const std::filesystem::path& file);

/// Once all runs are there: the line under the title, and labels that report the runs apart in as few words as do.
void finish_page(const std::vector<RunSpec>& specs, ViewPage& page);

}  // namespace trocar::app
