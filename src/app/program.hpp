// The program as a function of the library trocar_app: what `trocar` runs, and every program that a project of its own
// builds out of its methods and trocar's (src/outside.cmake).
#pragma once

#include <filesystem>

namespace trocar::app {

/// Parses the command line, does the work and gives back the exit status (DESIGN §10); never throws. `share` is where
/// scenes and studies are searched for at last, in a folder laid out as share/trocar; empty: nowhere else.
int run_program(int argc, char** argv, const std::filesystem::path& share);

}  // namespace trocar::app
