// The scenes of the project, and the data that some of them need.
#pragma once

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "support/data.hpp"

namespace trocar::test {

inline const std::filesystem::path scene_folder = std::filesystem::path(TROCAR_SOURCE_DIR) / "scenes";

inline std::optional<std::filesystem::path> data_folder() {
    const std::filesystem::path path = data_path(".");
    return path.empty() ? std::nullopt : std::optional(path);
}

inline std::vector<std::string> scene_names() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(scene_folder)) {
        if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

}  // namespace trocar::test
