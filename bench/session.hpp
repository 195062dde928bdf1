// Works off the plan of cells, one child process per cell, and keeps every finished cell, so that an interrupted
// benchmark goes on where it stopped. Another binary, a baseline updated on the system included, starts anew.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cells.hpp"

namespace trocar::bench {

struct SessionOptions {
    std::filesystem::path directory;  ///< finished cells go to directory/cells, the result to directory/records.jsonl
    /// Program and arguments to which "--child-cell ID --child-output FILE [--without LABEL …]" is appended.
    std::vector<std::string> child_command;
    std::vector<CellSpec> plan;
    double time_limit_s = 1200.0;  ///< per cell
    bool progress = false;         ///< a line per cell on stderr
};

struct SessionResult {
    bool interrupted = false;
    int made = 0;   ///< cells measured now
    int found = 0;  ///< finished cells of an earlier start
};

/// Measures what is missing and writes records.jsonl in plan order; when interrupted, finished cells stay and no
/// records.jsonl is written. A method that takes its cell down is set aside and the cell is measured without it.
/// Throws InputError when the directory cannot be used or another session is in it.
SessionResult run_session(const SessionOptions& options);

/// What the child does: measures one cell of the plan and writes its line beside `output`, then renames.
void run_child(const std::vector<CellSpec>& plan, const std::string& id, const std::vector<std::string>& without,
               const std::filesystem::path& output);

/// Reads a records.jsonl; throws InputError with the line.
std::vector<CellRecord> read_cells(const std::filesystem::path& file);

}  // namespace trocar::bench
