// Creates one replay page per scene beside a report, with ours and the best other response; all pages share one script.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "measure/record.hpp"

namespace trocar::app {

/// Recreates DIRECTORY/view: SCENE.html of every scene of the records, and the script if the report holds its own.
/// Scene files are searched from `study_folder`. Each page is made in a child process, so that a crash costs one page.
/// stderr lists scenes without a page. Scenes with meshes outside the project get none, because reports are published.
/// Returns the number of pages.
std::size_t write_view_pages(const std::filesystem::path& directory, const std::vector<Record>& records,
                             const std::filesystem::path& study_folder,
                             const std::optional<std::filesystem::path>& data);

}  // namespace trocar::app
