#include "scene/scene.hpp"

#include "fuzz_target.hpp"

void trocar::fuzz::scene(std::string_view input) {
    if (asks_for_much(input)) return;
    const std::filesystem::path file = as_file(input, "scene.json");
    Scene scene;
    if (!taken([&] { scene = read_scene(file, std::nullopt); })) return;
    expect(scene.first.position.allFinite(), "a scene begins with finite positions");
    expect(scene.first.position.cols() == scene.topology.vertex_count, "every vertex has a position");
    expect(scene.bodies.size() == scene.topology.bodies.size(), "every body has its motion and shape");
}
