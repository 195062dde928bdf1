// One static page of many records: machines, versions and methods side by side.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

/// Files of the page by path relative to its folder: index.html, drawings and the script of charts. `sources`: the
/// records of one study folder each, the oldest first. A run has one cell per machine and version of its study:
/// - `ok`: every repetition ended well.
/// - `failed`: some did not; the outcome of the first stands beside.
/// - `excluded`: the method is absent there, or does not support the scene.
/// - `missing`: no record, though another machine or version has one.
/// - `stale`: ok or failed, of a version that is not the last of its machine.
/// Runs of a turned knob have no cell. Throws InputError where two sources hold the same run of one machine and
/// version.
std::map<std::string, std::string> make_board(const std::vector<std::vector<Record>>& sources);

}  // namespace trocar
