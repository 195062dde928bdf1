// Style and script that every report's page carries inside.
#pragma once

namespace trocar {

extern const char* const page_style;
/// Classic script: tables sort by a click on a header and filter by a text, rows show the command that makes them again
/// (`data-command`), figures with `data-chart` are drawn by window.trocarCharts where it is there. A page without it
/// loses these and no number.
extern const char* const page_script;

}  // namespace trocar
