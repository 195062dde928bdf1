// Style and script embedded in every report page.
#pragma once

namespace trocar {

extern const char* const page_style;
/// Classic script: sorts tables by header click, filters them by text, and shows each row's command (`data-command`).
/// Figures with `data-chart` are drawn by window.trocarCharts if present. Without the script the page keeps all
/// numbers.
extern const char* const page_script;

}  // namespace trocar
