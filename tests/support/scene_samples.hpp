// Shipped scenes, and small ones with known results, read by the scene reader.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "scene/scene.hpp"
#include "support/program.hpp"
#include "support/shipped_scenes.hpp"

namespace trocar::test {

inline Scene scene_from_text(const std::string& text) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "scene.json";
    std::ofstream(file) << text;
    return read_scene(file, std::nullopt);
}

inline std::filesystem::path scene_file(const std::string& name) { return scene_folder / (name + ".json"); }
inline Scene shipped_scene(const std::string& name) { return read_scene(scene_file(name), std::nullopt); }
/// To be changed, and read by scene_from_text.
inline nlohmann::json shipped_json(const std::string& name) {
    return nlohmann::json::parse(read_file(scene_file(name)));
}

/// Scripts run `faster` times as fast.
inline void speed_up(Scene& scene, double faster) {
    for (SceneBody& body : scene.bodies) {
        if (!body.motion) continue;
        for (MotionKey& key : body.motion->keys) key.time /= faster;
    }
}

/// A ball of radius 8 mm moves down into a pinned sheet at z = 0. Its lowest point moves from z = +3 mm to -2 mm in 40
/// ms and then rests.
inline std::string poke_text() {
    return R"({"format":"trocar-scene-2","name":"poke","unit":"m","dt":0.001,"ticks":60,"seed":1,"bodies":[
      {"name":"sheet","kind":"tissue","closed":false,"parts":[{"shape":"sheet","size":[0.06,0.06],"edge":0.006}]},
      {"name":"tool","kind":"instrument","closed":true,"parts":[{"shape":"sphere","radius":0.008,"edge":0.002}],
       "motion":{"drive":"prescribed","keys":[{"time":0,"pose":[0.001,0.0007,0.011,0,0,0]},
                                              {"time":0.04,"pose":[0.001,0.0007,0.006,0,0,0]}]}}]})";
}

/// An operator presses a ball `press` metres into the top of a fixed block.
inline std::string press_text(double press) {
    return fmt::format(
        R"({{"format":"trocar-scene-2","name":"press","unit":"m","dt":0.001,"ticks":400,"seed":1,"bodies":[
      {{"name":"block","kind":"rigid","closed":true,"parts":[{{"shape":"box","size":[0.1,0.1,0.02],"edge":0.02}}],
       "pose":[0,0,-0.01,0,0,0]}},
      {{"name":"tool","kind":"instrument","closed":true,"parts":[{{"shape":"sphere","radius":0.008,"edge":0.003}}],
       "motion":{{"drive":"operator","keys":[{{"time":0,"pose":[0,0,0.009,0,0,0]}},
                                            {{"time":0.1,"pose":[0,0,{},0,0,0]}}]}}}}]}})",
        0.008 - press);
}

}  // namespace trocar::test
