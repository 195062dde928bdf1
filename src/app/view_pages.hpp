// One replay page per scene beside a report, sharing one script: ours and the best other response.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "measure/record.hpp"

namespace trocar::app {

/// Makes DIRECTORY/view anew: viewer.js and SCENE.html of every scene of the records. Scene files are searched for from
/// `study_folder`, where the study's file lies. Each page is made in a child process, so that a method that crashes
/// costs its page only; a scene without a page is reported on stderr, and one whose meshes lie outside the project gets
/// none, since reports are handed on. Returns the number of pages.
std::size_t write_view_pages(const std::filesystem::path& directory, const std::vector<Record>& records,
                             const std::filesystem::path& study_folder,
                             const std::optional<std::filesystem::path>& data);

}  // namespace trocar::app
