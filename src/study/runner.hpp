// Runs a plan with one child process per run; timed runs execute alone. Every finished run is stored in its own file,
// so that an interrupted study resumes.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "study/study.hpp"

namespace trocar {

/// Hash over the program, its loaded libraries and the versions of all methods, 16 hex digits. It changes with a
/// rebuild, an updated library and an edited method of a script.
std::string binary_identity();

struct RunnerOptions {
    std::filesystem::path directory;  ///< finished runs: directory/runs; result: directory/records.jsonl.gz
    /// Program and arguments to which "--child-run I --child-output FILE" is appended, with a --child-run for every run
    /// of a group. The child writes a JSON line for each record, in this order, to a temporary file and renames it to
    /// FILE. Without a complete FILE the run, or the one of the group that had its turn (write_turn), counts as
    /// crashed.
    std::vector<std::string> child_command;
    std::string binary;          ///< finished runs of another binary are ignored
    double time_limit_s = 60.0;  ///< s, per run
    int jobs = 1;                ///< number of parallel runs, for untimed runs only
    std::int64_t shard = 1;      ///< runs of other shards are left out
    bool timed = true;           ///< false: nobody reads a time of any run
    /// Environment of records that no child could write (absent, crashed, timed out).
    std::function<std::map<std::string, std::string>(const PlannedRun&)> environment;
    /// Called before each run, once a second during a run, and at the end. Arguments: number of runs done or started,
    /// and the run (null at the end).
    std::function<void(std::size_t, const PlannedRun*)> progress;
};

struct RunnerResult {
    bool interrupted = false;
    std::int64_t made = 0;   ///< runs made now, including rows without a run
    std::int64_t found = 0;  ///< finished runs of an earlier start
};

/// Executes the missing runs and writes directory/records.jsonl.gz in plan order. An interruption keeps the finished
/// runs and writes no records. Precondition: every run of `plan` is completed (complete_run). Throws InputError when
/// another runner uses the directory.
RunnerResult run_plan(const std::vector<PlannedRun>& plan, const RunnerOptions& options);

/// Child process: notes which run of a group has its turn now.
void write_turn(const std::filesystem::path& output, std::int64_t index);

/// File name of a stored run: hash over everything that decides its result. `facts`: of the run, or the environment of
/// its record; "scene.references" among them is the hash over the scene's references.
std::string run_key(const RunSpec& spec, const std::map<std::string, std::string>& facts, double time_limit_s);

/// Rounds depths, strains and forces of every row to 5 significant digits, to limit the size of published records.
/// Summary figures and hashes keep all digits.
void shorten_rows(Record& record);

/// Thins the rows of a closed loop that is judged in detail on every n-th judged tick. From every n rows it keeps the
/// first, the deepest, the one with the largest force, and those with an error. The summary is computed before
/// thinning.
void thin_rows(Record& record);

}  // namespace trocar
