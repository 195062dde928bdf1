// Executes the plan with one child process per cell. Finished cells are stored, so that an interrupted benchmark
// resumes. A changed binary or library invalidates them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cells.hpp"

namespace trocar::bench {

struct SessionOptions {
    std::filesystem::path directory;  ///< finished cells: directory/cells; result: directory/records.jsonl
    /// Program and arguments to which "--child-cell ID --child-output FILE [--without LABEL …]" is appended.
    std::vector<std::string> child_command;
    std::vector<CellSpec> plan;
    double time_limit_s = 1200.0;  ///< per cell
    bool progress = false;         ///< true: one line per cell on stderr
};

struct SessionResult {
    bool interrupted = false;
    int made = 0;   ///< cells measured now
    int found = 0;  ///< finished cells of an earlier start
};

/// Measures the missing cells and writes records.jsonl in plan order. An interruption keeps finished cells and writes
/// no records.jsonl. A cell whose method crashes or hangs is measured again without that method. Throws InputError when
/// the directory is not usable or another session uses it.
SessionResult run_session(const SessionOptions& options);

/// Child process: measures one cell of the plan and writes its line to a temporary file, which is renamed to `output`.
void run_child(const std::vector<CellSpec>& plan, const std::string& id, const std::vector<std::string>& without,
               const std::filesystem::path& output);

/// Reads a records.jsonl. Throws InputError with the line number.
std::vector<CellRecord> read_cells(const std::filesystem::path& file);

}  // namespace trocar::bench
