// A report's files on disk: written as a whole, with what an earlier report left behind removed.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace trocar {

/// Writes the files (path relative to the folder -> content), each beside and then renamed. Removes of an earlier
/// report what these do not name: charts/*.svg and *.js, results_*.csv. Throws InputError when the disk refuses.
void write_report_files(const std::filesystem::path& directory, const std::map<std::string, std::string>& files);

}  // namespace trocar
