// `trocar draw`: writes the scenes of a family, drawn by a seed, as files that every other command and a study take.
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "export/exporter.hpp"
#include "geometry/whole_file.hpp"
#include "scene/judged_scenes.hpp"
#include "scene/resolution_scenes.hpp"

namespace trocar::app {

int draw(const CommonOptions& common, const DrawOptions& options) {
    UnfinishedFolder folder(options.folder);
    const std::vector<DrawnScene> scenes =
        options.family == "judged" ? draw_judged_scenes(options.seed) : draw_resolution_scenes(options.seed);
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const DrawnScene& scene : scenes) {
        const std::string file = scene.name + ".json";
        write_whole(folder.path() / file, scene.text);
        list.push_back({{"name", scene.name}, {"group", scene.group}, {"file", (options.folder / file).string()}});
    }
    folder.keep();
    if (common.json) {
        print_json_line(nlohmann::ordered_json{{"seed", options.seed}, {"scenes", list}});
    } else {
        fmt::print("{} scenes in {}\n", scenes.size(), options.folder.string());
    }
    return done;
}

}  // namespace trocar::app
