// Links to replay pages beside a report. `trocar study` and `trocar view DIR --pages` create the pages; a report does
// not.
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

/// True for a run of one unmodified scene moved by a response that is no control.
bool can_be_viewed(const Record& record);

/// Scenes of viewable records, sorted.
std::vector<std::string> viewed_scenes(const std::vector<Record>& records);

/// File name in view_folder for a scene. When two scenes map to one file, only the first has a page.
std::string page_of_scene(const std::string& scene);

/// Names of the pages in a report's directory.
std::set<std::string> pages_there(const std::filesystem::path& directory);

/// Script of the replay pages, relative to them. `assets` as in page_assets.hpp, relative to the report.
std::string viewer_link(const std::string& assets);
/// Makes every replay page of a report that loads its script load that of `assets`.
void link_viewer(const std::filesystem::path& directory, const std::string& assets);

/// Inserts one line under the title of report.md and report.html: links to the existing pages, or how to create them.
/// Does nothing when no scene is viewable. Pure; applied to the finished files.
void add_view_links(const std::vector<Record>& records, const std::set<std::string>& pages,
                    std::map<std::string, std::string>& files);

}  // namespace trocar
