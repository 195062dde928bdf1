// `trocar draw`: writes the scenes of a family, drawn by a seed, as files that every other command and a study take.
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "scene/resolution_scenes.hpp"

namespace trocar::app {

int draw(const CommonOptions& common, const DrawOptions& options) {
    if (std::filesystem::exists(options.folder) &&
        (!std::filesystem::is_directory(options.folder) || !std::filesystem::is_empty(options.folder))) {
        throw InputError(options.folder.string(), "", "a new or an empty folder", "something in it");
    }
    const std::vector<DrawnScene> scenes = draw_resolution_scenes(options.seed);
    std::filesystem::create_directories(options.folder);
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const DrawnScene& scene : scenes) {
        const std::filesystem::path file = options.folder / (scene.name + ".json");
        write_whole(file, scene.text);
        list.push_back({{"name", scene.name}, {"group", scene.group}, {"file", file.string()}});
    }
    if (common.json) {
        fmt::print("{}\n", nlohmann::ordered_json{{"seed", options.seed}, {"scenes", list}}.dump());
    } else {
        fmt::print("{} scenes in {}\n", scenes.size(), options.folder.string());
    }
    return done;
}

}  // namespace trocar::app
