// Runs of a study as child processes of this program, for the commands that need its records.
#pragma once

#include <filesystem>
#include <vector>

#include "app/commands.hpp"
#include "report/report.hpp"
#include "study/runner.hpp"
#include "study/study.hpp"

namespace trocar::app {

/// The plan with the facts of its scenes. Throws InputError.
std::vector<PlannedRun> completed_plan(const Study& study, const CommonOptions& common);

/// Makes the missing runs of the plan, with progress on a terminal. Uses `file`, `jobs`, `with` and `scenes` of the
/// options. `timed`: false where nobody reads a time, so that all runs may execute in parallel.
RunnerResult run_study(const Study& study, const std::vector<PlannedRun>& plan, const CommonOptions& common,
                       const StudyOptions& options, const std::filesystem::path& directory, bool timed);

/// Replay pages, picture of the worst tick and report of the records in `directory`. Scenes are named from the study's
/// file.
Report write_study_report(const std::filesystem::path& study_file, const CommonOptions& common,
                          const std::filesystem::path& directory, const std::vector<Record>& records);

}  // namespace trocar::app
