// The program as a function of the library trocar_app, for `trocar` and for programs with additional methods
// (src/outside.cmake).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::app {

/// Parses and executes the command line. Returns the exit status (DESIGN §10); never throws. `share`: last root for
/// scenes and studies, laid out as share/trocar; empty: none. `program`: command that starts this program again, for
/// the child processes of a study.
int run_program(int argc, char** argv, const std::filesystem::path& share,
                const std::vector<std::string>& program = {"/proc/self/exe"});

}  // namespace trocar::app
