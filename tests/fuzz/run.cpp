// `trocar run` on a scene. The first line of an input names the methods, "DETECTOR RESPONSE CONTACTS STEPPER" with -
// for the default, so that they change with the input and a find that is kept says what it ran; the scene is what
// follows.
#include <sstream>

#include "app/commands.hpp"
#include "fuzz_target.hpp"
#include "scene/scene.hpp"

void trocar::fuzz::run(std::string_view input) {
    constexpr Index most_triangles = 400;
    constexpr std::int64_t ticks = 20;
    const std::size_t end = std::min(input.find('\n'), input.size());
    const std::string_view text = input.substr(std::min(end + 1, input.size()));
    if (asks_for_much(text)) return;
    const std::filesystem::path file = as_file(text, "scene.json");
    app::RunOptions options{.scene = file, .ticks = ticks};
    std::istringstream words{std::string(input.substr(0, end))};
    app::MethodChoice& methods = options.methods;
    for (std::string* method : {&methods.detector, &methods.response, &methods.contacts, &methods.stepper}) {
        std::string word;
        if (words >> word && word != "-") *method = word;
    }
    taken([&] {
        if (read_scene(file, std::nullopt).topology.triangle_count() > most_triangles) return;
        const int status = status_with_json([&] { return app::run({.json = true}, options); });
        expect(status == app::done || status == app::method_failed, "run ends with status 0 or 3");
    });
}
