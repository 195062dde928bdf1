#include "app/run_choice.hpp"

#include <fmt/format.h>

#include "geometry/input_error.hpp"
#include "method/device.hpp"
#include "method/registry.hpp"

namespace trocar::app {
namespace {

/// Method text with its parameters in alphabetical order, after checking that it can be made.
std::string checked(const std::string& text, const auto& make) {
    const MethodSpec spec = parse_method(text);
    make(spec.name, spec.parameters);
    return spec.text();
}

}  // namespace

RunSpec spec_of(const MethodChoice& choice) {
    RunSpec spec;
    spec.mode = "closed_loop";
    spec.detector = checked(choice.detector, make_detector);
    spec.response = checked(choice.response, make_response);
    const std::string own = default_contact_generator(parse_method(spec.response));
    spec.contacts = registry().contact_generator(choice.contacts.empty() ? own : choice.contacts).name;
    if (!choice.stepper.empty()) spec.stepper = stepper_text(choice.stepper);
    spec.device = text_of(read_device(choice.device));
    return spec;
}

void check_ticks(std::optional<std::int64_t> ticks) {
    constexpr std::int64_t most = 1'000'000'000;
    if (!ticks || (*ticks >= 1 && *ticks <= most)) return;
    throw InputError("--ticks", "", fmt::format("an integer from 1 to {}", most), fmt::format("{}", *ticks));
}

void set_scene(const Scene& scene, std::optional<std::int64_t> ticks, RunSpec& spec) {
    spec.scene = scene.name;
    spec.scene_file = scene.file.string();
    spec.scene_hash = fmt::format("{:016x}", scene.hash);
    spec.seed = scene.seed;
    spec.ticks = ticks.value_or(scene.ticks);
}

std::function<bool(std::int64_t)> until_interrupted(Progress& progress, SignalsHeld& signals, bool& stopped) {
    return [&](std::int64_t done) {
        progress.show(done);
        stopped = stopped || signals.take_interruption();
        return !stopped;
    };
}

}  // namespace trocar::app
