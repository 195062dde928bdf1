// Origin of a number: machine, build and source state.
#pragma once

#include <map>
#include <string>

namespace trocar {

/// "machine", "cpu", "cores", "governor", "kernel", "load", "compiler", "flags", "build_type", "assertions",
/// "sanitizers", "allocations_counted", "version", "commit", "dirty". Facts of the build are those of this library's
/// own build. Facts that cannot be found are "unknown"; "dirty" is "yes", "no" or "unknown".
std::map<std::string, std::string> environment();

}  // namespace trocar
