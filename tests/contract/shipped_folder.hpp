// Where the contract tests find scenes and known gaps: the clone, or what is installed of it.
#pragma once

#include <filesystem>

namespace trocar::test {

/// Holds scenes/ and tests/known_gaps.json. The source tree, until it is set to another folder.
std::filesystem::path& shipped_folder();

}  // namespace trocar::test
