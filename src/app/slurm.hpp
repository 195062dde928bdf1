// Submits a study to Slurm: an array of shards, and a job that merges them.
#pragma once

#include <filesystem>
#include <vector>

#include "app/commands.hpp"
#include "study/shard.hpp"
#include "study/study.hpp"

namespace trocar::app {

/// Folder of one shard of the study whose folder is `whole`: "whole.shards/K-of-N".
std::filesystem::path shard_folder(const std::filesystem::path& whole, const Shard& shard);

/// Writes both job scripts to "whole.shards" and submits them. The merge writes to `whole`. Uses `file`, `with`,
/// `jobs`, `array` and `time` of the options. Returns the exit status. Throws InputError without sbatch, when sbatch
/// refuses a script, and when `whole` holds anything.
int submit_to_slurm(const Study& study, const std::vector<PlannedRun>& plan, const CommonOptions& common,
                    const StudyOptions& options, const std::filesystem::path& whole);

}  // namespace trocar::app
