// A report's files on disk: written as a whole, with what an earlier report left behind removed, and drawings once more
// as PDF for papers.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace trocar {

/// Writes the files (path relative to the folder -> content), each beside and then renamed. Removes of an earlier
/// report what these do not name: charts/*.svg, *.pdf and *.js, tables/*.tex, results_*.csv. Where rsvg-convert is
/// found on the path, every charts/NAME.svg that changed or has none gets a charts/NAME.pdf; the same drawing gives the
/// same bytes. Throws InputError when the disk refuses; a drawing that cannot be converted has no PDF.
void write_report_files(const std::filesystem::path& directory, const std::map<std::string, std::string>& files);

}  // namespace trocar
