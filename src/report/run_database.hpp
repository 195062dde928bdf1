// Runs as an SQLite database, for questions that no table of a report answers.
#pragma once

#include <filesystem>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

/// Writes three tables. `results`: rows and columns of results.csv, numbers as REAL, words as TEXT, an empty cell as
/// NULL. `facts`: environment of every run by run_id and key. `metrics`: figures.csv. An existing file is replaced
/// by the complete new one. Throws InputError for a file that cannot be written, two records of one run, and column
/// names that differ in case alone.
void write_run_database(const std::vector<Record>& records, const std::filesystem::path& file);

}  // namespace trocar
