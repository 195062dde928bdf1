// Writes a report's files and removes stale files of an earlier report.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace trocar {

/// Writes the files (path relative to the folder -> content) atomically by rename. Removes stale charts/*.svg,
/// results_*.csv and scripts of pages in assets, charts and view. Throws InputError on a write error.
void write_report_files(const std::filesystem::path& directory, const std::map<std::string, std::string>& files);

}  // namespace trocar
