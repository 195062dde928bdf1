// Scripts that the pages of reports load: one copy for all reports of a folder, or one within the report.
#pragma once

#include <filesystem>
#include <string>

namespace trocar {

/// Folder of the scripts, relative to a report: within it, or beside it for all reports of the same folder.
inline constexpr const char* own_assets = "assets";
inline constexpr const char* shared_assets = "../assets";

/// shared_assets where the folder above the report holds both scripts byte for byte as this program does, as reports/
/// of the project, otherwise own_assets. A report with own_assets can be moved anywhere.
std::string assets_of(const std::filesystem::path& report);

/// Writes both scripts into the folder `assets` of a folder of reports, which thus share them.
void write_shared_assets(const std::filesystem::path& reports);

}  // namespace trocar
