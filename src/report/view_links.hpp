// Replay pages beside a report: which scenes can have one, and the links to those that are there. The pages are made by
// `trocar study` and `trocar view DIR --pages`; a report never makes them.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

/// Folder of the pages, relative to the report.
inline constexpr const char* view_folder = "view";

/// Whether a record holds a run that can be shown: one scene as its file says, moved by a response, no control.
bool can_be_viewed(const Record& record);

/// The scenes of such records, sorted.
std::vector<std::string> viewed_scenes(const std::vector<Record>& records);

/// The file in view_folder that shows a scene. Of two scenes with the same file the first alone has one.
std::string page_of_scene(const std::string& scene);

/// The names of the pages that lie in a report's directory.
std::set<std::string> pages_there(const std::filesystem::path& directory);

/// Puts one line under the title of report.md and report.html: a link to the page of every scene that has one, or how
/// to make them. Nothing when no scene can have one. Pure; to be called on the finished files.
void add_view_links(const std::vector<Record>& records, const std::set<std::string>& pages,
                    std::map<std::string, std::string>& files);

}  // namespace trocar
