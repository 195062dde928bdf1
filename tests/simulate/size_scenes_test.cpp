// The scenes of `bench/studies/cost_by_size.json` measure what tissue costs that a tool presses on.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "method/registry.hpp"
#include "scene/scene.hpp"
#include "simulate/simulation.hpp"
#include "support/shipped_scenes.hpp"

namespace trocar {
namespace {

std::filesystem::path studies() { return std::filesystem::path(TROCAR_SOURCE_DIR) / "bench/studies"; }

nlohmann::json cost_by_size() {
    std::ifstream file(studies() / "cost_by_size.json");
    return nlohmann::json::parse(file).at("experiments").at(0);
}

TEST(SizeScenes, ATickOfTheMedianHasATouch) {
    const nlohmann::json study = cost_by_size();
    const auto ticks = study.at("ticks").get<int>();
    const std::optional<std::filesystem::path> data = test::data_folder();
    int scenes = 0;
    for (const auto& entry : study.at("scenes")) {
        const auto name = entry.get<std::string>();
        if (lacks_data(studies() / name, data)) continue;
        const Scene scene = read_scene(studies() / name, data);
        constexpr Index most_vertices = 40000;  // the larger ones are the same scenes on finer meshes
        if (scene.topology.vertex_count > most_vertices) continue;
        ++scenes;
        Simulation simulation(scene, make_detector("ohc_clustered"), make_response("unilateral"),
                              registry().contact_generator(default_contact_generator(parse_method("unilateral"))),
                              {.stepper = parse_method("adaptive_multires"), .watched = false});
        int touched = 0;
        for (int tick = 0; tick < ticks; ++tick) {
            touched += simulation.step().tool_force.norm() > 0.0 ? 1 : 0;
            ASSERT_TRUE(simulation.outcome().ok()) << name << ": " << simulation.outcome().message;
        }
        EXPECT_GT(2 * touched, ticks) << name;
    }
    EXPECT_GE(scenes, 8);
}

}  // namespace
}  // namespace trocar
