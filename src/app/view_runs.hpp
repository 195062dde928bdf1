// Builds replay pages from scenes, recordings and records: selects records and repeats their runs for the frames.
// Shared by `trocar view` and `trocar study`.
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

/// Ticks between stored frames.
inline constexpr std::int64_t viewed_stride = 8;

/// Called before every tick with the run's name and the number of finished ticks.
using ViewProgress = std::function<void(const std::string&, std::int64_t)>;

/// The records that a page of the scene shows. Without `responses` two: the best of our own (the one that
/// the study names) and the best with another response, by largest residual penetration. Controls never. Else the best
/// record of each response named, a name or a name with all its parameters; throws InputError where there is none.
std::vector<const Record*> chosen_records(const std::vector<Record>& records, const std::string& scene,
                                          const std::vector<std::string>& responses);

/// Scene file relative to the study's folder, else the shipped scene of that name.
std::optional<std::filesystem::path> scene_file_of(const Record& record, const std::filesystem::path& study_folder);

/// Folder of the study file as stored in the record: relative to the working directory of the study; empty for one
/// outside.
std::filesystem::path study_folder_of(const Record& record);

/// Page of a scene without runs: bodies, rest state and stored references.
ViewPage page_of(const Scene& scene);

/// Executes the run and adds it to the page. With a record, its state hash is compared with the run's. A record without
/// a hash (crashed, timed out, absent) is shown as failed and not repeated.
void add_run(const Scene& scene, const RunSpec& spec, const Record* record, const ViewProgress& progress,
             ViewPage& page);

/// Page of a scene with the runs of these records. The page states when the scene file has changed since.
ViewPage page_of_records(const Scene& scene, const std::vector<const Record*>& records, const ViewProgress& progress);

/// Page of frames without forces. `what`: how they are named under the title. `dt`: s; NaN: the page counts frames.
/// The caller adds a run.
ViewPage page_of_frames(const std::string& name, const std::string& what, const Topology& topology,
                        const Matrix3X& first, double dt, std::int64_t frames);

/// Frames of a recording, without forces. Throws InputError as play_recording.
ViewPage page_of_recording(const std::filesystem::path& file);

/// Adds the subtitle and short distinct run labels. Call after the last run.
void finish_page(const std::vector<RunSpec>& specs, ViewPage& page);

}  // namespace trocar::app
