// The program as a function of the library trocar_app, for `trocar` and for programs with additional methods
// (src/outside.cmake).
#pragma once

#include <filesystem>

namespace trocar::app {

/// Parses and executes the command line. Returns the exit status (DESIGN §10); never throws. `share`: last root for
/// scenes and studies, laid out as share/trocar; empty: none.
int run_program(int argc, char** argv, const std::filesystem::path& share);

}  // namespace trocar::app
