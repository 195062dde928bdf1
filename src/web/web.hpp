// Scripts of trocar's pages, embedded in the program. They are built once by esbuild and committed (README.md beside
// this file); building trocar needs no npm.
#pragma once

#include <string_view>

namespace trocar::web {

/// charts.js: a classic script, UTF-8, without "</script"; sets window.trocarCharts.
std::string_view charts_script();

/// viewer.js: likewise; sets window.trocarViewer and shows the data that a page of src/view holds.
std::string_view viewer_script();

}  // namespace trocar::web
