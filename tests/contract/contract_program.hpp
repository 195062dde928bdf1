// The contract tests as a function of the library trocar_contract: what a project of its own runs on its methods
// (src/outside.cmake).
#pragma once

#include <filesystem>

namespace trocar::test {

/// Runs the contract tests of the methods that joined from outside (method/outside.hpp), or what --gtest_filter asks
/// for, on the scenes below `share`, a folder laid out as share/trocar. `gaps`: a file as tests/known_gaps.json with
/// what these methods are known to fail; empty: none. Gives back the exit status: 0 all passed; 1 one failed; 2 there
/// is none to run, or methods or gaps cannot be read.
int run_contract_tests(int argc, char** argv, const std::filesystem::path& share, const std::filesystem::path& gaps);

}  // namespace trocar::test
