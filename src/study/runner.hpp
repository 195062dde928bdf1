// Works off a plan: one child process per run, timed ones one after the other, every finished run kept in a file of its
// own, so that an interrupted study goes on where it stopped. No method is named here and none runs in this process.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "study/study.hpp"

namespace trocar {

/// Hash over the program and every library it has loaded, 16 hex digits: a rebuilt program, or a baseline updated on
/// the system, is another binary.
std::string binary_identity();

struct RunnerOptions {
    std::filesystem::path directory;  ///< finished runs go to directory/runs, the result to directory/records.jsonl
    /// Program and arguments to which "--child-run I --child-output FILE" is appended. The child writes the record of
    /// run I (one JSON line) beside FILE and renames it; without a complete FILE the run has crashed.
    std::vector<std::string> child_command;
    std::string binary;          ///< finished runs of another binary do not count
    double time_limit_s = 60.0;  ///< s, per run
    int jobs = 1;                ///< so many runs side by side, of those that nobody times
    /// For rows that no child could write (absent, crashed, timed out): environment of the record.
    std::function<std::map<std::string, std::string>(const PlannedRun&)> environment;
    /// Called before each run, once a second while one runs, and at the end: how many are done or started, and the run
    /// (null at the end).
    std::function<void(std::size_t, const PlannedRun*)> progress;
};

struct RunnerResult {
    bool interrupted = false;
    std::int64_t made = 0;   ///< runs made now, rows without a run included
    std::int64_t found = 0;  ///< finished runs found from an earlier start
};

/// Runs what is missing and writes directory/records.jsonl in plan order. When interrupted, finished runs stay and no
/// records.jsonl is written. `plan` must be completed. Throws InputError when another runner works in the directory.
RunnerResult run_plan(const std::vector<PlannedRun>& plan, const RunnerOptions& options);

/// Whether a report reports a time of this run: then nothing else may run beside it.
bool is_timed(const RunSpec& spec);

/// The name under which a run is kept: hash over everything that decides its result.
std::string run_key(const RunSpec& spec, double time_limit_s);

/// Rounds depths, strains and forces of every row to 5 significant digits, so that the records of a
/// whole study stay small enough to be published. Summary figures and hashes keep all their digits.
void shorten_rows(Record& record);

/// Of a closed loop that is judged in detail on every n-th judged tick: of every n rows leaves the first, the deepest,
/// the one with the largest force, and those in which something went wrong, so that no peak of a chart is lost. The
/// summary has been taken from all.
void thin_rows(Record& record);

}  // namespace trocar
