// Scripts of trocar's pages, embedded in the program. They are built once by esbuild and committed (README.md beside
// this file); building trocar needs no npm.
#pragma once

#include <string_view>

namespace trocar::web {

/// Names under which pages load the scripts. The number counts versions: it rises when pages written for the script of
/// before cannot use the new one.
inline constexpr const char* charts_name = "charts-1.js";
inline constexpr const char* viewer_name = "viewer-1.js";

/// charts.js: a classic script, UTF-8, without "</script"; sets window.trocarCharts.
std::string_view charts_script();

/// viewer.js: likewise; sets window.trocarViewer and shows the data that a page of src/view holds.
std::string_view viewer_script();

}  // namespace trocar::web
