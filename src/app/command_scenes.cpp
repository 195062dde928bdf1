// `trocar scenes`: what can be run, a line each, from the scene files' own words and counts.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "app/shipped.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"
#include "scene/scene.hpp"
#include "study/study.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

/// Up to the first full stop that ends a sentence.
std::string first_sentence(const std::string& text) {
    for (std::size_t i = 0; i + 2 < text.size(); ++i) {
        const bool capital = std::isupper(static_cast<unsigned char>(text[i + 2])) != 0;
        if (text[i] == '.' && text[i + 1] == ' ' && capital) return text.substr(0, i + 1);
    }
    return text;
}

/// The given files, and the .json files of the given folders; without any, what comes with trocar.
std::vector<std::filesystem::path> chosen_scenes(const ScenesOptions& options) {
    std::vector<std::filesystem::path> files;
    if (options.places.empty()) {
        files = options.all ? shipped_scenes() : listed_scenes();
        if (files.empty()) {
            throw InputError("scenes", "", "the folder of trocar's scenes beside the program or as $TROCAR_SHARE",
                             "none");
        }
        return files;
    }
    for (const std::filesystem::path& place : options.places) {
        if (!std::filesystem::is_directory(place)) {
            files.push_back(find_scene(place));
            continue;
        }
        std::vector<std::filesystem::path> here;
        for (const auto& entry : std::filesystem::directory_iterator(place)) {
            if (entry.path().extension() == ".json") here.push_back(entry.path());
        }
        if (here.empty()) throw InputError(place.string(), "", "a folder with scene files (*.json)", "none");
        std::sort(here.begin(), here.end());
        files.insert(files.end(), here.begin(), here.end());
    }
    return files;
}

/// What the file says that it shows; empty when it says nothing.
std::string description_of(const std::filesystem::path& file) {
    const std::string name = file.string();
    const trocar::Json document = parse_json(read_whole(file, "a scene file"), name);
    const auto description = JsonNode(document, name).find("description");
    return description ? description->text() : std::string();
}

struct SceneLine {
    std::filesystem::path file;
    std::string description;
    SceneFacts facts;
    [[nodiscard]] std::string name() const { return file.stem().string(); }
};

Json json_of(const SceneLine& line) {
    const auto known = [&line](const auto& value) { return line.facts.lacks_data ? Json(nullptr) : Json(value); };
    return {{"name", line.name()},
            {"file", line.file.string()},
            {"class", known(line.facts.pair_class)},
            {"bodies", known(line.facts.bodies)},
            {"triangles", known(line.facts.triangles)},
            {"ticks", known(line.facts.ticks)},
            {"dt", known(line.facts.dt)},
            {"description", line.description}};
}

}  // namespace

int scenes(const CommonOptions& common, const ScenesOptions& options) {
    const std::vector<std::filesystem::path> files = chosen_scenes(options);
    if (options.names) {
        for (const std::filesystem::path& file : files) fmt::print("{}\n", file.stem().string());
        return done;
    }
    std::vector<SceneLine> lines;
    lines.reserve(files.size());
    for (const std::filesystem::path& file : files) {
        lines.push_back({file, description_of(file), read_scene_facts(file, common.data)});
    }
    if (common.json) {
        Json list = Json::array();
        for (const SceneLine& line : lines) list.push_back(json_of(line));
        print_json_line(Json{{"scenes", list}});
        return done;
    }
    std::size_t name_width = 4;
    std::size_t class_width = 5;
    for (const SceneLine& line : lines) {
        name_width = std::max(name_width, line.name().size());
        class_width = std::max(class_width, line.facts.pair_class.size());
    }
    fmt::print("{:<{}}  {:<{}}  bodies  triangles  shows\n", "name", name_width, "class", class_width);
    for (const SceneLine& line : lines) {
        const bool known = !line.facts.lacks_data;
        fmt::print("{:<{}}  {:<{}}  {:>6}  {:>9}  {}{}\n", line.name(), name_width, known ? line.facts.pair_class : "-",
                   class_width, known ? std::to_string(line.facts.bodies) : "-",
                   known ? std::to_string(line.facts.triangles) : "-", first_sentence(line.description),
                   known ? "" : " (no data: --data or $TROCAR_DATA)");
    }
    return done;
}

}  // namespace trocar::app
