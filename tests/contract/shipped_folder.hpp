// Where the contract tests find scenes and known gaps: the clone, or what is installed of it.
#pragma once

#include <filesystem>
#include <vector>

namespace trocar::test {

/// Holds scenes/ and tests/known_gaps.json. The source tree, until it is set to another folder.
std::filesystem::path& shipped_folder();

/// Files of known gaps: the shipped one, and those that a project of its own has added.
std::vector<std::filesystem::path> gap_files();
void add_gap_file(const std::filesystem::path& file);

}  // namespace trocar::test
