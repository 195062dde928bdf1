// Access to data outside the project. Tests that need it are skipped with a message when it is absent.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace trocar::test {

/// $TROCAR_DATA/relative, or an empty path when absent.
inline std::filesystem::path data_path(const std::string& relative) {
    const char* folder = std::getenv("TROCAR_DATA");
    if (folder == nullptr || *folder == '\0') return {};
    std::filesystem::path path = std::filesystem::path(folder) / relative;
    return std::filesystem::exists(path) ? path : std::filesystem::path{};
}

}  // namespace trocar::test

/// Skips the test when the file or folder is absent; test.sh counts the messages.
#define TROCAR_DATA_OR_SKIP(variable, relative)                               \
    const std::filesystem::path variable = trocar::test::data_path(relative); \
    if (variable.empty()) GTEST_SKIP() << "no data: " << (relative)
