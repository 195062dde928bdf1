// A study in parts. Each shard makes its runs in a folder of its own, on any machine, and merging puts the records
// together.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "study/study.hpp"

namespace trocar {

struct Shard {
    std::int64_t number = 1;  ///< from 1
    std::int64_t count = 1;
};

inline constexpr std::int64_t most_shards = 100'000;

/// Reads "K/N". Throws InputError unless 1 <= K <= N.
Shard read_shard(const std::string& text);

/// Sets PlannedRun::shard: run key modulo `count`, for a group that of its first run. Every machine gets the same
/// result. Precondition: every run of `plan` is completed (complete_run).
void assign_shards(std::int64_t count, double time_limit_s, std::vector<PlannedRun>& plan);

/// File in a shard's folder with the plan of the whole study (docs/FORMATS.md).
inline constexpr const char* shard_name = "shard.json";

/// Starts a shard in `directory`: removes the records of an earlier start, keeps its finished runs and writes
/// shard.json. Throws InputError when the folder holds a whole study, or when a runner uses it.
void start_shard(const std::filesystem::path& directory, const Shard& shard, const Study& study,
                 const std::vector<PlannedRun>& plan, const std::string& binary);

struct MergedShards {
    std::filesystem::path study_file;  ///< as the first shard was given it
    std::string records;               ///< one line each, in the order of the plan
    std::int64_t runs = 0;             ///< of the plan
    std::vector<std::string> missing;  ///< planned runs without record, in words
};

/// Reads the folders of shards; of a shard that did not end, the finished runs. Throws InputError for folders of
/// different studies, binaries or numbers of shards. Throws too for a shard that is there twice and for a record of
/// another shard.
MergedShards merge_shards(const std::vector<std::filesystem::path>& folders);

}  // namespace trocar
